"""Corrections of what was just said: the better words take the place of those that they are like.

"Put the honey on the board, sorry no, I meant the jam" has three parts: what was said, the cue that it was wrong, and the
repair (reparandum, interregnum and repair of Shriberg, "Preliminaries to a Theory of Speech Disfluencies", 1994). The
repair replaces the phrase before the cue that is of its kind; where it might replace either of two, both ways are
returned, and sense decides.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from robosandbox.agent.language.lexicon import Phrases
from robosandbox.agent.language.repairs import DETERMINERS, PREPOSITIONS, Repair, Words, at_edge, named, past_marks
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.speech import CORRECTION
from robosandbox.agent.language.tokens import MARKS, WAITED_FOR, Token
from robosandbox.agent.language.wordlist import word_set

_MOST_WAYS = 3  # Number of corrected sentences that are read. Chosen.
_MOST_REPAIRS = 4  # Number of corrections of one sentence. Chosen.
_CUES = Phrases()
_CUES.add_all(CORRECTION, "CUE")
_CUES.add_all(
    "i said, i say, forget that, forget it, cancel that, just kidding, only kidding, just joking, only joking, kidding, "
    "changed my mind, i changed my mind, i have changed my mind, change of plan, change of plans, come to think of it, "
    "you know what, actually what, other one, other colour, other color, other side",
    "CUE",
)
_CUES.add_all("oh, ah, well, but, and, or, so, that is, let us make it, i want, it is, yes, instead, i think", "FILL")
_TOO_WEAK = frozenset({"rather", "better", "make it", "actually"})
_AFTER = Phrases()
_AFTER.add_all("i mean, i meant, i meant to say, i mean to say, i said", "CUE")


_TELLING = word_set(
    """
    no nope nah wait hang hold sorry mean meant not actually rather scratch strike oops wrong mistake bad kidding joking
    mind thought thoughts correction apologies make misspoke change did other better said know forget cancel
    """
)
"""Words of which every cue has one."""


def may_correct(prompt: str) -> bool:
    """Say whether a sentence has a word that every cue of a correction has one of."""
    return bool(_TELLING & {*re.findall("[a-z]+", prompt.lower())})


def set_right(said: Said) -> tuple[Said, ...]:
    """Return the sentence with its corrections carried out, in every way that it can be meant; none if it has none."""
    ways: tuple[Said, ...] = (said,) if _TELLING & {*said.texts} else ()
    for _ in range(_MOST_REPAIRS):
        further = [better for way in ways for better in _once(way)]
        if not further:
            break
        ways = tuple({tuple(way.texts): way for way in further}.values())[:_MOST_WAYS]
    return ways if said not in ways else ()


def _once(said: Said) -> list[Said]:
    """Carry out the first correction that can be."""
    for i in range(1, len(said.tokens)):
        for repair in _repairs(said, i):
            ways = repair.ways()
            if ways:
                kept = _forbidden(said.tokens)
                return [
                    said.now(_tidied(way))
                    for way in ways
                    if _tidied(way) != tuple(said.tokens) and _forbidden(_tidied(way)) >= kept
                ]
    return []


def _forbidden(tokens: Sequence[Token]) -> int:
    """Return how often a sentence forbids something: no better words take that back."""
    texts = [token.text for token in tokens]
    return sum(texts[k] in ("never", "without") or texts[k : k + 2] == ["do", "not"] for k in range(len(texts)))


def _repairs(said: Said, i: int) -> list[Repair]:
    """Return the corrections of what is said before token `i`."""
    texts, n = said.texts, len(said.texts)
    k = past_marks(texts, i)
    asked = k + 1 if texts[k : k + 1] == ["and"] else k
    for ask in (["did", "i", "say"], ["i", "said"]):
        first = asked + len(ask)
        end = next((m for m in range(first, n) if texts[m] in MARKS), n)
        after, strong = _cue(said, end)
        if texts[asked:first] == ask and (strong or ask[0] == "did") and after < n:
            # "did I say yellow? I meant green"
            return [Repair(said, i, after, n, tuple(texts[first:end]))]
    if texts[asked : asked + 1] == ["by"]:
        # "put the car in the box, and by the box I mean the toy box"
        mean = next((m for m in range(asked + 2, min(asked + 6, n)) if texts[m : m + 2] == ["i", "mean"]), 0)
        return [Repair(said, i, mean + 2, n, tuple(texts[asked + 1 : mean]))] if mean else []
    if k > i:
        # "..., the pink one, I mean"; "..., in the tray, not the bin"
        start = k + 1 if texts[k : k + 1] in (["and"], ["but"], ["so"]) else k
        end = next((m for m in range(start, n) if texts[m] in MARKS), n)
        cue = next((m for m in range(start + 1, end) if _AFTER.match(said.tokens, m) == end - m), 0)
        cue = cue or (
            end
            if end + 1 < n
            and _AFTER.match(said.tokens, end + 1)
            and at_edge(texts, end + 1 + _AFTER.match(said.tokens, end + 1))
            else 0
        )
        if cue:
            after = end if cue < end else end + 1 + _AFTER.match(said.tokens, end + 1)
            return [Repair(said, i, start, cue, resume=after)]
        if texts[end : end + 2] == [",", "not"]:
            for after in named(said, end + 2):
                if at_edge(texts, after):
                    return [Repair(said, i, start, end, tuple(texts[end + 2 : after]), resume=after, needs_wrong=True)]
    after, strong = _cue(said, i)
    if not strong:
        return []
    wrong: tuple[str, ...] = ()
    if texts[after : after + 1] == ["not"]:
        # "no not two, block four"
        end = next((m for m in range(after, n) if texts[m] in MARKS or texts[m] == "but"), n)
        wrong, after = tuple(texts[after + 1 : end]), past_marks(texts, end + (texts[end : end + 1] == ["but"]))
    return [Repair(said, i, after, n, wrong)]


def _cue(said: Said, i: int) -> tuple[int, bool]:
    """Return where the words end that take back what was said before token `i`, and whether they surely do."""
    k, strong = past_marks(said.texts, i), False
    while k < len(said.tokens):
        length = _CUES.match(said.tokens, k)
        if said.texts[k] == "wrong" and k + 1 < len(said.tokens):
            # "oops, wrong cube, the green one"
            length, strong = 2, True
        if not length or (said.texts[k + 1 : k + 3] == ["on", "to"] and length == 2):
            break
        phrase = " ".join(said.texts[k : k + length])
        if phrase.startswith("other ") and k == i > 0 and said.texts[k - 1] not in MARKS:
            # "in the red bin, other one, the blue"; but "the other one" is a thing.
            break
        filling = all(tag == "FILL" for end, tag, _ in _CUES.at(said.tokens, k) if end == k + length)
        # "or rather" takes back; "rather" after a mark, too.
        after = said.texts[k + length] if k + length < len(said.texts) else ""
        if (phrase.endswith("no") and not _opens(after)) or _waits(said.texts, k + length):
            # "no olives" forbids, "wait for me" asks for something.
            break
        strong = strong or not (filling or (phrase in _TOO_WEAK and k == i))
        k = past_marks(said.texts, k + length)
    return k, strong


def _waits(texts: Sequence[str], i: int) -> bool:
    k = past_marks(texts, i)
    return k < len(texts) and (texts[k] == "then" or (texts[i - 1] == "wait" and texts[k] in (*WAITED_FOR, "and")))


def _opens(text: str) -> bool:
    """Say whether better words may start so right after a "no"."""
    return (
        text in MARKS
        or text in DETERMINERS
        or text in PREPOSITIONS
        or text in ("", "not", "i", "make", "sorry", "wait", "that")
    )


def _tidied(tokens: Words) -> Words:
    """Drop marks with nothing before them, and those before which a mark stands."""
    made: list[Token] = []
    for token in tokens:
        if token.text not in MARKS or (made and made[-1].text not in MARKS):
            made.append(token)
    return tuple(made)
