"""Verbs by data: commands for skills that say themselves how people ask for them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, Protocol, runtime_checkable

from robosandbox.agent.language.chart import Found
from robosandbox.agent.language.conditions import Conditions
from robosandbox.agent.language.discourse import RefusedError
from robosandbox.agent.language.intent import Command, Ref
from robosandbox.agent.language.verbs import forms
from robosandbox.skills.words import Slot, Words
from robosandbox.types import RefusalCode

# Radians of the units in which people say angles; a bare number counts degrees.
_ANGLES = {
    "degree": math.pi / 180.0,
    "degrees": math.pi / 180.0,
    "deg": math.pi / 180.0,
    "radian": 1.0,
    "radians": 1.0,
    "rad": 1.0,
}
_DEGREE = _ANGLES["degree"]
_DIGITS = 6  # Number of digits behind the point of a number that is said: a millionth of a radian or a metre. Chosen.
_MOST_SLOTS = 3  # Number of phrases that may follow one verb. Chosen.

Filled = tuple[tuple[str, Any], ...]


@runtime_checkable
class Worded(Protocol):
    """A skill that says how people ask for it."""

    name: str
    words: Words | None


_KNOWN: dict[str, Words] = {}


def learn(skills: Iterable[object]) -> bool:
    """Make the skills among these that have words sayable; a plan still calls only what its planner was given.

    Returns:
        Whether any of them is new, so that sentences read before may now have another reading.
    """
    new = {s.name: s.words for s in skills if isinstance(s, Worded) and s.words and _KNOWN.get(s.name) != s.words}
    _KNOWN.update(new)
    return bool(new)


def known() -> dict[str, Words]:
    """Return the words of every skill that was learnt, by its name."""
    return _KNOWN


def worded(chart: Conditions, i: int) -> Found[Command]:
    """Return the commands for such skills that begin at a token."""
    found: Found[Command] = []
    for name, words in _KNOWN.items():
        for verb in words.verbs:
            behind = _texts(verb.partition("{}")[2])
            for start in _after(chart, i, _begun(verb)):
                for middle, refs in chart.np_list(start):
                    for end in _follows(chart, middle, behind):
                        for stop, filled in _filled(chart, end, words.slots, _MOST_SLOTS):
                            found.append((stop, Command("worded", refs, skill=name, slots=filled)))
    return found


def resolved(words: Words, filled: Filled, one: Any) -> dict[str, Any]:
    """Return the arguments that phrases fill; `one` returns the id that a noun phrase means.

    Raises:
        RefusedError: One argument is said twice, or what has to be said is not.
    """
    told = {argument for argument, _ in filled}
    if words.required and not told & {*words.required}:
        lacking = " or ".join(name.replace("_", " ") for name in words.required)
        raise RefusedError(RefusalCode.AMBIGUOUS, f"Tell me the {lacking} as well.", words.required)
    arguments: dict[str, Any] = {}
    for argument, value in filled:
        if argument in arguments:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"You said two things for {argument.replace('_', ' ')}; which?")
        arguments[argument] = one(value) if isinstance(value, Ref) else _rounded(value)
    return arguments


def _rounded(value: float | str) -> float | str:
    return round(value, _DIGITS) if isinstance(value, float) else value


def _begun(verb: str) -> tuple[str, ...]:
    """Return what a sentence says that begins a verb: its base form and the one that ends in -ing."""
    return forms(verb.partition("{}")[0].strip())[:3:2]


def _after(chart: Conditions, i: int, phrases: Iterable[str]) -> list[int]:
    return [end for phrase in phrases for end in _follows(chart, i, _texts(phrase))]


def _texts(phrase: str) -> list[str]:
    return phrase.split()


def _follows(chart: Conditions, i: int, texts: list[str]) -> list[int]:
    return [i + len(texts)] if chart.texts[i : i + len(texts)] == texts else []


def _filled(chart: Conditions, i: int, slots: tuple[Slot, ...], most: int) -> Iterator[tuple[int, Filled]]:
    yield i, ()
    if most == 0:
        return
    for slot in slots:
        for end, value in _said(chart, i, slot):
            left = tuple(other for other in slots if other is not slot)
            for stop, rest in _filled(chart, end, left, most - 1):
                yield stop, ((slot.argument, value), *rest)


def _said(chart: Conditions, i: int, slot: Slot) -> Iterator[tuple[int, Any]]:
    for phrase, value in slot.phrases:
        for end in _follows(chart, i, _texts(phrase)):
            yield from _ended(chart, end, slot, value)
    for preposition in slot.prepositions:
        for start in _follows(chart, i, _texts(preposition)):
            if slot.kind == "object":
                yield from ((end, ref) for end, ref in chart.np(start) if not ref.plural)
            elif slot.kind != "phrase" and start < chart.count and chart.tokens[start].kind == "number":
                yield from (
                    hit
                    for end, unit in _units(chart, start + 1, slot.kind)
                    for hit in _ended(chart, end, slot, chart.tokens[start].number * unit)
                )


def _units(chart: Conditions, i: int, kind: str) -> list[tuple[int, float]]:
    if kind == "angle":
        unit = _ANGLES.get(chart.text(i))
        return [(i + 1, unit)] if unit is not None else [] if chart.tag(i, "UNIT") else [(i, _DEGREE)]
    return chart.tag(i, "UNIT") if kind == "length" else [(i, 1.0)]


def _ended(chart: Conditions, i: int, slot: Slot, value: float | str) -> Iterator[tuple[int, float | str]]:
    yield i, value
    for phrase, factor in slot.endings:
        for end in _follows(chart, i, _texts(phrase)):
            yield end, value * factor if isinstance(value, float) else value
