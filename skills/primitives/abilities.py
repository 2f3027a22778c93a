"""What the robot of a context can do, asked of its own kinematics and grasp planner: for checking plans without moving."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from robosandbox.errors import UnreachableError
from robosandbox.grasp.hand import lean
from robosandbox.protocols import SkillContext
from robosandbox.skills.primitives.drawers import (
    OPEN_SHARE,
    grip_aperture,
    opening_of,
    plan_pull,
)
from robosandbox.skills.primitives.grasping import why_no_grasp
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.rehearsal import rehearse, with_aperture
from robosandbox.skills.primitives.strokes import plan_stroke
from robosandbox.types import Array, DetectedObject, Grasp, Limits, ObservedScene, Pose, force_limits
from robosandbox.world.abilities import Abilities, Obstruction

# Height over the table up to which what is in easy reach needs no inverse kinematics, metres: reach is measured there.
_LOW = 0.25
# Attitudes of the hand that are tried at a point: turns about the vertical, and tilts outwards, radians.
_YAWS = (0.0, np.pi / 2.0)
_LEANS = (0.0, 0.5, 1.0)
# Cosine of the angle to the vertical up to which a hand points straight down; chosen as 2.6 degrees.
_STRAIGHT = 0.999
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

    def out_of_reach(
        self, point: Sequence[float], scene: ObservedScene, carried: DetectedObject | None = None
    ) -> str | None:
        """Return None: motion planning tells."""
        del point, scene, carried
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

    def out_of_reach(
        self, point: Sequence[float], scene: ObservedScene, carried: DetectedObject | None = None
    ) -> str | None:
        """Return why the hand cannot work at a point (3,) of the world, metres: by distance first, then by its kinematics."""
        far_out = Abilities.out_of_reach(self, point, scene)
        if far_out is not None:
            return far_out
        if self._is_easy(point, scene):
            return None
        motion = self._ctx.motion
        motion.use(self._planning, self._ctx.sim.state())
        upright = carried is not None and self._is_held_from_above(carried, scene)
        for pose in self._attitudes(np.array(point), _LEANS[:1] if upright else _LEANS):
            try:
                motion.ik(pose, restarts=_RESTARTS)
            except UnreachableError:
                continue
            return None
        where = f"{math.dist(point[:2], scene.base_xy):.2f} m from the robot at a height of {point[2]:.2f} m"
        if carried is not None and upright:
            return f"it is {where}, and the hand, straight above {carried.id} as it takes it, does not get there"
        return f"it is {where}, and no attitude of the hand gets there"

    def _is_easy(self, point: Sequence[float], scene: ObservedScene) -> bool:
        """Tell whether a point is where the hand, pointing down, was measured to get to."""
        near, far = scene.reach
        return near <= math.dist(point[:2], scene.base_xy) <= far and point[2] - scene.table_height < _LOW

    def _is_held_from_above(self, item: DetectedObject, scene: ObservedScene) -> bool:
        """Tell whether a pick takes an object from straight above: what it does wherever it can, and keeps till it is put down.

        Of what is in the hand already the grasp may be any.
        """
        if self._ctx.sim.spec.gripper is None or self._planning.seen.held == item.id:
            return False
        low = (*item.pose.xyz[:2], scene.table_height)
        grasps = (grasp.tcp_pose.rotation[2, 2] for grasp in self._grasps(item, scene))
        return self._is_easy(low, scene) and any(down < -_STRAIGHT for down in grasps)

    def _attitudes(self, point: Array, leans: Sequence[float]) -> Iterator[Pose]:
        for angle in leans:
            for yaw in _YAWS:
                closing = np.array([np.cos(yaw), np.sin(yaw), 0.0])
                down = np.column_stack([np.cross(closing, _DOWN), closing, _DOWN])
                yield Pose.from_matrix(point, lean(point - self._ctx.sim.spec.base_position, angle) @ down)

    def _grasps(self, item: DetectedObject, scene: ObservedScene) -> Iterable[Grasp]:
        pieces = () if item.shape.size_fields else self._planning.pieces(item.id)
        return self._ctx.grasp.candidates(item, scene, self._ctx.sim.spec, pieces=pieces)

    def ungraspable(self, item: DetectedObject, scene: ObservedScene) -> str | None:
        """Return why the gripper cannot take hold of an object as it lies; None where it can."""
        robot = self._ctx.sim.spec
        if robot.gripper is None or scene.held == item.id:
            return None
        if next(iter(self._grasps(item, scene)), None) is not None:
            return None
        pieces = () if item.shape.size_fields else self._planning.pieces(item.id)
        return f"no grasp fits {item.id}: {why_no_grasp(robot.gripper.geometry, item, pieces)}"

    def unpushable(
        self, item: DetectedObject, axis: Sequence[float], distance: float, scene: ObservedScene
    ) -> Obstruction | None:
        """Return what keeps the hand from pushing an object along a level unit vector (3,), whichever way it is turned."""
        robot = self._ctx.sim.spec
        if robot.gripper is None or scene.held is not None:
            return None
        closed = with_aperture(self._ctx, robot.gripper.geometry.min_aperture)
        return rehearse(self._ctx, scene, closed, lambda arm: plan_stroke(arm, item, scene, np.array(axis), distance))

    def unopenable(self, drawer: DetectedObject, scene: ObservedScene) -> Obstruction | None:
        """Return what keeps the hand from pulling a drawer open at its grip, whichever way it is pitched."""
        gripper = self._ctx.sim.spec.gripper
        if gripper is None or scene.held is not None:
            return None
        travel = max(OPEN_SHARE * drawer.size[3] - opening_of(drawer), 0.0)
        if travel == 0.0:
            return None
        opened = with_aperture(self._ctx, grip_aperture(gripper.geometry, drawer))

        def pull(arm: Manipulator) -> None:
            arm.use(scene)
            plan_pull(arm, drawer, travel)

        return rehearse(self._ctx, scene, opened, pull)

    def off_home(self) -> float:
        """Return how far the arm's joints are off their home, radians or metres."""
        return float(np.abs(self._ctx.sim.state().q - self._ctx.sim.spec.home_q).max())
