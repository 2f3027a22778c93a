"""Set upright: stand a thing that lies on its base again."""

from __future__ import annotations

from robosandbox.skills.base import Skill
from robosandbox.skills.pick import Pick
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.turning import turn_over
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.standing import TIPPED, tilt

_UP = ("upright", "back upright", "upright again", "on its base", "on its base again", "on end", "back on its base")


class SetUpright(Skill):
    """Stand a thing that lies on its base again."""

    name = "set_upright"
    words = Words(
        verbs=(
            *(
                "upright",
                "right",
                "stand {} up",
                "stand {} back up",
                "stand {} up again",
                "set {} up again",
                "straighten {} up",
            ),
            *(f"{verb} {{}} {up}" for verb in ("set", "stand", "put", "turn", "bring", "tip", "make") for up in _UP),
        ),
        object="object",
    )

    def contract(self, *, object: str) -> Contract:
        """Return what standing an object up needs and brings about."""
        needs = (fact("hand_empty"), *Pick().contract(object=object).needs)
        return Contract(needs=needs, gives=(fact("upright", object), fact("hand_empty")))

    def run(self, ctx: SkillContext, *, object: str) -> SkillResult:
        """Stand a thing that lies on its base again, near where it lay.

        Args:
            object: Id of the thing.

        Raises:
            SkillError: As pick and place_at raise them.
            UnsupportedError: What lies in it would fall out.
        """
        before = Manipulator(ctx).find(object)
        if tilt(before) < TIPPED:
            return SkillResult(skill=self.name, detail={"object": object, "already_upright": True})
        return turn_over(ctx, object, "up", self.name)
