"""Stack: pick one object and put it on another."""

from __future__ import annotations

from robosandbox.skills.base import Skill
from robosandbox.skills.pick import Pick
from robosandbox.skills.place_on import PlaceOn, needs_of_standing
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact


class Stack(Skill):
    """Pick one object and put it on another."""

    name = "stack"

    def contract(self, *, object: str, target: str) -> Contract:
        """Return what picking an object and standing it on another needs and brings about."""
        return Contract(
            needs=(
                fact("distinct", object, target),
                *Pick().contract(object=object).needs,
                *needs_of_standing(object, target),
            ),
            gives=(fact("on", object, target), fact("hand_empty")),
        )

    def run(self, ctx: SkillContext, *, object: str, target: str) -> SkillResult:
        """Pick an object and put it on top of another.

        Args:
            object: Id of the object to move.
            target: Id of the object to put it on.

        Raises:
            SkillError: As pick and place_on raise them.
        """
        # On a thing there is room all around; on a shelf or a rack some grips leave none for the hand, and with some lean of it an
        # arm of few joints gets there alone.
        onto = target if Manipulator(ctx).find(target).is_fixed or not ctx.arm.spec.turns_freely else ""
        Pick().run(ctx, object=object, to=onto, on=True)
        placed: SkillResult = PlaceOn().run(ctx, target=target)
        return placed.model_copy(update={"skill": self.name})
