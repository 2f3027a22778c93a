"""Skills as plans are made of them, and calls bound to checked arguments and a contract."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Generic, Protocol

from typing_extensions import TypeVar

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.suggestions import did_you_mean
from robosandbox.types import SkillCall
from robosandbox.values import frozen
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import HELD

if TYPE_CHECKING:
    from robosandbox.world.alternatives import Alternative, FailedCall


class Operator(Protocol):
    """A skill as planners, verifier and search see it, in this process or in another."""

    @property
    def name(self) -> str:
        """As calls name it."""
        ...

    @property
    def description(self) -> str:
        """Its purpose, in a line."""
        ...

    @property
    def schema(self) -> Mapping[str, Any]:
        """JSON schema of its arguments."""
        ...

    def check(self, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the arguments converted to their types; raises InvalidArgumentError."""
        ...

    def contract(self, *args: Any, **arguments: Any) -> Contract:
        """Return what a call needs and brings about; one that gives nothing may change anything that it names."""
        ...

    def alternatives(self, failed: FailedCall, *args: Any, **arguments: Any) -> Iterable[Alternative]:
        """Return ways around a failed call that its contract does not tell."""
        ...


OperatorT = TypeVar("OperatorT", bound=Operator, default=Any, covariant=True)


@frozen
class BoundCall(Generic[OperatorT]):
    """A call of a skill that can be carried out: `bind` makes it.

    Attributes:
        skill: Whose call.
        call: As it was made.
        arguments: By keyword, converted to their types.
        contract: Of this call, with what is held still called by its role.
    """

    skill: OperatorT
    call: SkillCall
    arguments: Mapping[str, Any]
    contract: Contract

    @property
    def name(self) -> str:
        """The skill's."""
        return self.skill.name

    def __str__(self) -> str:
        return str(self.call)


def bind(call: SkillCall, skills: Mapping[str, Operator]) -> BoundCall:
    """Return a call of one of some skills with its arguments checked and its contract made.

    Raises:
        InvalidArgumentError: There is no such skill, or it does not take these arguments.
    """
    skill = skills.get(call.skill)
    if skill is None:
        raise InvalidArgumentError(
            f"no skill {call.skill[:60]!r}; there is {', '.join(skills)}{did_you_mean(call.skill, skills)}",
            phase=Phase.CHECK,
        )
    arguments = skill.check(call.arguments)
    return BoundCall(skill, call, arguments, skill.contract(**arguments))


def meant_by(call: BoundCall, held: str | None) -> frozenset[str]:
    """Return the names that a call means the robot to press: what its contract brings something about for, and what is held.

    Args:
        call: Which one; of one that promises nothing, every name in it is meant.
        held: Id of what the gripper holds.
    """
    if call.contract.gives:
        named = {name for name in call.contract.subjects if name != HELD}
    else:
        named = {value for value in call.arguments.values() if isinstance(value, str)}
    return frozenset(named | ({held} if held else set()))
