"""The words of a skill as lines of English, written as lexicon and rules are: what `Words` of skills/words.py says, as data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from robosandbox.agent.language.verbs import forms
from robosandbox.skills.words import Slot, Words

# What rule reads a number of each kind, in SI units.
_MEASURES = {
    "length": "length",
    "angle": "angle",
    "duration": "duration",
    "force": "force",
    "share": "share",
    "number": "count",
}
_FORMS = ("base", "third", "ing", "past", "past")
_MOST_SLOTS = 3  # Number of phrases that may follow one verb: more than anybody says.


def lines_of(skill: str, ways: Sequence[Words]) -> str:
    """Return the classes and rules by which people ask for a skill, as the text of a lexicon and rules file."""
    return "\n".join(line for k, words in enumerate(ways) for line in _way(skill, k, words))


def _way(skill: str, k: int, words: Words) -> Iterator[str]:
    own = f"{skill}_{k}"
    behind: dict[str, list[str]] = {}
    for verb in words.verbs:
        begins, _, after = verb.partition("{}")
        behind.setdefault(after.strip(), []).append(begins.strip())
    for g, verbs in enumerate(behind.values()):
        yield f"V_{own}_{g}".upper()
        for verb in dict.fromkeys(verbs):
            told = ", ".join(f"{form}({name})" for form, name in zip(forms(verb), _FORMS, strict=False))
            yield f"  {verb} = {told}"
    for j, slot in enumerate(words.slots):
        yield from _slot(f"{own}_{j}", slot)
    if words.slots:
        yield f"said_with_{own}"
        yield from (f"  = slots+:said_{own}_{j}" for j in range(len(words.slots)))
    yield "acts"
    for g, after in enumerate(behind):
        verb = f"&V_{own}_{g}".upper()
        thing = " objects" if words.object else ""
        rest = "".join(f' "{word}"' for word in after.split())
        with_it = f"said_with_{own}"
        most = min(_MOST_SLOTS, len(words.slots))
        slots = f" ({with_it}{f' (slot_joint? {with_it})?' * (most - 1)} stays_there?)?" if most else ""
        yield f"  = verb=worded skill={skill} way={k} {verb}{thing}{rest}{slots}"


def _slot(own: str, slot: Slot) -> Iterator[str]:
    """Yield the rule of what fills an argument, and the classes that it is made of."""
    plain = [(phrase, value) for phrase, value in slot.phrases if "," not in phrase]
    begins = [(phrase, value) for phrase, value in slot.beginnings if phrase and "," not in phrase]
    yield from _class(f"PH_{own}", plain)
    yield from _class(f"BE_{own}", begins)
    yield from _class(f"EN_{own}", slot.endings)
    numeric = slot.kind in _MEASURES
    if numeric:
        measure = f"ABOUT? of+:{_MEASURES[slot.kind]} or_so?"
        told = [measure] if slot.bare or any(not phrase for phrase, _ in slot.beginnings) else []
        told += [f"of+:BE_{own}".upper().replace("OF+", "of+") + f" {measure}"] if begins else []
        told += [f"{measure} {_of(f'EN_{own}')}"] if slot.endings else []
        told += [f"{_of(f'PH_{own}')} {_of(f'EN_{own}')}"] if plain and slot.endings else []
        sign = next((value for phrase, value in slot.beginnings if not phrase), 1.0)
        if sign != 1.0:
            told[0] = f"of+={sign} {measure}"
        yield f"value_{own} : product"
        yield from (f"  = {way}" for way in told)
    field = slot.argument.replace(" ", "__")
    yield f"said_{own} : slot"
    if plain:
        yield f"  = {field}:{f'PH_{own}'.upper()}"
    filler = {"object": "alone", "name": "WORD", "point": "point_in_space"}.get(slot.kind) or (
        f"value_{own}" if numeric else ""
    )
    for preposition in slot.prepositions if filler else ():
        words = "".join(f'"{word}" ' for word in preposition.split())
        yield f"  = {'RIGHTLY? ' if words else ''}{words}{field}:{filler}"


def _of(name: str) -> str:
    return f"of+:{name.upper()}"


def _class(name: str, phrases: Sequence[tuple[str, float | str]]) -> Iterator[str]:
    if phrases:
        yield name.upper()
        yield from (f"  {value} = {phrase}" for phrase, value in dict(phrases).items())
