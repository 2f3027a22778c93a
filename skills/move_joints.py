"""Move joints: bring the arm to joint angles."""

from __future__ import annotations

from typing import Any

import numpy as np

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.skills.base import Skill
from robosandbox.skills.move_to import ready_to_move
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract


class MoveJoints(Skill):
    """Move the arm to joint angles."""

    name = "move_joints"

    def contract(self, **arguments: Any) -> Contract:
        """Return that what is held stays held; nothing else is promised."""
        del arguments
        return Contract(keeps_hold=True)

    def run(self, ctx: SkillContext, *, q: tuple[float, ...]) -> SkillResult:
        """Move the arm to a configuration on a free way; what it holds stays held.

        Args:
            q: Angle of each joint of the arm in the sidecar's order, rad; metres for a sliding one.

        Raises:
            InvalidArgumentError: There are more or fewer than the arm has, or one is past its limit.
            CollisionError: Something is in the way.
            TrackingError: The arm did not arrive.
        """
        arm = Manipulator(ctx)
        speed = ready_to_move(arm)
        goal, robot = np.array(q), arm.spec
        if len(goal) != len(robot.joints):
            raise InvalidArgumentError(
                f"q: {len(goal)} angles; {robot.name} has {len(robot.joints)} joints: {', '.join(robot.joints)}",
                phase=Phase.CHECK,
            )
        for name, angle, low, high in zip(robot.joints, goal, robot.lower, robot.upper, strict=True):
            if not low <= angle <= high:
                raise InvalidArgumentError(
                    f"q: {name} goes from {low:.3f} to {high:.3f}, not to {angle:.3f}", phase=Phase.CHECK
                )
        arm.follow(arm.motion.plan_joints(arm.q, goal, speed=speed), Phase.APPROACH)
        return SkillResult(skill=self.name, detail={"joint_error": float(np.abs(arm.q - goal).max())})
