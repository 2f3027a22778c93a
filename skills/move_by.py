"""Move by: the hand goes some way in a straight line, also until it touches something."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from robosandbox.driver import require
from robosandbox.errors import Phase
from robosandbox.skills.primitives.guarded import follow_until, touching_line
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Array, Pose, SkillResult

_Way = Annotated[float, Field(ge=-2.0, le=2.0)]


class MoveBy(HandMove):
    """Move the hand some way in a straight line."""

    name = "move_by"

    def run(
        self,
        ctx: SkillContext,
        *,
        dx: _Way = 0.0,
        dy: _Way = 0.0,
        dz: _Way = 0.0,
        until_force: Annotated[float, Field(ge=0.0, le=20.0)] = 0.0,
    ) -> SkillResult:
        """Move the tool centre point in a straight line without turning the hand; what it holds stays held.

        Args:
            dx: Forward, metres.
            dy: To the left, metres.
            dz: Up, metres.
            until_force: Force on anything at which it stops, N; it then goes slowly, and may touch things. 0 touches nothing.

        Raises:
            UnreachableError: The hand cannot go there in a straight line.
            CollisionError: Something is in the way.
            LimitError: It is outside of the workspace.
            UnsupportedError: The driver feels no touch.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        start = arm.state.tcp_pose
        goal = Pose(xyz=tuple(start.position + np.array([dx, dy, dz])), quat_xyzw=start.quat_xyzw)
        if until_force == 0.0:
            way = arm.motion.plan_line(arm.q, goal, speed=arm.speed)
            return SkillResult(skill=self.name, detail=arm.arrive(way, goal))
        require(ctx.driver, "wrist_wrench", "the way ends where something is felt")
        arm.motion.allow("table", *(item.id for item in arm.start.objects))
        trajectory = touching_line(arm, arm.q, goal)
        before, most = _pressed(arm), 0.0

        def felt() -> bool:
            # Beside what is held, which weighs something.
            nonlocal most
            most = max(most, float(np.linalg.norm(_pressed(arm) - before)))
            return most >= until_force

        touched = follow_until(arm, trajectory, Phase.TOUCH, felt)
        gone = arm.state.tcp_pose.position - start.position
        return SkillResult(
            skill=self.name,
            detail={
                "dx": float(gone[0]),
                "dy": float(gone[1]),
                "dz": float(gone[2]),
                "touched": touched,
                "force_n": most,
            },
        )


def _pressed(arm: Mover) -> Array:
    """Return the sum of what the arm presses with, N in the world, shape (3,)."""
    if arm.driver.capabilities.contact == "named":
        return sum(arm.forces().values(), np.zeros(3))
    return arm.force_on(None)
