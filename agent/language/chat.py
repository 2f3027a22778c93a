"""Chat beside an order: thanks, no hurry, "if that is all right", greetings; left out where a whole clause is no more than that.

A clause is what stands between two marks. What is said with an order in one clause goes only from its end, and only if
nobody would mean anything else by it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from robosandbox.agent.language import lazy_regex
from robosandbox.agent.language.wordlist import phrase_list, word_set

if TYPE_CHECKING:
    from robosandbox.agent.language.tokens import Token

_PARTS = {
    "very": "(very|so|really|too|that|quite|all|super|most)",
    "ok": "(fine|ok|okay|all right|alright|possible|convenient|doable)",
    "fine": "(<ok>|good|great|nice|lovely|cool|perfect|awesome|wonderful)",
    "you": "(with|by|for) (you|everyone|everybody)",
    "friend": "(my friend|friend|mate|buddy|pal|robot|dear|my dear|love|darling|sir|champ|sweetie|little one|everyone|you)",
    "it": "(it|that|this)",
    "day": "(day|morning|afternoon|evening|weekend|time|one)",
}
# "(a|b)" one of them, "[a]" or nothing, "<it>" a part.
_WITH_AN_ORDER = """
    [a (big|huge)] (thanks|thank you|thank u|many thanks|thx) [(very much|a lot|a million|a bunch|a ton|heaps|loads|so much|so very much|ever so much|kindly|again) [indeed]] [in advance] [for (your|the|all your) (help|assistance|time|patience|effort|hard work|kindness|trouble|support)|for helping [me|us] [out]|for being so (kind|helpful|nice|patient|good)|for doing <it>] [<friend>],
    no (rush|hurry|pressure) [at all|whatsoever|on <it>|with <it>] [<friend>], there is [absolutely|really] no (rush|hurry) [at all],
    (if|hope|i hope|hoping) <it> (is|was|would be) <ok> [<you>], (if|hope|i hope|hoping) <it> is not [<very>] [much of] (a|too much) (problem|trouble|bother|hassle) [for you],
    if (<it>|they) (works|suits|work|suit) [for] you, if you are not [<very>] (busy|tired), as soon as (you can|you are able to|possible),
    if nobody minds, if i may [(ask|say) [so]], if you would not mind [too much], at your own (pace|speed), in your own time, with pleasure, (ta|cheers) [very much|a lot|a bunch|ever so|ever so much] [indeed] [<friend>]
"""
_ALONE = """
    you can do <it> [for (me|us)] [right|okay], i [(know|am sure|believe|think|bet|trust) that|know|am sure|believe|think|bet|trust] you can (do|manage) <it>, (is|would|will|was) <it> [be] [<very>] (<fine>|clear|understood) [<you>|to do],
    (is|would) <it> [be] (a|too much) (problem|trouble|bother) [for you], (do|did|can) you (understand|get|hear|follow|copy) [me|<it>|what i (mean|said|want)], does <it> make sense, is <it> clear [to you],
    (do you think|you think|think) you can (do|manage|handle) [<it>], (do|can|could|would|will) you [think you can] (manage|handle) <it>,
    you are [<very>] (a|an|the|my|such a) (star|best|legend|gem|angel|hero|treasure|lifesaver|life saver|sweetheart|darling|dear|genius|champ|good robot|great help|big help|helper|good helper), you are (great|amazing|awesome|brilliant|wonderful|doing (great|fine|well|good|a great job) [so far]), you rock,
    <it> (is|was|would be|will be) [<very>] (kind|nice|sweet|good|helpful|lovely|thoughtful) of you, (how|so|<very>) (kind|nice|sweet|good|thoughtful) of you,
    <it> (would|will) [really] (help|help me|help us) [out] [a lot|so much|a great deal|enormously|greatly|very much], <it> (would|will) [really] (mean|make) [me|us] (a lot|so much|so happy|very happy|my day|the world) [to (me|us)], i would [really] appreciate (<it>|the help|your help) [very much|a lot|so much], i owe you [one|a lot|big time], i (am|would be) [<very>] (grateful|thankful|obliged) [to you] [for <it>],
    you would be doing me a [huge|big|great] (favour|favor), i [really] need [your|some] help [with (something|this)], i need a hand [with (something|this)],
    (have|enjoy) (a|the|your) [<very>] (nice|good|great|lovely|wonderful|pleasant) [rest of (the|your)] <day>, (bye|goodbye|bye bye|good bye|see you|see you (later|soon|around|tomorrow)|take care|farewell|good night|cheerio|ciao) [<friend>],
    [and] good luck [with <it>|to you], (good|well|nice|great) (boy|girl|job|work|going|bot) [so far|today|everyone|<friend>], (i love|love|we love) you [lots|so much], easy peasy, piece of cake,
    (hello|hi|hey) [<friend>] [and] how are (you|things) [doing|today|doing today|this morning|going], how are (you|things) [doing|today|doing today|this morning|going], how is it going [today], how do you do, what is up, (nice|good|lovely|great) to (meet|see) you [again|too], pleased to meet you, long time no see,
    (i hope|hope|i trust) you are [doing] (well|fine|good|ok|okay|great|all right|alright) [today], (i hope|hope) you are having a (nice|good|great|lovely) <day>, i am [doing] (well|fine|good|great) [today], are you ready [for <it>], ready [for <it>],
    (it is|<it> is) [not|nothing] [<very>] urgent [at all], (nothing|not) urgent, (i am|we are) [not] in (a|any) [great|big] (rush|hurry), not in (a|any) (rush|hurry), take all the time [that] you (need|want|like), we have [got] (plenty of time|all day|all the time in the world), there is plenty of time, (whenever|any time|anytime) (you like|you want|[that] ((is|will be) <fine>|works|suits you|suits|will do)) [<you>],
    (no (worries|problem|big deal)|it is <fine>|that is <fine>) if (not|you can not|it does not work [out]), do not worry [about it] if it takes [a while|a bit|a bit longer|time|some time|long],
    [pretty] please with (a cherry|sugar|cherries) on top, please and (thank you|thanks), (merci|danke|bitte|gracias|grazie|per favore|por favor|arigato|obrigado|spasibo|tak|takk|tack|dank u|hvala) [beaucoup|schon|mucho|mille|very much|<friend>], god bless [you],
    (sorry|i am sorry|apologies|excuse me|excuse) (for|about) (asking|the (trouble|bother|disturbance|inconvenience|mess)|[my] [bad|poor|terrible] english), sorry to (ask|trouble you|bother you|disturb you) [again], sorry my english is [not [<very>] good|bad], excuse my [bad|poor|terrible] english, i hope you (understand|understood|get|got) [me|<it>|what i mean]
"""
# What may stand around either, and says as little.
_BEFORE = "and, but, so, oh, well, please, yes, ah"
_AFTER = "please, thanks, thank you, though, mate, robot, haha, lol, ok, okay"


def _pattern(phrases: str) -> str:
    made = "|".join(phrase_list(phrases))
    while "<" in made:
        made = re.sub(r"<(\w+)>", lambda match: f"({_PARTS[match[1]]})", made)
    made = re.sub(r"[a-z]+", lambda match: f"{match[0]}_", " ".join(made.split())).replace(" ", "").replace("_", " ")
    return made.replace("(", "(?:").replace("[", "(?:").replace("]", ")?")


def _framed(phrases: str) -> str:
    return rf"(?:{_pattern(_BEFORE)})*(?:{_pattern(phrases)})(?:{_pattern(_AFTER)})*"


_CLAUSE = lazy_regex.compile(_framed(f"{_ALONE}, {_WITH_AN_ORDER}"))
_TAIL = lazy_regex.compile(rf"(?<= )(?:{_framed(_WITH_AN_ORDER)})$")
_ALL_WORDS = word_set(re.sub(r"[^a-z]", " ", " ".join((_ALONE, _WITH_AN_ORDER, _BEFORE, _AFTER, *_PARTS.values()))))


def without_chat(tokens: Sequence[Token], parts: frozenset[str]) -> Sequence[Token]:
    """Return the tokens of a sentence without what is only chat; the same tokens if there is none.

    Args:
        tokens: The sentence.
        parts: Words that name something in the scene: what holds one of them is no chat ("you are a star").
    """
    kept: list[Token] = []
    start, changed = 0, False
    for i in range(len(tokens) + 1):
        if i < len(tokens) and tokens[i].kind != "mark":
            continue
        clause, mark = tokens[start:i], tokens[i : i + 1]
        end = _end_of_order([token.text for token in clause], parts)
        changed = changed or end < len(clause)
        kept += clause[:end]
        if end or not clause:
            kept += mark
        elif kept and kept[-1].text == "," and (not mark or mark[0].text != ","):
            kept[-1:] = mark
        start = i + 1
    return kept if changed else tokens


def _end_of_order(words: Sequence[str], parts: frozenset[str]) -> int:
    """Return how many words of a clause come before its chat."""
    if not words or words[-1] not in _ALL_WORDS:
        return len(words)
    chat = len(words)
    while chat and words[chat - 1] in _ALL_WORDS and (words[chat - 1] not in parts or words[chat - 1] == "can"):
        chat -= 1
    text = "".join(f"{word} " for word in words[chat:])
    if not chat and _CLAUSE.fullmatch(text):
        return 0
    found = _TAIL.search(" " + text)
    return chat + text[: found.start() - 1].count(" ") if found else len(words)
