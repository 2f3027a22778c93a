"""UseArm: choose the arm that the calls that follow are made with."""

from __future__ import annotations

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.skills.base import Skill
from robosandbox.skills.protocols import SkillContext
from robosandbox.suggestions import did_you_mean
from robosandbox.types import SkillResult


class UseArm(Skill):
    """Choose the arm of several that the calls that follow are made with; the others stand still, and in its way."""

    name = "use_arm"

    def run(self, ctx: SkillContext, *, arm: str) -> SkillResult:
        """Move nothing; what each hand holds stays held.

        Args:
            arm: Its name.

        Raises:
            InvalidArgumentError: There is no such arm.
        """
        arms = ctx.driver.arms
        if arm not in arms:
            hint = did_you_mean(arm, arms)
            raise InvalidArgumentError(f"arm: {arm[:40]!r} is not one of {', '.join(arms)}{hint}", phase=Phase.CHECK)
        ctx.work_with(arm)
        return SkillResult(skill=self.name, detail={"arm": arm})
