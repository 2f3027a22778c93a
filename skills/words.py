"""Words of a skill, its verbs and the phrases that fill its arguments, as data that a planner's grammar reads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class Slot:
    """Words that may follow a verb and its object, and the argument that they fill.

    Attributes:
        argument: Of the skill.
        kind: What is said: an object, an angle or a length with its unit, a plain number, or nothing but one of `phrases`.
        prepositions: What comes before it, as "by" or "parallel to"; "" where nothing needs to.
        phrases: Whole phrases with the value that each stands for, SI units, as ("a quarter turn", 1.5708).
        endings: Phrases behind a number with what they multiply it by, as ("clockwise", -1).
    """

    argument: str
    kind: Literal["object", "angle", "length", "number", "phrase"]
    prepositions: tuple[str, ...] = ("",)
    phrases: tuple[tuple[str, float | str], ...] = ()
    endings: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Words:
    """Words with which people ask for a skill.

    Attributes:
        verbs: In their base form; "{}" marks the object where words follow it, as in "set {} upright".
        object: The argument that is the verb's object.
        slots: What may follow, each at most once, in any order.
        required: Arguments of which at least one has to be said; none asks for nothing.
    """

    verbs: tuple[str, ...]
    object: str
    slots: tuple[Slot, ...] = ()
    required: tuple[str, ...] = ()
