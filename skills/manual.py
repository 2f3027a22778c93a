"""The hand moved by itself, for clients that do not go by the verbs: to a point, open, closed.

They are no part of the catalogue: no sentence and no plan means them. Limits, collisions and errors are those of every skill.
"""

from __future__ import annotations

import numpy as np

from robosandbox.errors import AlreadyHoldingError, CollisionError, Phase, UnreachableError
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.carrying import carried_along, carry_speed
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Array, Pose, SkillResult

_DOWN = np.array([0.0, 0.0, -1.0])
# Headings of the closing direction that are tried where none is asked for, rad from the present one. Chosen: quarter turns.
_TURNS = (0.0, np.pi / 2.0)


class MoveTo(Skill):
    """Move the hand to a point."""

    name = "move_to"

    def run(self, ctx: SkillContext, *, x: float, y: float, z: float, heading: float | None = None) -> SkillResult:
        """Move the tool centre point to a place on a free way, the hand pointing down; what it holds stays held.

        Args:
            x: Forward from the world's origin, metres.
            y: To the left, metres.
            z: Up, metres.
            heading: Direction in which the fingers close about the vertical, rad from x; as it is when left out.

        Raises:
            UnreachableError: The hand cannot be there.
            CollisionError: Something is in the way.
            LimitError: It is outside of the workspace.
            TrackingError: The arm did not arrive.
        """
        arm = Manipulator(ctx)
        held = arm.start.held
        arm.use(arm.start, held=held)
        speed = arm.tempo.free
        if held:
            speed = carry_speed(arm, arm.held, arm.start, speed)
            arm.motion.allow(*carried_along(arm.find(held), arm.start))
        trajectory = arm.motion.plan_joints(arm.q, _standing_at(arm, (x, y, z), heading), speed=speed)
        arm.follow(trajectory, Phase.APPROACH)
        there = arm.state.tcp_pose
        off = float(np.linalg.norm(there.position - np.array([x, y, z])))
        return SkillResult(
            skill=self.name, detail={"x": there.xyz[0], "y": there.xyz[1], "z": there.xyz[2], "off_mm": 1e3 * off}
        )


class OpenGripper(Skill):
    """Open the gripper."""

    name = "open_gripper"

    def run(self, ctx: SkillContext) -> SkillResult:
        """Open the gripper all the way where the arm is; what is held has to be put down by a skill.

        Raises:
            AlreadyHoldingError: Something is held, which would fall.
        """
        arm = Manipulator(ctx)
        if arm.start.held is not None:
            raise AlreadyHoldingError(
                f"the gripper holds {arm.start.held}, which would fall; put it down with place_at, place_on or place_in",
                phase=Phase.CHECK,
            )
        arm.open()
        return SkillResult(skill=self.name, detail={"width_mm": 1e3 * arm.gripper.width})


class CloseGripper(Skill):
    """Close the gripper."""

    name = "close_gripper"

    def run(self, ctx: SkillContext) -> SkillResult:
        """Close the gripper where the arm is, until its fingers stop.

        Raises:
            UnsupportedError: The robot has no gripper.
        """
        arm = Manipulator(ctx)
        width = arm.close()
        held = arm.look().held
        return SkillResult(skill=self.name, detail={"width_mm": 1e3 * width, "held": held or ""})


def _standing_at(arm: Manipulator, point: tuple[float, float, float], heading: float | None) -> Array:
    """Return a configuration with the hand pointing down at a point, free of collisions.

    Raises:
        UnreachableError: There is none.
        CollisionError: Each touches something.
    """
    closing = arm.state.tcp_pose.rotation[:, 1]
    present = float(np.arctan2(closing[1], closing[0]))
    failure: UnreachableError | CollisionError | None = None
    for angle in [heading] if heading is not None else [present + turn for turn in _TURNS]:
        y = np.array([np.cos(angle), np.sin(angle), 0.0])
        pose = Pose.from_matrix(np.array(point), np.column_stack([np.cross(y, _DOWN), y, _DOWN]))
        try:
            q = arm.motion.ik(pose, arm.q)
        except UnreachableError as error:
            failure = failure or error
            continue
        failure = arm.motion.touch(q)
        if failure is None:
            return q
    assert failure is not None
    raise failure


MANUAL: tuple[Skill, ...] = (MoveTo(), OpenGripper(), CloseGripper())
"""The three, for `Agent`."""
