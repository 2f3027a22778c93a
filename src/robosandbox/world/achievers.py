"""Calls that achieve a goal by the skills' contracts, and the needs of each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from robosandbox.errors import InvalidArgumentError
from robosandbox.types import SkillCall
from robosandbox.values import frozen
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import HELD, TABLE, Fact
from robosandbox.world.operators import Operator

# Relations of the hand. As needs they are brought about last: the hand is free until then.
HAND_RELATIONS = ("holding", "hand_empty", "hand_ready")


@frozen
class Achiever:
    """Call whose effects include a goal, for the object that the goal is about.

    Attributes:
        call: With a mark, its name behind a star, for each argument that the goal leaves open.
        needs: What it needs, what takes the hand last.
        choices: What it needs of the arguments left open.
        rank: As its contract has it.
    """

    call: SkillCall
    needs: tuple[Fact, ...]
    choices: tuple[Fact, ...]
    rank: int

    @property
    def picks(self) -> bool:
        """True where something has to be in the hand for it."""
        return any(need.relation == "holding" for need in self.needs)


class Achievers:
    """Index of the skills' calls by the goals that their effects include.

    Args:
        skills: What may be called.
    """

    def __init__(self, skills: Sequence[Operator]) -> None:
        self._skills = {skill.name: skill for skill in skills}
        self._patterns = {name: _pattern(skill) for name, skill in self._skills.items()}
        self._known: dict[Fact, tuple[Achiever, ...]] = {}
        self._contracts: dict[tuple[object, ...], Contract] = {}

    def of(self, goal: Fact) -> tuple[Achiever, ...]:
        """Return the calls that promise a goal: by rank, and those that do it at one go first."""
        if goal not in self._known:
            found = sorted(self._found(goal), key=lambda achiever: (achiever.rank, achiever.picks))
            self._known[goal] = tuple(found)
        return self._known[goal]

    def contract(self, call: SkillCall) -> Contract:
        """Return the contract of a call, whatever it leaves open."""
        key = (call.skill, *call.arguments.items())
        if key not in self._contracts:
            skill = self._skills[call.skill]
            is_open = any(is_mark(value) for value in call.arguments.values())
            arguments = call.arguments if is_open else skill.check(call.arguments)
            self._contracts[key] = skill.contract(**arguments)
        return self._contracts[key]

    def _found(self, goal: Fact) -> Iterator[Achiever]:
        subject = {HELD: str(goal.arguments[0]) if goal.arguments else None}
        for name, pattern in self._patterns.items():
            bound = next((b for gift in pattern.gives if (b := _unified(gift, goal)) is not None), None)
            if bound is None:
                continue
            fields = self._skills[name].schema
            required = fields.get("required", ())
            arguments = {key: bound.get(f"*{key}", f"*{key}") for key in fields.get("properties", {})}
            kept = {key: value for key, value in arguments.items() if f"*{key}" in bound or key in required}
            call = SkillCall(skill=name, arguments=kept)
            try:
                contract = self.contract(call)
            except InvalidArgumentError:
                # A skill that does not take a goal's value does not achieve it.
                continue
            needs = sorted((need.resolved(subject) for need in contract.needs), key=_takes_the_hand)
            settled = tuple(need for need in needs if not marks(need))
            yield Achiever(call, settled, tuple(need for need in needs if marks(need)), contract.rank)


def is_mark(value: object) -> bool:
    """Tell whether an argument is left open."""
    return isinstance(value, str) and value.startswith("*") and value != HELD


def marks(one: Fact) -> tuple[str, ...]:
    """Return the marks among a fact's arguments."""
    return tuple(str(value) for value in one.arguments if is_mark(value))


def _takes_the_hand(need: Fact) -> bool:
    return need.relation in HAND_RELATIONS


def _pattern(skill: Operator) -> Contract:
    """Return a skill's contract with a mark in place of each argument."""
    names = skill.schema.get("properties", {})
    return skill.contract(**{name: f"*{name}" for name in names})


def _unified(gift: Fact, goal: Fact) -> dict[str, Any] | None:
    """Return the values of marks with which a promise is the goal; None where there are none."""
    if gift.relation != goal.relation or len(gift.arguments) < len(goal.arguments):
        return None
    bound: dict[str, Any] = {}
    for mark, value in zip(gift.arguments, goal.arguments, strict=False):
        if isinstance(mark, str) and mark.startswith("*"):
            if value == TABLE or bound.setdefault(mark, value) != value:
                return None
        elif mark != value:
            return None
    return bound


def subject_of(goal: Fact) -> str:
    """Return the id of what a fact is about; "" where it is about nothing."""
    return str(goal.arguments[0]) if goal.arguments else ""
