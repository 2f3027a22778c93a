"""Move by: the hand goes some way in a straight line, also until it touches something."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from robosandbox.driver import require
from robosandbox.errors import Phase
from robosandbox.skills.base import Skill
from robosandbox.skills.move_to import arrived, ready_to_move
from robosandbox.skills.primitives.guarded import follow_until, touching_line
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Array, Pose, SkillResult
from robosandbox.world.contracts import Contract

_Way = Annotated[float, Field(ge=-2.0, le=2.0)]


class MoveBy(Skill):
    """Move the hand some way in a straight line."""

    name = "move_by"

    def contract(self, **arguments: Any) -> Contract:
        """Return that what is held stays held; nothing else is promised."""
        del arguments
        return Contract(keeps_hold=True)

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
        arm = Manipulator(ctx)
        speed = ready_to_move(arm)
        start = arm.state.tcp_pose
        way = np.array([dx, dy, dz])
        goal = Pose(xyz=tuple(start.position + way), quat_xyzw=start.quat_xyzw)
        if until_force == 0.0:
            trajectory = arm.motion.plan_line(arm.q, goal, speed=speed)
            arm.follow(trajectory, Phase.APPROACH)
            return SkillResult(skill=self.name, detail=arrived(arm, goal, trajectory.q[-1]))
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


def _pressed(arm: Manipulator) -> Array:
    """Return the sum of what the arm presses with, N in the world, shape (3,)."""
    if arm.driver.capabilities.contact == "named":
        return sum(arm.forces().values(), np.zeros(3))
    return arm.force_on(None)
