"""Move joints: bring the arm to joint angles."""

from __future__ import annotations

import numpy as np

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import SkillResult


class MoveJoints(HandMove):
    """Move the arm to joint angles."""

    name = "move_joints"

    def run(self, ctx: SkillContext, *, q: tuple[float, ...]) -> SkillResult:
        """Move the arm to a configuration on a free way; what it holds stays held.

        Args:
            q: Angle of each joint of the arm in the sidecar's order, rad; metres for a sliding one.

        Raises:
            InvalidArgumentError: There are more or fewer than the arm has, or one is past its limit.
            CollisionError: Something is in the way.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
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
        arm.follow(arm.way_to(goal), Phase.APPROACH)
        return SkillResult(skill=self.name, detail={"joint_error": float(np.abs(arm.q - goal).max())})
