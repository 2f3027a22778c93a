"""Move through: the hand goes along several points without stopping."""

from __future__ import annotations

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Pose, SkillResult


class MoveThrough(HandMove):
    """Move the hand along several points."""

    name = "move_through"

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
        arm = Mover(ctx)
        turn = arm.state.tcp_pose.quat_xyzw
        poses = [Pose(xyz=xyz, quat_xyzw=turn) for xyz in zip(points[::3], points[1::3], points[2::3], strict=True)]
        way = arm.motion.plan_through(arm.q, poses, speed=arm.speed)
        return SkillResult(skill=self.name, detail=arm.arrive(way, poses[-1]))
