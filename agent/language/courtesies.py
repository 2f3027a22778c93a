"""Courtesies and new starts: phrases that ask for nothing by themselves, as templates (see `template`)."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.template import Constructions
from robosandbox.agent.language.tokens import MARKS, SceneWords, Token

# fmt: off
PARTS = {
    "we": "(i|we)",
    "might": "(could|would|can|might|may)",
    "think": "(think|reckon|suppose)",
    "bother": "(bother|trouble|disturb|interrupt|ask) [you] [again!] [,] [but]",
    "job": "(job|task|order|instruction|assignment|mission|challenge|objective|goal)",
    "which": "[next!|first!|new|second!|last!|final!]",
    "finished": "[all] (done|finished|through|finish)",
    "to": "[in order] to",
    "more": "[some|more|a bit more|a little more|enough|extra|a bit of]",
    "mess": "(mess|chaos|clutter|day|state)",
    "break": "(crushing|breaking|dropping|spilling|damaging|scratching|squashing)",
}
REQUESTS = {
    # A wish about what you would do is a request.
    "[<we> (am|are|was|were|have been)] (wondering|hoping|thinking) [whether!|if!|that] you [<might>]": "could you",
    "<we> (wonder|hope|think|reckon|suppose|believe|guess) [whether!|if!|that] you (<might>|will|should)": "could you",
    "<we> (do|did) not! suppose you [<might>]": "could you",
    "(i|it|we|that) would {_praise} (if!|that|were) you [<might>]": "could you",
    "(do|would|did) you <think> [that|maybe|perhaps] you [<might>]": "could you",
    "[is there|there is] (any|a|some) (chance|way|possibility) [that|of] you [<might>]": "could you",
    "would you be {_praise} (as to|and|to)": "could you",
    "<we> wish [that] you [<might>]": "could you",
    "is it possible [for you] (that you|to|for you to)": "could you",
    "<start> is possible (that you|you|to|for you to)": "could you",
    "it is (necessary|needed|required|important) (to|that you|for you to)": "",
    "<might> <we> [please|just] (trouble|bother|ask) you for {thing} {place}": "put {thing} {place}",
    "<might> <we> [please|just] (trouble|bother|ask) you for {that} <end>": "pick up {that}",
    "(let me|might i|may i|can i|could i) [please] (ask|request|trouble|bother|get|have) [of] you [to]": "",
    "<we> (beg|implore|urge|ask) [of] you to": "",
    "(would|will|is|might|could) it be possible for {thing} to (go|sit|stand|end up|lie|live)": "{thing} should go",
    "(would|will|is|might|could) it be possible for {thing} to [be]": "{thing} should be",
    "(any|is there [any|a]) (chance|possibility) of {thing} (going|being put|being placed|getting|ending up) {place}": "put {thing} {place}",
    "(<start>|would you) be (so|very) (good|kind|nice|sweet|lovely) as to": "could you",
    "(it is|it was) [about|high|surely|now|well|past] time [that] (you|we|somebody|someone|i) {VERB}": "could you {VERB}",
    "it is [about|high|surely|now|well|past] time [that] {thing} (was|were|got)": "{thing} should be",
    "<we> should be {_praise} if! you [<might>]": "could you",
    "<we> (would|should) (appreciate|welcome|like|love|enjoy) (you|your) {doing}": "start {doing}",
    "<start> let us (begin|start|kick off|commence) (with|by)": "start with",
    "<start> (continue|proceed|carry on|go on|move on|moving on|continuing) (with|to) {thing} (:|,)": "{thing} ,",
    "<start> (start|begin|commence) (with|by) {thing} (,|:|;|.) (it|they) (goes|go)": "{thing} goes",
    "<start> [and] next! (up|in line) is {thing} [,|:] {place}": "put {thing} {place}",
    "<start> your <which> <job> [for] [now|today] is {doing}": "start {doing}",
    "<start> (mission|objective|assignment|errand|duty|todo|request) :": "",
    "{thing} (goes|go) there (next!|after! that|too|as well) <edge>": "{thing} goes there",
    "<start> we {VERB} {thing} {place} [,|.|;] [and] then [we]": "{VERB} {thing} {place} , then",
    "(it|that|this|they) (is|are) [all|a bit|a little|very|so|too|rather|quite] {_word} but (never! mind|no! matter|that is (okay|fine)|do not! worry) [,|.]": "",
    "<start> <we> (like|want|wish|prefer) that you {VERB}": "{VERB}",
    "could you be (able|willing|prepared|inclined|happy) to": "could you",
}
OPENINGS = {
    "(<start>|i am sorry|sorry) (to <bother>|for the (bother|trouble))": "",
    "i (hate|do not! (want|like)) to <bother>": "",
    "i know (you are|it is|this is) {_words} but": "",
    "<start> (sort|separate|divide|split|organise|organize|arrange|distribute|tidy|tidy up|clean up) [them|things|everything|it|the rest] [up|out] :": "",
    "<start> [my|the|our] ({_person}|{_name}) (say|says|said|asks|asked) [me|you|us|that] [to|:|,]": "",
    "<start> (i|we) (was|were) (going to say|about to say|thinking of|going to ask for|going for) {_thing} [,] but [no!|actually] [,]": "",
    "<start> (mr|mrs|ms|miss|dr) {_name} (order|prescription|request) (:|,)": "",
    "<start> (order|prescription|request) for {_name} [{_name2}] (:|,)": "",
    "<start> {_words} is not! (here|there) [,] (but|so)": "",
    "<start> {_words} , [oh|no!|ah] never! mind [that] [,]": "",
    "[now] what <we> (would like|want|need) you to do [now|next!|first!] is [to|:|,]": "",
    "what you do is [you|to]": "",
    "<start> (goal|aim|target|action|request|command|job|task|exec|cmd|run) :": "",
    "<start> new (task|job|order|command|instruction)": "",
    "let us get (going|started|cracking|moving|to work)": "",
    "(can|could|would|will) you do (this|something|that|one thing) [for me|for us] (:|,|?|.)": "",
    "do (this|the following|as follows|something) [for me|for us] (:|,)": "",
    "here is (the (plan|deal|idea|thing|<job>)|what <we> (want|need) [you to do]) (:|,|.)": "",
    "<edge> (your|the) <which> <job> [is this|is as follows|is simple|today|for today] (:|,|.)": "",
    "(for|as) (your|the|my) <which> [<job>|trick|request] (:|,)": "",
    "(first!|next!|last!|one|final!) (thing|up|job|order of business|task) [first!] (:|,)": "",
    "<edge> [the] (thing|fact|point|deal|truth) is [that|this|,|:]": "",
    "(look at|see) (this|that|the|all this) <mess> (,|.|!)": "",
    "what (a|an) <mess> (,|.|!)": "",
    # What fillers leave: "(if you would be so kind) as to", "for (my friend)".
    "<start> (the|your|my|a) (:|,)": "",
    "<start> as to": "",
    "<start> {_word} (robot|arm|machine) ,": "",
    "you there ,": "",
}
ASIDES = {
    "for <end>": "",
    "(and|then) [then] [you] (stop|finish|quit|are done|are finished|can stop|that is all|done) <end>": "",
    "[,] [it is] (tidy up|tidying|tidying up|clean up|cleanup|bed|lunch|dinner|play|party|home|snack) time <end>": "",
    "<start> [it is] (({_name}|tidy|tidy up|clean|clean up|bath|tea|lunch|dinner|play|work|snack|bed|show|party|coffee) time|bedtime|bathtime|teatime|lunchtime|playtime|showtime) [now] (:|!)": "",
    "<start> [it is] time (to|for) [the] {_name} (:|!)": "",
    ", (i|we) want to (see|hear|know|check|find out|test) (if!|whether!|how|what) {_words} <end>": "",
    "(i am|we are) (in a (hurry|rush)|hungry|starving|late|tired|bored|busy|waiting) <edge>": "",
    "<start> out of (my|the) way ,": "",
    "and <end>": "",
    "(with|by) you <end>": "",
    "as as (possible|you can)": "",
    "(in advance|and thank you|and thanks)": "",
    "(terribly|awfully|by any chance|as usual|as always|as discussed|as agreed|as promised|as requested)": "",
    "(do not! (worry|panic|rush|hurry) [about it]|no! worries)": "",
    "(without!|with no!) [any|further] (delay|hurry|rush|fuss|ado|hesitation)": "",
    "without! <break> (it|them|anything) <edge>": "",
    "at your [earliest] (convenience|leisure)": "",
    "(in your own time|at some point|any time now)": "",
    "for (goodness|heaven|heavens|god|pete) sake": "",
    ", [and] that is (it|all|everything|enough) [for now|for today|<we> (need|want|ask)] <end>": "",
    "(by the time|when!|once!|after!|as soon! as) you are <finished> {thing}": "{thing}",
    "(when!|once!|after!|as soon! as) you [are|have] <finished> <end>": "",
    "in the end <end>": "",
    "<we> do not! (mind|care) [about] [in] (the|which|what|whatever) order [you (do|use|pick|choose|like) [it|them] [in]]": "",
    "<we> do not! (mind|care) [which|what|whichever|at all] [one|of them|you pick|you choose|you take]": "",
    "(it|that) does not! [really] matter [which|to me|at all]": "",
    # In the wrong place it is, and nobody was wrong.
    "wrong {where:place|spot|position}": "bad {where}",
}
PURPOSES = {
    "<start> <to> (make|free|get|create|clear|save|leave|give|have|gain) [up] [me|us|you] <more> (room|space) [for {_word}|for {_word} {_word2}] <end>": "",
    "<start> <to> (make|clear|free) [the|some|a] way [for {_word}] <end>": "",
    "<start> <to> (get|keep|move) (it|this|that|them|things) out of (the|my|our) way <end>": "",
    "<start> <to> keep (it|this|them|things|everything|the (table|place|desk)) (safe|tidy|clean|neat|out of the way|organised|organized|nice) <end>": "",
    "<start> <to> (see|check|test|find out|hear|know) (if!|whether!) {_words} <end>": "",
    "<start> <to> be (safe|helpful|nice|sure|on the safe side|tidy) <end>": "",
    "<start> <to> (help|please|impress|assist) (me|us|my {_word}|them|him|her) [out] <end>": "",
    "<start> <to> (tidy|clean) [things] up [a bit|a little] <end>": "",
    "<start> <to> (avoid!|prevent) (accidents|an accident|trouble|a mess|confusion|clutter) <end>": "",
}
# fmt: on
POLITE = Constructions(REQUESTS, parts=PARTS)
"""Tried first of all: what stands before an order hides that one begins."""
COURTESIES = Constructions(OPENINGS, ASIDES, parts=PARTS)
_PURPOSES = Constructions(PURPOSES, parts=PARTS)


def restarted(tokens: Sequence[Token]) -> Sequence[Token]:
    """As in "both cans need to... no, forget that, just tap the lid": what was broken off does not count."""
    for i in range(len(tokens) - 3, 0, -1):
        if tokens[i].text in ("forget", "scratch", "strike", "ignore") and tokens[i + 1].text in ("that", "it", "this"):
            return tokens[i + 2 :] if tokens[i + 2].text in MARKS else tokens
    return tokens


def is_purpose(tokens: Sequence[Token], words: SceneWords) -> bool:
    """Say whether words tell what a command is good for and bind nothing: "to make room"."""
    return bool(tokens) and not _PURPOSES.applied(tokens, words)
