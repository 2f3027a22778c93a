"""Flip: turn a thing upside down."""

from __future__ import annotations

from robosandbox.errors import Phase, UnsupportedError
from robosandbox.skills.base import Skill
from robosandbox.skills.pick import Pick
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.turning import is_turned, turn_over
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact

_OVER = ("upside down", "upside-down", "on its head", "bottom up", "over onto its top")


class Flip(Skill):
    """Turn a thing upside down."""

    name = "flip"
    words = Words(
        verbs=(
            *("flip", "flip {} over", "turn {} over", "invert"),
            *(f"{verb} {{}} {over}" for verb in ("turn", "put", "set", "stand", "flip", "place") for over in _OVER),
        ),
        object="object",
    )

    def contract(self, *, object: str) -> Contract:
        """Return what turning an object over needs; which end of it was up before is no relation, so that it promises nothing else."""
        needs = (fact("hand_empty"), *Pick().contract(object=object).needs)
        return Contract(needs=needs, gives=(fact("hand_empty"),))

    def run(self, ctx: SkillContext, *, object: str) -> SkillResult:
        """Turn a thing that stands upside down, near where it stood: onto its side first, and on from there.

        Args:
            object: Id of the thing.

        Raises:
            UnsupportedError: It lies on its side, or what lies in it would fall out.
            SkillError: As pick and place_at raise them.
        """
        before = Manipulator(ctx).find(object)
        if is_turned(before, "level"):
            raise UnsupportedError(
                f"{object} lies on its side and has no upper end; set it upright, or say which end is to be up",
                phase=Phase.CHECK,
            )
        return turn_over(ctx, object, "down" if is_turned(before, "up") else "up", self.name)
