"""Move through: the hand goes along several points without stopping."""

from __future__ import annotations

from typing import Any

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.skills.base import Skill
from robosandbox.skills.move_to import arrived, ready_to_move
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Pose, SkillResult
from robosandbox.world.contracts import Contract


class MoveThrough(Skill):
    """Move the hand along several points."""

    name = "move_through"

    def contract(self, **arguments: Any) -> Contract:
        """Return that what is held stays held; nothing else is promised."""
        del arguments
        return Contract(keeps_hold=True)

    def run(self, ctx: SkillContext, *, points: tuple[float, ...]) -> SkillResult:
        """Move the tool centre point in straight lines from point to point without turning the hand; what it holds stays held.

        Args:
            points: x, y and z of each point in the world, metres, one point after the other.

        Raises:
            InvalidArgumentError: There are not three numbers for each point.
            UnreachableError: The hand cannot go there in straight lines.
            CollisionError: Something is in the way.
            LimitError: It is outside of the workspace.
            TrackingError: The arm did not arrive.
        """
        if not points or len(points) % 3:
            raise InvalidArgumentError(
                f"points: {len(points)} numbers; each point has an x, a y and a z", phase=Phase.CHECK
            )
        arm = Manipulator(ctx)
        speed = ready_to_move(arm)
        turn = arm.state.tcp_pose.quat_xyzw
        poses = [Pose(xyz=xyz, quat_xyzw=turn) for xyz in zip(points[::3], points[1::3], points[2::3], strict=True)]
        trajectory = arm.motion.plan_through(arm.q, poses, speed=speed)
        arm.follow(trajectory, Phase.APPROACH)
        return SkillResult(skill=self.name, detail=arrived(arm, poses[-1], trajectory.q[-1]))
