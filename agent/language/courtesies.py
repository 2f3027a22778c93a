"""Courtesies and new starts: phrases that ask for nothing by themselves, as templates (see `template`)."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.template import Constructions
from robosandbox.agent.language.tokens import MARKS, SceneWords, Token

_JOB = "(job|task|order|instruction|assignment|mission|challenge|objective|goal)"
_FINISHED = "(done|finished|through)"
REQUESTS = {
    # A wish about what you would do is a request.
    "[(i|we) (am|are|was|were|have been)] (wondering|hoping|thinking) [whether!|if!|that] you [could|would|can|might|may]": "could you",
    "(i|we) (wonder|hope|think|reckon|suppose|believe|guess) [whether!|if!|that] you (could|would|can|might|may|will|should)": "could you",
    "(i|we) (do|did) not! suppose you [could|would|can|might|may]": "could you",
    "(i|it|we|that) would {_praise} (if!|that|were) you [could|would|can|might|may]": "could you",
    "(do|would|did) you (think|reckon|suppose) [that|maybe|perhaps] you [could|would|can|might|may]": "could you",
    "[is there|there is] (any|a|some) (chance|way|possibility) [that|of] you [could|would|can|might|may]": "could you",
    "would you be {_praise} (as to|and|to)": "could you",
    "(let me|might i|may i|can i|could i) [please] (ask|request|trouble|bother|get|have) [of] you [to]": "",
}
OPENINGS = {
    "(<start>|i am sorry|sorry) (to (bother|trouble|disturb|interrupt|ask)|for the (bother|trouble)) [you] [again!] [,] [but]": "",
    "let us get (going|started|cracking|moving|to work)": "",
    "<edge> (your|the) [next!|first!|new|second!|last!|final!] "
    + _JOB
    + " [is this|is as follows|is simple|today|for today] (:|,|.)": "",
    "(for|as) (your|the|my) [next!|first!|second!|last!|final!] [" + _JOB + "|trick|request] (:|,)": "",
    "(first!|next!|last!|one|final!) (thing|up|job|order of business|task) [first!] (:|,)": "",
    "<edge> [the] (thing|fact|point|deal|truth) is [that|this|,|:]": "",
    "do (this|the following|as follows|something) [for me|for us] (:|,)": "",
    "(look at|see) (this|that|the|all this) (mess|chaos|clutter|state) (,|.|!)": "",
    "what (a|an) (mess|chaos|day|state) (,|.|!)": "",
    # What fillers leave: "(if you would be so kind) as to", "for (my friend)".
    "<start> (the|your|my|a) (:|,)": "",
    "<start> as to": "",
    "<start> {_word} (robot|arm|machine) ,": "",
    "you there ,": "",
}
ASIDES = {
    "for <end>": "",
    "and <end>": "",
    "(with|by) you <end>": "",
    "as as (possible|you can)": "",
    "(in advance|and thank you|and thanks)": "",
    "(terribly|awfully|by any chance|as usual|as always|as discussed|as agreed|as promised|as requested)": "",
    "do not! (worry|panic|rush|hurry) [about it]": "",
    "(by the time|when!|once!|after!|as soon as) you are [all] " + _FINISHED + " {thing}": "{thing}",
    "(when!|once!|after!|as soon as) you [are|have] [all] (done|finished|through|finish) <end>": "",
    "(i|we) do not! (mind|care) [about] [in] (the|which|what|whatever) order [you (do|use|pick|choose|like) [it|them] [in]]": "",
    "(i|we) do not! (mind|care) [which|what|whichever|at all] [one|of them|you pick|you choose|you take]": "",
    "(it|that) does not! [really] matter [which|to me|at all]": "",
    # In the wrong place it is, and nobody was wrong.
    "wrong {where:place|spot|position}": "bad {where}",
}  # fmt: skip
COURTESIES = Constructions(REQUESTS, OPENINGS, ASIDES)


def restarted(tokens: Sequence[Token]) -> Sequence[Token]:
    """As in "both cans need to... no, forget that, just tap the lid": what was broken off does not count."""
    for i in range(len(tokens) - 3, 0, -1):
        if tokens[i].text in ("forget", "scratch", "strike", "ignore") and tokens[i + 1].text in ("that", "it", "this"):
            return tokens[i + 2 :] if tokens[i + 2].text in MARKS else tokens
    return tokens


def without_courtesies(tokens: Sequence[Token], words: SceneWords) -> tuple[Token, ...]:
    """Return the tokens without the phrases of politeness; a wish about what you would do becomes a request."""
    return COURTESIES.applied(tokens, words)
