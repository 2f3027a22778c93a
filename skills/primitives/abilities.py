"""What the robot of a context can do, asked of its own kinematics and grasp planner: for checking plans without moving."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from robosandbox.errors import UnreachableError
from robosandbox.grasp.hand import lean
from robosandbox.protocols import SkillContext
from robosandbox.skills.primitives.grasping import why_no_grasp
from robosandbox.types import Array, DetectedObject, Limits, ObservedScene, Pose, force_limits
from robosandbox.world.abilities import Abilities

# Height over the table up to which what is in easy reach needs no inverse kinematics, metres: reach is measured there.
_LOW = 0.25
# Attitudes of the hand that are tried at a point: turns about the vertical, and tilts outwards, radians.
_YAWS = (0.0, np.pi / 2.0)
_LEANS = (0.0, 0.5, 1.0)
# Seeds of inverse kinematics at each: with ten nearly all that can be reached is found.
_RESTARTS = 12
_DOWN = np.array([0.0, 0.0, -1.0])


class GripperAbilities(Abilities):
    """What a skill knows of its robot before it plans: reach and grasps are then found out by planning itself.

    Args:
        ctx: The robot.
    """

    def __init__(self, ctx: SkillContext) -> None:
        gripper, state = ctx.sim.spec.gripper, ctx.sim.state().gripper
        self.gripper = gripper is not None
        if gripper is not None and state is not None:
            self.apertures = (gripper.geometry.min_aperture, gripper.geometry.max_aperture)
            self.aperture, self.cup = state.width, gripper.geometry.cup

    def out_of_reach(self, point: Sequence[float], scene: ObservedScene) -> str | None:
        """Return None: motion planning tells."""
        del point, scene
        return None


class RobotAbilities(GripperAbilities):
    """What is known of a robot from its model.

    Args:
        ctx: The robot, its motion planner and its grasp planner.
        limits: What nobody's plan may pass, beside the limits in the robot's sidecar.
    """

    def __init__(self, ctx: SkillContext, limits: Limits | None = None) -> None:
        super().__init__(ctx)
        self._ctx = ctx
        kept = [one for one in (ctx.sim.spec.limits, limits) if one is not None]
        self.workspaces = [one.workspace for one in kept if one.workspace is not None]
        self.max_force, _ = force_limits(*kept)
        self._planning = ctx.planning(ctx.look())

    def out_of_reach(self, point: Sequence[float], scene: ObservedScene) -> str | None:
        """Return why the hand cannot work at a point (3,) of the world, metres: by distance first, then by its kinematics."""
        far_out = Abilities.out_of_reach(self, point, scene)
        if far_out is not None:
            return far_out
        distance, (near, far) = math.dist(point[:2], scene.base_xy), scene.reach
        if near <= distance <= far and point[2] - scene.table_height < _LOW:
            return None
        motion = self._ctx.motion
        motion.use(self._planning, self._ctx.sim.state())
        for pose in self._attitudes(np.array(point)):
            try:
                motion.ik(pose, restarts=_RESTARTS)
            except UnreachableError:
                continue
            return None
        return f"it is {distance:.2f} m from the robot at a height of {point[2]:.2f} m, and no attitude of the hand gets there"

    def _attitudes(self, point: Array) -> Iterator[Pose]:
        for angle in _LEANS:
            for yaw in _YAWS:
                closing = np.array([np.cos(yaw), np.sin(yaw), 0.0])
                down = np.column_stack([np.cross(closing, _DOWN), closing, _DOWN])
                yield Pose.from_matrix(point, lean(point - self._ctx.sim.spec.base_position, angle) @ down)

    def ungraspable(self, item: DetectedObject, scene: ObservedScene) -> str | None:
        """Return why the gripper cannot take hold of an object as it lies; None where it can."""
        robot = self._ctx.sim.spec
        if robot.gripper is None or scene.held == item.id:
            return None
        pieces = () if item.shape.size_fields else self._planning.pieces(item.id)
        found = self._ctx.grasp.candidates(item, scene, robot, pieces=pieces)
        if next(iter(found), None) is not None:
            return None
        return f"no grasp fits {item.id}: {why_no_grasp(robot.gripper.geometry, item, pieces)}"

    def off_home(self) -> float:
        """Return how far the arm's joints are off their home, radians or metres."""
        return float(np.abs(self._ctx.sim.state().q - self._ctx.sim.spec.home_q).max())
