"""Wait: let time pass."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from robosandbox.errors import Phase
from robosandbox.skills.primitives.hand_move import HandMove
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import SkillResult


class Wait(HandMove):
    """Let time pass."""

    name = "wait"
    words = Words(
        verbs=(
            "wait",
            "pause",
            "stay still",
            "hold still",
            "stand still",
            "do nothing",
            "stay there",
            "stay where you are",
            "hold it there",
        ),
        slots=(Slot(argument="seconds", kind="duration", prepositions=("", "for", "another", "for another")),),
        required=("seconds",),
    )

    def run(self, ctx: SkillContext, *, seconds: Annotated[float, Field(gt=0.0, le=3600.0)]) -> SkillResult:
        """Stand still for some time; what is held stays held.

        Args:
            seconds: How long, of the driver's clock.
        """
        ctx.enter(Phase.WAIT)
        began = ctx.driver.time
        ctx.driver.wait(seconds)
        return SkillResult(skill=self.name, detail={"seconds": ctx.driver.time - began})
