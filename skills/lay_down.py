"""Lay down: put a thing that stands on its side."""

from __future__ import annotations

from robosandbox.skills.base import Skill
from robosandbox.skills.pick import Pick
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.turning import is_turned, turn_over
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact

_SIDE = (
    "on its side",
    "on one side",
    "onto its side",
    "over on its side",
    "down on its side",
    "down flat on its side",
    "over onto its side",
    "down onto its side",
)


class LayDown(Skill):
    """Put a thing that stands on its side."""

    name = "lay_down"
    words = Words(
        verbs=tuple(
            f"{verb} {{}} {side}"
            for verb in ("lay", "put", "place", "set", "tip", "turn", "rest", "roll", "lie", "stand")
            for side in _SIDE
        )
        + ("tip {} over",),
        object="object",
    )

    def contract(self, *, object: str) -> Contract:
        """Return what laying an object down needs and brings about."""
        needs = (fact("hand_empty"), *Pick().contract(object=object).needs)
        return Contract(needs=needs, gives=(fact("lying", object), fact("hand_empty")))

    def run(self, ctx: SkillContext, *, object: str) -> SkillResult:
        """Put a thing that stands on its side, near where it stood.

        Args:
            object: Id of the thing.

        Raises:
            SkillError: As pick and place_at raise them.
            UnsupportedError: What lies in it would fall out.
        """
        if is_turned(Manipulator(ctx).find(object), "level"):
            return SkillResult(skill=self.name, detail={"object": object, "already_lying": True})
        return turn_over(ctx, object, "level", self.name)
