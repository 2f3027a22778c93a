"""Courtesies and new starts: phrases that ask for nothing by themselves, found in the words of a sentence."""

from __future__ import annotations

import re
from collections.abc import Sequence

from robosandbox.agent.language.tokens import Token

MARKS = frozenset(",.;!?:")
_COURTESIES = tuple(
    re.compile(rf"(?<= )(?:{pattern})(?= )")
    for pattern in (
        r"(?:(?:i|we) (?:am|are|was|were|have been) )?(?:wondering|hoping|thinking)(?: whether| if| that| maybe| of)?(?= you | we | , )",
        r"(?:i|we) (?:wonder|hope|think|reckon|suppose|believe|guess)(?: whether| if| that)?(?= you (?:could|would|can|might|may|will|should) )",
        r"(?:i|it|we|that) would (?:(?:be|really|so|very|ever|much|just|mean|a|lot|make|me|us|my|day|help|it|do|like|love|"
        r"appreciate|great|good|nice|lovely|kind|super|helpful|handy|happy|glad|grateful|thankful|delighted|awfully|most|"
        r"extremely|of|you|fantastic|wonderful|brilliant|big|huge|world|the|to|world) )*(?:if|that|were)(?= you )",
        r"(?:i|we) (?:do not|did not) suppose(?= you )",
        r"(?:do|would|did) you (?:think|reckon|suppose)(?: that| maybe| perhaps)?(?= you )",
        r"(?:is there |there is )?(?:any|a|some) (?:chance|way|possibility)(?: that| of)?(?= you | getting| putting| moving| picking)",
        r"(?:(?:i am )?sorry |(?<=^ ))(?:to (?:bother|trouble|disturb|interrupt|ask|be a (?:pain|bother|nuisance))|for (?:the )?(?:bother|trouble|\w+ing))"
        r"(?: you)?(?: again)?(?: ,)?(?: but)?",
        r"i (?:hate|do not want|do not like) to (?:bother|trouble|disturb|interrupt|ask|impose|nag)(?: you)?(?: again)?(?: ,)?(?: but)?",
        r"i know (?:you are|it is|this is) [a-z ]{1,30}? but",
        r"(?:i|we) (?:could )?(?:need|could use|would like|have) (?:your|some|a little|a bit of|a|another) "
        r"(?:help|hand|favou?r|assistance|task|job|request|quick task|quick job|small task|little job|small favou?r|quick favou?r)"
        r"(?: for you| from you| to ask| of you| with something| here)*",
        r"let us get (?:going|started|cracking|moving|on with it|to work)",
        r"(?:your|the) (?:next|first|new|second|last|final)? ?(?:job|task|order|instruction|assignment|mission|challenge|objective|goal)"
        r"(?: is this| is as follows| is simple| today| now| for today| here| will be)?(?= [:,.])",
        r"(?:for|as) (?:your|the|my|a)(?: next| first| second| last| final)?(?: (?:job|task|trick|challenge|request))?(?= [:,])",
        r"for(?= $)|(?<=^ )(?:the|your|my|a)(?= [:,])|(?<=^ )as to|(?<=^ )\w+ (?:robot|arm|machine)(?= ,)",
        r"(?:first|next|last|one|final) (?:thing|up|job|order|order of business|task)(?: first)?(?= [:,])",
        r"(?:here|this) is (?:what|the (?:plan|deal|task|thing|job|idea|situation))(?: (?:i|we) (?:want|need|would like)(?: from)? ?(?:you)? ?(?:to do)?)?(?= [:,.])",
        r"(?:the )?(?:thing|fact|point|deal|truth|long and short of it) is(?: that| this| ,| :)?",
        r"(?:can|could|would|will) you (?:please )?do (?:this|something|that|one thing|me this)(?: for me| for us)?(?= [:,?])",
        r"(?:please )?do (?:this|the following|as follows|something)(?: for me| for us| now)?(?= [:,])",
        r"would you be (?:so |very |really |terribly )*(?:kind|nice|good|sweet|lovely|helpful)(?: enough)?(?: as to| and| to)",
        r"as as (?:possible|you (?:possibly )?can)|and(?= (?:[.!] )?$)|you there(?= ,)",
        r"(?:without|(?:but |and |please )?(?:do not|never)) (?:drop|dropping|break|breaking|spill|spilling|damage|damaging|scratch|scratching|squash|squashing|crush|crushing|lose|losing) (?:it|them|anything|any)(?= (?:[,.!;] |$|and |but ))",
        r"(?:look at|see) (?:this|that|the|all this) (?:mess|chaos|clutter|state)(?= [,.!])|what an? (?:mess|chaos|day|nice day|lovely day|state)(?= [,.!])",
        r"in advance|and thank you|and thanks",
        r"there is a (?:good|nice|dear|clever) \w+",
        r"(?:and )?that is (?:it|all|everything|enough)(?: for now| for today| i need| i want| i ask)?(?= [,.!] | $)",
        r"(?:i|we) (?:beg|implore|beseech|urge|ask|pray)(?: of)? you(?: to)?",
        r"for (?:goodness|heaven|heavens|god|gods|pete|petes|christ|my|crying out|the love of \w+)(?: s)?(?: sake| loud)?(?= [,.!] | $)",
        r"as (?:quickly|fast|soon|carefully|gently|slowly|neatly|best|well|precisely|accurately) as (?:possible|you can|you like|you possibly can)",
        r"(?:with no|without|no) (?:delay|hurry|rush|fuss|ado|further ado|any fuss|hesitation|further delay|pressure)",
        r"at your (?:earliest )?(?:convenience|leisure)|in your own time|in no time|any time now|at some point",
        r"(?:let me|might i|may i|can i|could i)(?: please)? (?:ask|request|trouble|bother|get|have) (?:of )?you(?: to)?",
        r"(?:my|oh|o)(?: my)?(?: \w+)? (?:robot|arm|assistant|machine|helper)",
        r"(?:what|how) do you say",
        r"if (?:you|i) (?:ask|asked) me",
        r"do not (?:worry|panic|rush|hurry)(?: about it)?|no worries",
        r"(?:of|from) (?:where it (?:is|stands|sits|was)|its (?:current|present) (?:place|position|spot|location)|here|there)(?: right| just)?(?: now)?",
        r"(?:by the time|when|once|after|as soon as) you are(?: all)? (?:done|finished|through)(?= (?:the|my|your|all|every|both|each|a|i|there) )",
        r"(?:once|when|after|as soon as) (?:you are|you have|you)(?: all)? (?:finished|done|through|finish)(?= (?:[,.!?] )?$)",
        r"(?:with|by) you(?= (?:[,.!?] )?$)|in the end(?= (?:[,.!?] )?$)|at the end(?= (?:[,.!?] )?$)",
        r"terribly|awfully|by any chance|per chance|perchance|as usual|as always|as before|as discussed|as agreed|as promised|as requested",
        r"(?:i|we) do not (?:mind|care)(?: about)?(?: in)? ?(?:the|which|what|whatever)? order(?: you (?:do|use|pick|choose|like)(?: it| them)?(?: in)?)?",
        r"(?:i|we) do not (?:mind|care)(?: which| what| whichever| at all)?(?: one| of them| you (?:pick|choose|take))?",
        r"(?:it|that) does not (?:really )?matter(?: which| to me| at all)?(?: one| you (?:pick|choose|take))?",
        r"(?:which|what)ever (?:one )?you (?:prefer|like|want|fancy|choose|please|feel like|find)(?: most)?(?: best| better| first| easier| easiest)?",
        r"(?:either|any|both) (?:one |of them |way )?(?:is|are|will|would|works?) ?(?:be |do )?(?:fine|okay|ok|good|great|acceptable|alright)?(?: with me| by me| for me)?(?= [,.!] | $)",
    )
)
"""Searched in the words, joined by single spaces."""


def restarted(tokens: Sequence[Token]) -> Sequence[Token]:
    """As in "both cans need to... no, forget that, just tap the lid": what was broken off does not count."""
    for i in range(len(tokens) - 3, 0, -1):
        if tokens[i].text in ("forget", "scratch", "strike", "ignore") and tokens[i + 1].text in ("that", "it", "this"):
            return tokens[i + 2 :] if tokens[i + 2].text in MARKS else tokens
    return tokens


def without_courtesies(tokens: Sequence[Token]) -> tuple[Token, ...]:
    """Return the tokens without the phrases of politeness; a wish about what you would do becomes a request."""
    text = f" {' '.join(token.text for token in tokens)} "
    starts: dict[int, int] = {}
    at = 1
    for k, token in enumerate(tokens):
        starts[at] = k
        at += len(token.text) + 1
    gone: set[int] = set()
    for pattern in _COURTESIES:
        for match in pattern.finditer(text):
            first = starts.get(match.start())
            if first is not None and match[0].strip():
                gone.update(range(first, first + len(match[0].split())))
    kept: list[Token] = []
    for k, token in enumerate(tokens):
        if k in gone:
            continue
        if token.text == "you" and k - 1 in gone and not (kept and kept[-1].text in ("could", "would", "can", "will")):
            # "I'd be glad if you picked it up": an asking, as in "could you".
            kept.append(Token("could", "could", "word"))
            following = tokens[k + 1].text if k + 1 < len(tokens) else ""
            if following in ("could", "would", "can", "will", "might", "may"):
                kept.append(token)
                gone.add(k + 1)
                continue
        if token.text == "wrong" and k + 1 < len(tokens) and tokens[k + 1].text in ("place", "spot", "position"):
            # In the wrong place it is, and nobody was wrong.
            token = Token("bad", token.raw, "word")
        kept.append(token)
    return tuple(kept)
