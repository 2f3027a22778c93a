"""Verbs by data: commands for skills that say themselves how people ask for them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Any, Protocol, runtime_checkable

from robosandbox.agent.language.chart import Found
from robosandbox.agent.language.conditions import Conditions
from robosandbox.agent.language.discourse import RefusedError
from robosandbox.agent.language.intent import Command, Ref
from robosandbox.agent.language.tokens import ASKED_FOR
from robosandbox.agent.language.verbs import forms
from robosandbox.skills.words import Slot, Words
from robosandbox.types import RefusalCode

# Units as people say them, by what is measured: radians, seconds, newtons; those of length are the grammar's.
_UNITS: dict[str, dict[str, float]] = {
    "angle": {
        **dict.fromkeys(("degree", "degrees", "deg"), math.pi / 180.0),
        **dict.fromkeys(("radian", "radians", "rad"), 1.0),
    },
    "duration": {
        **dict.fromkeys(("second", "seconds", "sec", "secs", "s"), 1.0),
        **dict.fromkeys(("minute", "minutes", "min", "mins"), 60.0),
    },
    "force": dict.fromkeys(("newton", "newtons", "n"), 1.0),
    "share": {**dict.fromkeys(("percent", "%", "per cent"), 0.01)},
}
# What is asked for where it was not said.
_QUESTIONS = {
    "object": "which thing",
    "length": "how far",
    "duration": "how long",
    "point": "where to",
    "force": "how hard",
}
# What a bare number counts: degrees.
_BARE = {"angle": math.pi / 180.0}
# What says no more of a number, or of a place, than that it is about so much or right there.
_ABOUT = frozenset(
    {"about", "around", "roughly", "approximately", "some", "another", "exactly", "say", "maybe", "like"}
)
_RIGHT = frozenset({"right", "just", "directly", "straight", "exactly"})
_OR_SO = ("or so", "or thereabouts", "or something", "in total")
# What ends a move as any move ends: the hand stays where it is.
_STAYS = tuple(
    f"{joined}{then}"
    for joined in ("", ", ", "and ", "then ", ", then ", "and then ", ", and ")
    for then in ("stop", "stop there", "stay there", "hold there", "stay where you are")
)
_NAME = re.compile(r"[a-z][a-z0-9_]*")
_DIGITS = 6  # Number of digits behind the point of a number that is said: a millionth of a radian or a metre. Chosen.
# Strain by which a skill's reading of a verb that it takes for itself is plainer than the grammar's: what a corrected order is
# plainer by.
_TAKEN = -0.6
_MOST_SLOTS = 3  # Number of phrases that may follow one verb. Chosen.

Filled = tuple[tuple[str, Any], ...]


@runtime_checkable
class Worded(Protocol):
    """A skill that says how people ask for it."""

    name: str
    words: Words | tuple[Words, ...] | None


_KNOWN: dict[str, tuple[Words, ...]] = {}
# What begins a verb, by its first word: the skill, its words, the phrase, and what follows the verb's object.
_BY_WORD: dict[str, list[tuple[str, Words, list[str], list[str]]]] = {}


def learn(skills: Iterable[object]) -> bool:
    """Make the skills among these that have words sayable; a plan still calls only what its planner was given.

    Returns:
        Whether any of them is new, so that sentences read before may now have another reading.
    """
    told = {
        s.name: s.words if isinstance(s.words, tuple) else (s.words,)
        for s in skills
        if isinstance(s, Worded) and s.words
    }
    new = {name: words for name, words in told.items() if _KNOWN.get(name) != words}
    if new:
        _KNOWN.update(new)
        _index()
    return bool(new)


def _index() -> None:
    """Sort what begins each verb by its first word, and take note of which words of a verb are no fillers."""
    _BY_WORD.clear()
    _by_ing.cache_clear()
    for name, words in known():
        for verb in words.verbs:
            begins, _, behind = verb.partition("{}")
            phrase = _texts(begins)
            _BY_WORD.setdefault(phrase[0], []).append((name, words, phrase, _texts(behind)))
            if len(phrase) > 1 and not behind:
                ASKED_FOR.setdefault(phrase[0], set()).add(tuple(phrase))


@lru_cache(maxsize=1)
def _by_ing() -> dict[str, list[tuple[str, Words, list[str], list[str]]]]:
    """Return the same for what ends in -ing: few sentences have it, and it takes a while."""
    made: dict[str, list[tuple[str, Words, list[str], list[str]]]] = {}
    for name, words, phrase, behind in (entry for entries in _BY_WORD.values() for entry in entries):
        for going in map(_texts, forms(" ".join(phrase))[2:3]):
            made.setdefault(going[0], []).append((name, words, going, behind))
    return made


def known() -> Iterator[tuple[str, Words]]:
    """Yield the words of every skill that was learnt, with its name."""
    return ((name, words) for name, ways in _KNOWN.items() for words in ways)


def known_verbs() -> frozenset[str]:
    """Return the verbs of one word of the skills that were learnt."""
    return frozenset(verb for _, words in known() for verb in words.verbs)


def ways_of(skill: str) -> tuple[Words, ...]:
    """Return what a skill says of its verbs."""
    return _KNOWN.get(skill, ())


def words_of(skill: str, *, with_object: bool) -> Words:
    """Return what a skill says of its verbs that have an object, or have none; of rules for it nothing else is known."""
    return next((words for words in _KNOWN.get(skill, ()) if bool(words.object) is with_object), Words(verbs=(skill,)))


def worded(chart: Conditions, i: int) -> Found[Command]:
    """Return the commands for such skills that begin at a token."""
    found: Found[Command] = []
    text = chart.text(i)
    going = _by_ing().get(text, ()) if text.endswith("ing") else ()
    for name, words, phrase, behind in (*_BY_WORD.get(text, ()), *going):
        for start in _follows(chart, i, phrase):
            # "lift it" is the grammar's own; "lift it by 5 cm" is not.
            has_own = any(end == start for end, _ in chart.tag(i, "VERB"))
            for middle, refs in chart.np_list(start) if words.object else [(start, ())]:
                for end in _follows(chart, middle, behind):
                    for stop, filled in _filled(chart, end, words.slots, _MOST_SLOTS):
                        if not has_own or _is_enough(words, filled):
                            # A verb of the grammar that a skill takes for itself, asking for nothing beside, is the skill's.
                            taken = has_own and not words.required
                            # "drop the cube in the bin": a place behind it is where to, and not which.
                            somewhere = any(ref.relations or ref.ranks for ref in refs)
                            bare = (-_TAKEN if somewhere else _TAKEN) if taken else 0.0
                            command = Command("worded", refs, bare=bare, skill=name, slots=filled, words=words)
                            found += [
                                (last, command) for last in (stop, *_after(chart, stop, _STAYS if filled else ()))
                            ]
    return found


def _is_enough(words: Words, filled: Filled) -> bool:
    """Say whether what has to be said beside a verb was said."""
    return not words.required or any(argument in words.required for argument, _ in filled)


def resolved(words: Words, filled: Filled, one: Any) -> dict[str, Any]:
    """Return the arguments that phrases fill; `one` returns the id that a noun phrase means.

    Raises:
        RefusedError: One argument is said twice, or what has to be said is not.
    """
    if not _is_enough(words, filled):
        asked = dict.fromkeys(_asked(slot) for slot in words.slots if slot.argument in words.required)
        raise RefusedError(RefusalCode.AMBIGUOUS, f"Tell me {' or '.join(asked)} as well.", words.required)
    told = {argument for argument, _ in filled}
    filled = (*((name, value) for name, value in words.means if name not in told), *filled)
    arguments: dict[str, Any] = {}
    for argument, value in filled:
        if argument in arguments:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"You said two things for {argument.replace('_', ' ')}; which?")
        if isinstance(value, Ref):
            arguments[argument] = one(value)
        elif isinstance(value, tuple):
            arguments.update(zip(argument.split(), map(_rounded, value), strict=True))
        else:
            arguments[argument] = _rounded(value)
    return arguments


def _asked(slot: Slot) -> str:
    return _QUESTIONS.get(slot.kind, f"the {slot.argument.replace('_', ' ')}")


def _rounded(value: float | str) -> float | str:
    return round(value, _DIGITS) if isinstance(value, float) else value


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
            # "5 cm up and 3 cm to the left"
            for begin in (end, *_after(chart, end, ("and", ",", ", and"))) if left else (end,):
                for stop, rest in _filled(chart, begin, left, most - 1):
                    if rest or begin == end:
                        yield stop, ((slot.argument, value), *rest)


def _said(chart: Conditions, i: int, slot: Slot) -> Iterator[tuple[int, Any]]:
    for phrase, value in slot.phrases:
        for end in _follows(chart, i, _texts(phrase)):
            yield from _ended(chart, end, slot, value, marked=True)
    for preposition in slot.prepositions:
        begins = i + (preposition != "" and chart.text(i) in _RIGHT)
        for start in _follows(chart, begins, _texts(preposition)):
            if slot.kind == "object":
                yield from ((end, ref) for end, ref in chart.np(start) if not ref.plural)
            elif slot.kind == "name" and _NAME.fullmatch(chart.text(start)):
                yield start + 1, chart.text(start)
            elif slot.kind == "point":
                yield from _point(chart, start)
            elif slot.kind not in ("phrase", "name"):
                begun = [(middle, factor, True) for middle, factor in _multiplied(chart, start, slot.beginnings)]
                for middle, factor, marked in ((start, 1.0, slot.bare), *begun):
                    for end, value in _number(chart, middle, slot.kind):
                        told = value if factor == 1.0 else factor * value
                        yield from _ended(chart, end, slot, told, marked=marked)


def _number(chart: Conditions, i: int, kind: str) -> Iterator[tuple[int, float]]:
    """Yield a number with its unit, in SI units."""
    i += chart.text(i) in _ABOUT
    if kind == "share" and chart.text(i) in ("half", "halfway"):
        yield i + 1, 0.5
    for end, number in _amounts(chart, i):
        if kind == "duration" and chart.text(i - 1) == "wait" and _is_breath(chart, i):
            continue
        if kind == "length":
            yield from ((stop, number * unit) for stop, unit in chart.tag(end, "UNIT"))
        elif kind == "number":
            yield end, int(number) if number == int(number) else number
        elif (unit := _UNITS[kind].get(chart.text(end))) is not None:
            yield end + 1, number * unit
        elif kind in _BARE and not chart.tag(end, "UNIT"):
            yield end, number * _BARE[kind]


def _is_breath(chart: Conditions, i: int) -> bool:
    """Say whether a second is none: "tap the bell, wait a second, tap it again" takes breath."""
    return chart.text(i) in ("a", "an") and chart.text(i + 2) == "," and chart.text(i + 3) != "then"


def _amounts(chart: Conditions, i: int) -> Iterator[tuple[int, float]]:
    """Yield how much is said: "3", "three", "a", "half a"."""
    if i < chart.count and chart.tokens[i].kind == "number":
        yield i + 1, chart.tokens[i].number
    yield from ((end, float(number)) for end, number in chart.tag(i, "NUM"))
    halved = chart.text(i) == "half"
    if chart.text(i + halved) in ("a", "an"):
        yield i + halved + 1, 0.5 if halved else 1.0


def _point(chart: Conditions, i: int) -> Iterator[tuple[int, tuple[float, ...]]]:
    """Yield three numbers, as "0.4, 0.1, 0.3" or "x 0.4 y 0.1 z 0.3", metres where no unit is said."""
    numbers: list[float] = []
    for axis in "xyz":
        i += chart.text(i) in (",", "(", "[")
        i += chart.text(i) == axis
        i += chart.text(i) in ("=", ":", "is")
        if i >= chart.count or chart.tokens[i].kind != "number":
            return
        end, unit = next(iter(chart.tag(i + 1, "UNIT")), (i + 1, 1.0))
        numbers.append(chart.tokens[i].number * unit)
        i = end
    yield i + (chart.text(i) in (")", "]")), tuple(numbers)


def _multiplied(chart: Conditions, i: int, phrases: Iterable[tuple[str, float]]) -> list[tuple[int, float]]:
    i += chart.text(i) in _RIGHT
    return [(end, factor) for phrase, factor in phrases for end in _follows(chart, i, _texts(phrase))]


def _ended(chart: Conditions, i: int, slot: Slot, value: Any, *, marked: bool) -> Iterator[tuple[int, Any]]:
    so = next(iter(_after(chart, i, _OR_SO)), i)
    if marked:
        yield so, value
    if not isinstance(value, str | tuple):
        ends = _multiplied(chart, i, slot.endings)
        yield from ((end, value if factor == 1.0 else factor * value) for end, factor in ends)
