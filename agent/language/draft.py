"""A plan in the making, with the choices that were free."""

from __future__ import annotations

from dataclasses import dataclass, field

from robosandbox.types import SkillCall


@dataclass(frozen=True)
class Step:
    """A skill call and what would do in its place.

    Attributes:
        call: The call.
        others: Calls that mean the same to the person: another side, another free spot.
    """

    call: SkillCall
    others: tuple[SkillCall, ...] = ()


@dataclass(frozen=True)
class Draft:
    """A plan with the choices that were free.

    Attributes:
        steps: In order.
        substitutes: For objects chosen among several ("a cube"): what would do as well.
    """

    steps: tuple[Step, ...]
    substitutes: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def calls(self) -> tuple[SkillCall, ...]:
        """The skill calls."""
        return tuple(step.call for step in self.steps)
