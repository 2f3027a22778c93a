"""A nudge: what lies at the wall of what holds it is dragged off by a fingertip on its top, so that fingers fit between.

Beside a wall there is no room for a finger, and pushing comes from that side. A fingertip that presses from above drags by
friction (Lynch and Mason, "Stable pushing", 1996, treat its mirror image): what is flat slides or tips over its farther edge,
what is round rolls. The tip keeps pressing alike on whatever height the top has meanwhile.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from robosandbox.errors import CollisionError, LimitError, Phase, SkillError, UnreachableError
from robosandbox.skills.primitives.grasping import plan_grasp
from robosandbox.skills.primitives.guarded import follow_free
from robosandbox.skills.primitives.manipulator import Manipulator, raised
from robosandbox.skills.primitives.pressing import StraightPath
from robosandbox.types import CAREFUL, Array, DetectedObject, ObservedScene, Pose, Trajectory
from robosandbox.world.containers import walls
from robosandbox.world.relations import bottom, centre, lies_in, moved, support, top

# N with which the tip presses; chosen as the weight of half a kilogram: a thing of a few hundred grams is dragged, and what
# holds it, pressed down as much, stays.
_PRESS = 5.0
# m/s of the tip up or down for each newton that it presses too hard or too little; chosen so that a touch at 5 mm/s is felt
# before a stiff servo of 20 N/mm gives twice the force.
_GIVE = 0.001
# m/s along; chosen so that a thing that tips over is followed.
_SPEED = 0.02
# Metres over the top from which it is felt for, and under it at which it is given up; chosen above perception's error.
_FEEL_FROM, _FEEL_TO = 0.004, 0.008
# Metres that a finger needs beside the thing besides its own thickness; chosen as its clearance on both sides.
_ROOM = 0.008
# Where on the top it presses, as a share of the way from its middle to its edge on the farther side; chosen so that what may
# roll is pressed in the middle if the hand fits there.
_PLACES = (0.0, 0.3, 0.6)
# Turns of the hand that are tried, radians.
_TURNS = tuple(np.arange(8) * math.pi / 4.0)
# Metres between two heights at which it is checked what the hand would touch; chosen as twice the planner's clearance.
_STEP_DOWN = 0.002
# Places along the way at which that is checked; chosen as a centimetre apart.
_CHECKED = 5
# Control ticks without a touch after which the thing is gone from under the tip; chosen as what it takes to tip over.
_LOST_TICKS = 60
# Metres over the thing from which the tip comes; chosen as the least from which it is seen to be free of the walls.
_HOVER = 0.04
# Metres that it has to have gone; chosen above perception's error.
_MOVED = 0.005
# Seconds for each metre of a way until it is given up; chosen as twice what it takes.
_SECONDS_PER_METRE = 100.0
_DOWN = np.array([0.0, 0.0, -1.0])


def nudge_off_walls(arm: Manipulator, name: str, *, most: float) -> bool:
    """Drag a thing away from the walls that leave no room for a finger beside it; tell whether it has moved.

    Nothing is done where it is at no wall, where the driver does not tell forces, or where a closed hand has no room above it.

    Args:
        arm: Whose hand; it is empty.
        name: Id of the thing.
        most: With how many newtons it may be pressed at most.

    Raises:
        SkillError: The hand met something on its way.
    """
    if not arm.driver.capabilities.wrist_wrench:
        return False
    scene = arm.look()
    target = arm.find(name, scene)
    return any(
        _may_help(arm, target, scene, away) and _dragged(arm, target, scene, away, most)
        for away in ways_off(target, scene, arm.geometry.finger_thickness + _ROOM)
    )


def nudge_may_help(arm: Manipulator, target: DetectedObject, scene: ObservedScene) -> bool:
    """Tell whether a fingertip has room to drag a thing off the walls that it lies at, and a grasp could be planned then."""
    if not arm.driver.capabilities.wrist_wrench:
        return False
    return any(
        _may_help(arm, target, scene, away) and _plan(arm, target, scene, away) is not None
        for away in ways_off(target, scene, arm.geometry.finger_thickness + _ROOM)
    )


def _may_help(arm: Manipulator, target: DetectedObject, scene: ObservedScene, away: Array) -> bool:
    """Tell whether a grasp could be planned if it lay elsewhere: in a bin that is too deep, no nudge helps."""
    there = replace(target, pose=Pose.from_matrix(target.pose.position + away, target.pose.rotation))
    imagined = replace(scene, objects=tuple(there if item.id == target.id else item for item in scene.objects))
    try:
        plan_grasp(arm, there, imagined)
    except SkillError:
        return False
    return True


def ways_off(target: DetectedObject, scene: ObservedScene, needed: float) -> Iterator[Array]:
    """Yield ways (3,) after which so much room, metres, is at the walls beside a thing: off all of them at once, then off each."""
    lacking = [
        -(needed - gap) * direction
        for vessel in scene.objects
        if vessel.id != target.id and lies_in(target, vessel)
        for direction, gap in walls(target, vessel)
        if gap < needed
    ]
    if len(lacking) > 1:
        yield np.sum(lacking, axis=0)
    yield from lacking


def _dragged(arm: Manipulator, target: DetectedObject, scene: ObservedScene, away: Array, most: float) -> bool:
    """Drag it along a way (3,); tell whether it went."""
    plan = _plan(arm, target, scene, away)
    if plan is None:
        return False
    approach, descent, way = plan
    arm.open_for(approach, 0.0)
    follow_free(arm, approach, Phase.APPROACH)
    follow_free(arm, descent, Phase.DESCEND)
    arm.ctx.enter(Phase.PUSH)
    arm.ctx.announce(way)
    drag = _DragStroke(arm, StraightPath.of(arm, way), target, most)
    try:
        if drag.touch():
            drag.along()
    except LimitError:
        # The arm holds: what came of it is looked at.
        pass
    arm.use(arm.look())
    arm.motion.allow(target.id)
    try:
        arm.rise(_HOVER + _FEEL_TO, Phase.RETREAT)
    except CollisionError:
        arm.rise_out(_HOVER + _FEEL_TO, Phase.RETREAT)
    after = arm.settle(target.id).find(target.id)
    return after is not None and moved(target, after) > _MOVED


def _plan(
    arm: Manipulator, target: DetectedObject, scene: ObservedScene, away: Array
) -> tuple[Trajectory, Trajectory, Trajectory] | None:
    """Return ways to over its top, down to it, and along; None where the closed hand has no room."""
    arm.ctx.enter(Phase.PLAN)
    arm.use(scene)
    motion, q = arm.motion, arm.q
    heading = away / float(np.linalg.norm(away))
    middle = centre(target)
    edge = float(support(target, heading[None])[0] - heading @ middle)
    motion.open_to(arm.geometry.min_aperture)
    for share, turn in itertools.product(_PLACES, _TURNS):
        closing = np.array([math.cos(turn), math.sin(turn), 0.0])
        rotation = np.column_stack([np.cross(closing, _DOWN), closing, _DOWN])
        place = middle + share * edge * heading
        height = top(target) + arm.geometry.tip_depth + _FEEL_FROM
        begin = Pose.from_matrix(np.array([*place[:2], height]), rotation)
        end = Pose.from_matrix(begin.position + away, rotation)
        motion.allow()
        try:
            descent = arm.line_to(begin, raised(begin, _HOVER), speed=arm.tempo.near)
            approach = motion.plan_joints(q, descent.q[0], speed=arm.tempo.free)
            motion.allow(target.id)
            motion.plan_line(descent.q[-1], raised(begin, -_FEEL_FROM - _STEP_DOWN))
            return approach, descent, motion.plan_line(descent.q[-1], end, speed=CAREFUL.lower)
        except (UnreachableError, CollisionError):
            continue
    return None


class _DragStroke:
    """A fingertip that presses down alike on its way.

    Args:
        arm: Its tip is over the thing, where the way begins; its motion planner may touch that.
        way: Over its top.
        target: What is dragged.
        most: With how many newtons at most.
    """

    def __init__(self, arm: Manipulator, way: StraightPath, target: DetectedObject, most: float) -> None:
        self._arm = arm
        self._way = way
        self._target = target.id
        self._most = most
        self._lift = 0.0
        self._places = np.linspace(0.0, way.length, _CHECKED)
        self._lowest = np.array([-self._depth(place, top(target) - bottom(target)) for place in self._places])

    def _depth(self, place: float, most: float) -> float:
        """Return how far under a place of the way the hand is free of all but the target, metres."""
        depths = np.arange(_STEP_DOWN, most, _STEP_DOWN)
        blocked = (d for d in depths if self._arm.motion.touch(self._way.at(place, -float(d))) is not None)
        return float(next(blocked, most)) - _STEP_DOWN

    def touch(self) -> bool:
        """Go down until it is pressed on; tell whether it was."""
        while self._lift > max(self._lowest[0], -(_FEEL_FROM + _FEEL_TO)):
            if self._feel(0.0) >= _PRESS / 2.0:
                return True
        return False

    def along(self) -> None:
        """Go along to the end, unless it takes too much force or time, or the thing is gone from under the tip."""
        driver, place, lost = self._arm.driver, 0.0, 0
        deadline = driver.time + _SECONDS_PER_METRE * self._way.length
        while place < self._way.length and driver.time < deadline and lost < _LOST_TICKS:
            force = self._feel(place)
            if force > self._most / 2.0:
                return
            lost = 0 if force > 0.0 else lost + 1
            place += _SPEED * driver.control_timestep

    def _feel(self, place: float) -> float:
        """Let a tick pass at a place along the way; give way upwards or follow downwards; return the force, N."""
        arm = self._arm
        force = arm.force_on(self._target)
        beyond = -float(force[2]) - _PRESS
        lowest = float(np.interp(place, self._places, self._lowest))
        self._lift = max(lowest, self._lift + _GIVE * beyond * arm.driver.control_timestep)
        arm.trim(self._way.at(place, self._lift))
        return float(np.linalg.norm(force))
