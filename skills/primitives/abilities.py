"""Abilities of a context's robot, from its own kinematics and grasp planner, to check plans without moving."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from robosandbox.errors import CollisionError, UnreachableError
from robosandbox.grasp.crowding import is_alone, may_meet, neighbours
from robosandbox.grasp.hand import lean
from robosandbox.shapes.drawer import GRIP_WIDTH
from robosandbox.skills.primitives.grasping import plan_grasp, why_no_grasp
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.nudging import nudge_may_help
from robosandbox.skills.primitives.part_ways import PRESHAPE, plan_lead
from robosandbox.skills.primitives.parts import PULLED_SHARE
from robosandbox.skills.primitives.placing import plan_put
from robosandbox.skills.primitives.rehearsal import hand_planner, rehearse, with_aperture
from robosandbox.skills.primitives.strokes import plan_push_to, plan_stroke
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import ArmState, Array, DetectedObject, Grasp, Limits, ObservedScene, Pose, force_limits
from robosandbox.world.abilities import Abilities, Obstruction
from robosandbox.world.effects import taken
from robosandbox.world.parts import open_value, part_value
from robosandbox.world.placement_sampling import Placement, levelled, resting_pose, with_pose

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
    """Abilities that a skill knows before it plans: reach and grasps are then found out by planning itself.

    Args:
        ctx: The robot.
    """

    def __init__(self, ctx: SkillContext) -> None:
        gripper, state = ctx.arm.spec.gripper, ctx.arm.state().gripper
        self.gripper: bool = gripper is not None
        self.max_force: float = ctx.max_force_n
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
    """Abilities of a robot from its model.

    Args:
        ctx: The robot, its motion planner and its grasp planner.
        limits: What nobody's plan may pass, beside the limits in the robot's sidecar.
    """

    def __init__(self, ctx: SkillContext, limits: Limits | None = None) -> None:
        super().__init__(ctx)
        self._ctx = ctx
        kept = [one for one in (ctx.arm.spec.limits, limits) if one is not None]
        self.workspaces = [one.workspace for one in kept if one.workspace is not None]
        self.max_force, _ = force_limits(*kept)
        self._planning = ctx.planning(ctx.look())
        self._hand = hand_planner(ctx)
        self._last: tuple[DetectedObject, ObservedScene, Grasp | None] | None = None

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
        motion.use(self._planning, self._ctx.arm.state())
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
        if self._ctx.arm.spec.gripper is None or self._planning.seen.held == item.id:
            return False
        low = (*item.pose.xyz[:2], scene.table_height)
        grasps = (grasp.tcp_pose.rotation[2, 2] for grasp in self._grasps(item, scene))
        return self._is_easy(low, scene) and any(down < -_STRAIGHT for down in grasps)

    def _attitudes(self, point: Array, leans: Sequence[float]) -> Iterator[Pose]:
        for angle in leans:
            for yaw in _YAWS:
                closing = np.array([np.cos(yaw), np.sin(yaw), 0.0])
                down = np.column_stack([np.cross(closing, _DOWN), closing, _DOWN])
                yield Pose.from_matrix(point, lean(point - self._ctx.arm.spec.base_position, angle) @ down)

    def _grasps(self, item: DetectedObject, scene: ObservedScene) -> Iterable[Grasp]:
        pieces = self._planning.pieces(item.id)
        return self._ctx.grasp.candidates(item, scene, self._ctx.arm.spec, pieces=pieces)

    def _first_grasp(self, item: DetectedObject, scene: ObservedScene) -> Grasp | None:
        """Return the best grasp; kept for the next question, which is often about the same object in the same scene."""
        if self._last is None or self._last[0] is not item or self._last[1] is not scene:
            self._last = (item, scene, next(iter(self._grasps(item, scene)), None))
        return self._last[2]

    def ungraspable(self, item: DetectedObject, scene: ObservedScene) -> str | None:
        """Return why the gripper cannot take hold of an object as it lies; None where it can."""
        robot = self._ctx.arm.spec
        if robot.gripper is None or scene.held == item.id:
            return None
        if self._first_grasp(item, scene) is not None:
            return None
        pieces = self._planning.pieces(item.id)
        return f"no grasp fits {item.id}: {why_no_grasp(robot.gripper.geometry, item, pieces)}"

    def unpushable(
        self, item: DetectedObject, axis: Sequence[float], distance: float, scene: ObservedScene
    ) -> Obstruction | None:
        """Return what keeps the hand from pushing an object along a level unit vector (3,), whichever way it is turned."""
        return self._obstructed(scene, lambda arm: plan_stroke(arm, item, scene, np.array(axis), distance))

    def unpushable_to(self, item: DetectedObject, point: Sequence[float], scene: ObservedScene) -> Obstruction | None:
        """Return what keeps the hand from pushing an object to a point (2,) of the table, whichever way it goes."""
        return self._obstructed(scene, lambda arm: plan_push_to(arm, item, scene, np.array(point)))

    def _obstructed(self, scene: ObservedScene, plan: Callable[[Manipulator], object]) -> Obstruction | None:
        """Return what keeps the closed hand from what is planned."""
        robot = self._ctx.arm.spec
        if robot.gripper is None or scene.held is not None:
            return None
        closed = with_aperture(self._ctx, robot.gripper.geometry.min_aperture)
        return rehearse(self._ctx, self._hand, scene, closed, plan)

    def unopenable(self, drawer: DetectedObject, scene: ObservedScene) -> Obstruction | None:
        """Return what keeps the hand from pulling a drawer open at its grip, whichever way it is turned."""
        gripper, goal = self._ctx.arm.spec.gripper, open_value(drawer, PULLED_SHARE)
        if gripper is None or scene.held is not None or part_value(drawer) >= goal:
            return None
        opened = with_aperture(self._ctx, min(gripper.geometry.max_aperture, GRIP_WIDTH + 2.0 * PRESHAPE))

        def pull(arm: Manipulator) -> None:
            arm.use(scene)
            plan_lead(arm, drawer, [goal])

        return rehearse(self._ctx, self._hand, scene, opened, pull)

    def untakeable(self, item: DetectedObject, scene: ObservedScene) -> Obstruction | None:
        """Return what the hand meets with each grasp of an object, coming, closing or rising; None where one is free."""
        gripper = self._ctx.arm.spec.gripper
        if gripper is None or scene.held is not None:
            return None
        near = neighbours(item, scene)
        if is_alone(item, near, gripper.geometry, self._hand.bounds(self._planning)):
            return None
        first = self._first_grasp(item, scene)
        if first is None or not may_meet(first, near, gripper.geometry, self._hand.bounds(self._planning)):
            return None
        return rehearse(self._ctx, self._hand, scene, self._ctx.arm.state(), lambda arm: _take(arm, item, scene))

    def unplaceable(
        self, item: DetectedObject, spots: Sequence[Placement], allowed: Sequence[str], scene: ObservedScene
    ) -> Obstruction | None:
        """Return what the hand meets on each of some spots however it holds an object; None where it has room on one."""
        gripper = self._ctx.arm.spec.gripper
        if gripper is None or not spots:
            return None
        first_spot = spots[0]
        there = with_pose(item, resting_pose(item, first_spot, first_spot.rotation(levelled(item), first_spot.yaws[0])))
        emptied = scene.holding(None)
        others = replace(emptied, objects=tuple(one for one in scene.objects if one.id not in (item.id, *allowed)))
        near, palm = neighbours(there, others), self._hand.bounds(self._planning)
        if is_alone(there, near, gripper.geometry, palm):
            return None
        first = self._first_grasp(there, replace(emptied, objects=(there,)))
        if first is not None and not may_meet(first, near, gripper.geometry, palm):
            return None
        above = scene if scene.held == item.id else taken(scene, item.id)
        held = above.find(item.id) or item
        found = []
        is_covered = all(spot.way_out is not None for spot in spots)
        for state in self._holding(held, there, scene, is_covered=is_covered):
            met = rehearse(self._ctx, self._hand, above, state, lambda arm: plan_put(arm, held, above, spots, allowed))
            if met is None:
                return None
            found.append(met)
        return next((met for met in found if met.met is not None), None)

    def _holding(
        self, held: DetectedObject, there: DetectedObject, scene: ObservedScene, *, is_covered: bool
    ) -> Iterator[ArmState]:
        """Yield how the robot may stand with an object in the hand, as it holds it or as it would where it is put down.

        Under something fixed the most level hands come first, one of each kind, since the object may stand there turned any way.
        """
        if self._planning.seen.held == held.id:
            yield self._ctx.arm.state()
            return
        alone = replace(scene.holding(None), objects=(there,))
        kinds: dict[tuple[object, ...], Grasp] = {}
        for grasp in self._grasps(there, alone):
            down = -float(grasp.tcp_pose.rotation[2, 2])
            # From straight above wherever that can be, as picks do.
            if kinds and not is_covered and down < _STRAIGHT:
                break
            closing = np.abs(grasp.tcp_pose.rotation[:, 1]).round(1).tolist()
            kind = (round(down, 1), round(grasp.width, 2)) if is_covered else tuple(closing)
            kinds.setdefault((grasp.how, *kind), grasp)
        found = list(kinds.values())
        if is_covered:
            found.sort(key=lambda grasp: -round(float(grasp.tcp_pose.rotation[2, 2]), 1))
        for grasp in found:
            tcp_pose = held.pose @ there.pose.inverse() @ grasp.tcp_pose
            yield replace(with_aperture(self._ctx, grasp.width), tcp_pose=tcp_pose)

    def off_home(self) -> float:
        """Return how far the arm's joints are off their home, radians or metres."""
        return float(np.abs(self._ctx.arm.state().q - self._ctx.arm.spec.home_q).max())


def _take(arm: Manipulator, item: DetectedObject, scene: ObservedScene) -> None:
    """Plan a grasp as a pick does; what is out of reach is told elsewhere.

    Raises:
        CollisionError: Every grasp that can be reached would touch something, and no nudge would help.
    """
    try:
        plan_grasp(arm, item, scene)
    except UnreachableError:
        return
    except CollisionError:
        if not nudge_may_help(arm, item, scene):
            raise
