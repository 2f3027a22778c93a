"""Words for what was told before: "the one you just moved", "on top of the pair", "the other way", "just as far"."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.lexicon import LEXICON
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.speech import OPENERS
from robosandbox.agent.language.tokens import MARKS, Token
from robosandbox.agent.language.wordlist import word_set

_MOVED = word_set("moved put placed set stacked shifted picked lifted swapped pushed tapped touched")
_TAPS = {"tapped": "tap", "touched": "tap", "pushed": "push"}
_PAIRS = (
    ("the", "pair"),
    ("the", "lot"),
    ("the", "whole", "lot"),
    ("the", "two", "of", "them"),
    ("both", "of", "them"),
)
_OPPOSITE = {"left": "right", "right": "left", "forward": "back", "back": "forward"}
_WAYS: dict[tuple[str, ...], bool] = {
    (*lead, which, way): other
    for lead in (("the",), ("in", "the"))
    for which, other in (("other", True), ("opposite", True), ("same", False))
    for way in ("way", "direction")
}
_AS_FAR: dict[tuple[str, ...], float] = {
    **{("twice", "as", much): 2.0 for much in ("far", "long", "much")},
    **{("half", "as", much): 0.5 for much in ("far", "long", "much")},
    **{words: 1.0 for words in (("as", "far"), ("by", "the", "same", "distance"), ("the", "same", "distance"))},
}
_LEADS = frozenset({"just", "exactly", "equally"})
_JOINTS = frozenset({"and", "then", ",", ";", "."})


def told_again(said: Said) -> Said:
    """Return a sentence that names again what it refers to; the same sentence if it refers to nothing told before."""
    texts = {*said.texts}
    if "you" in texts and texts & _MOVED:
        said = _the_one_moved(said)
    if texts & {"pair", "lot", "both", "them"}:
        said = _the_pair(said)
    if texts & {"far", "distance", "long", "much"}:
        said = _as_far(said)
    return _the_other_way(said) if texts & {"way", "direction"} else said


def _the_one_moved(said: Said) -> Said:
    """As in "put the cube left of the can and the ball on top of the one you just moved": one command, one thing before."""
    texts = said.texts
    at = next((k for k in range(2, len(texts)) if texts[k] == "you" and texts[k - 1] in ("one", "that")), 0)
    start = next((k for k in range(at - 1, max(at - 4, -1), -1) if texts[k] == "the"), 0)
    end = at + 1
    while texts[end : end + 1] and texts[end] in ("have", "had", "just"):
        end += 1
    if not (at and start and "one" in texts[start:at] and texts[end : end + 1] and texts[end] in _MOVED):
        return said
    told = Said(tuple(said.tokens[:start]), said.words)
    verbs = [(k, verb) for k in range(start) if _opens(texts, k) for _, verb in told.grammar.tag(k, "VERB")]
    fits = [k for k, verb in verbs if _TAPS.get(texts[end], verb) == verb]
    current = next((k for k in range(start - 1, 0, -1) if texts[k] in _JOINTS), 0)
    before = sorted({k for k in fits if k < current})
    first = before[-1] if before else 0
    ends = [b for j, _ in told.grammar.tag(first, "VERB") for b in told.ends("that", j) if before]
    cut = current
    while cut and texts[cut - 1] in _JOINTS:
        cut -= 1
    if not ends or {*texts[min(ends) : cut]} & _JOINTS:
        # More than one may have been moved last.
        return said
    verb_end = min(j for j, _ in told.grammar.tag(first, "VERB"))
    thing = said.tokens[verb_end : min(ends)]
    return said.now((*said.tokens[:start], *thing, *said.tokens[end + 1 :]))


def _opens(texts: Sequence[str], k: int) -> bool:
    return k == 0 or texts[k - 1] in OPENERS


def _the_pair(said: Said) -> Said:
    """As in "stack the red cube on the blue one and put the green one on top of the pair": on the upper one."""
    texts = said.texts
    for words in _PAIRS:
        for k in range(len(texts) - len(words) + 1):
            on = tuple(texts[k : k + len(words)]) == words and (
                texts[k - 3 : k] == ["on", "top", "of"] or (texts[k - 1 : k] in (["on"], ["onto"], ["atop"]))
            )
            upper = _upper(said, k) if on else ()
            if upper:
                return said.now((*said.tokens[:k], *upper, *said.tokens[k + len(words) :]))
    return said


def _upper(said: Said, end: int) -> Sequence[Token]:
    """Return what was last put on another thing before `end`."""
    texts = said.texts
    for k in range(end - 4, 0, -1):
        if texts[k] not in ("on", "onto", "atop"):
            continue
        below = k + 3 if texts[k : k + 3] == ["on", "top", "of"] else k + 1
        starts = [a for a in range(k) if k in said.ends("one", a)]
        if starts and any(b < end - 1 for b in said.ends("one", below)):
            return said.tokens[min(starts) : k]
    return ()


def _as_far(said: Said) -> Said:
    """As in "the can 3 cm to the left and the cup just as far to the right"."""
    texts = said.texts
    for words, times in _AS_FAR.items():
        for k in range(1, len(texts) - len(words) + 1):
            if tuple(texts[k : k + len(words)]) != words or texts[k + len(words) : k + len(words) + 1] == ["as"]:
                continue
            before = [b for a in range(k) for b in said.ends("distance", a) if said.tokens[a].kind == "number"]
            start = k - 1 if texts[k - 1] in _LEADS else k
            far = _last_distance(said, k) if before else ()
            if before and far:
                number = f"{far[0].number * times:g}"
                number_token = Token(number, number, "number")
                return said.now((*said.tokens[:start], number_token, *far[1:], *said.tokens[k + len(words) :]))
            if times != 1.0:
                return said
            pushed = any(tag == "DIR" for i in range(k) for _, tag, _ in LEXICON.at(said.tokens, i))
            if pushed and {"left", "right", "forward", "back", "backwards", "way"} & {*texts[k:]}:
                # Nothing says how far: both go as far as pushed things go.
                return said.now((*said.tokens[:start], *said.tokens[k + len(words) :]))
    return said


def _last_distance(said: Said, end: int) -> Sequence[Token]:
    spans = [
        (a, b) for a in range(end) if said.tokens[a].kind == "number" for b in said.ends("distance", a) if b <= end
    ]
    told = {tuple(said.texts[a:b]) for a, b in spans}
    return said.tokens[slice(*spans[-1])] if len(told) == 1 else ()


def _the_other_way(said: Said) -> Said:
    """As in "push the can to the left and the cup the other way": one way was told before."""
    texts = said.texts
    for words, opposite in _WAYS.items():
        for k in range(1, len(texts) - len(words) + 1):
            end = k + len(words)
            closed = (
                end == len(texts) or texts[end] in MARKS | {"and", "then", "by"} or said.tokens[end].kind == "number"
            )
            if tuple(texts[k:end]) != words or not closed:
                continue
            told = {way for i in range(k) for _, tag, way in LEXICON.at(said.tokens, i) if tag == "DIR"}
            told |= {texts[i] for i in range(k) if texts[i] in ("left", "right")}
            if len(told) == 1 and (way := next(iter(told))) in _OPPOSITE:
                word = _OPPOSITE[way] if opposite else way
                start = next((i for i in range(k - 1, 0, -1) if texts[i] in _JOINTS), 0)
                stop = next((i for i in range(end, len(texts)) if texts[i] in _JOINTS), len(texts))
                told_far = any(token.kind == "number" for token in (*said.tokens[start:k], *said.tokens[end:stop]))
                # "the can 3 cm to the left and the cup the other way": as far.
                far = () if told_far else _last_distance(said, start)
                to = ("to", "the", word) if word in ("left", "right") else (word,)
                way_there = (Token(text, text, "word") for text in to)
                return said.now((*said.tokens[:k], *far, *way_there, *said.tokens[end:]))
    return said


__all__ = ["told_again"]
