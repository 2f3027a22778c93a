"""The strokes of a push: how the hand is turned, how high it goes, and where its way begins and ends."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from robosandbox.errors import CollisionError, Phase, SkillError, UnreachableError
from robosandbox.evidence import CollisionEvidence
from robosandbox.skills.primitives.manipulator import HOVER_HEIGHT, Manipulator
from robosandbox.types import Array, DetectedObject, ObservedScene, Pose, Trajectory
from robosandbox.types.robot import RobotSpec
from robosandbox.values import frozen
from robosandbox.world.effects import shifted
from robosandbox.world.nearness import nearer
from robosandbox.world.placement_sampling import at_its_height
from robosandbox.world.relations import bottom, bounds, centre, gap, support, top

# Metres between fingers and object before a stroke; chosen as ten times perception's error (halved 2 % shorter
# episodes, doubled 10 % longer).
STAND_OFF = 0.012
# Metres between fingertips and table; chosen as four times the planner's clearance.
_TIP_CLEARANCE = 0.004
# How much of an object's height a fingertip has before it at least that pushes it high, metres; chosen as half a pad of
# small grippers.
_TIP_HOLD = 0.012
# Cosine of the angle to the vertical up to which a container stands level; chosen as 8 degrees.
_LEVEL = 0.99
# Metres that a leg of a bent way is long at least, and apart that places along it are checked; chosen as half a finger's width.
_SHORTEST_LEG = 0.01
# Cosine from which on fingers close along a stroke.
_SQUARE = 0.5
# Share of the joints' speed limits; chosen so that what is pushed stays at the fingers (halved 11 % longer episodes,
# doubled 12 % shorter, all succeed).
_PUSH_SPEED = 0.12


@frozen
class Stroke:
    """The ways of a push: to over where it begins, down to there, and along.

    Attributes:
        end: World xy of the object's middle in the end, metres.
        distance: How far the object is to go, metres.
        aperture: How far apart the fingers are, metres.
    """

    approach: Trajectory
    descent: Trajectory
    push: Trajectory
    end: tuple[float, float]
    distance: float
    aperture: float = 0.0


def plan_stroke(
    arm: Manipulator, target: DetectedObject, scene: ObservedScene, axis: Array, distance: float, missed: int = 0
) -> Stroke:
    """Return the first free ways on which the hand gets behind an object, along, and up from there: closed, or with an open finger ahead.

    Args:
        arm: The skill's manipulator.
        target: What to push.
        scene: What else is there.
        axis: Where to, a level unit vector (3,).
        distance: How far, metres.
        missed: How many strokes have passed by the object: for each the hand is turned.

    Raises:
        UnreachableError: Every stroke leaves the robot's reach.
        CollisionError: Something is in the way of all that do not.
    """
    failures: list[SkillError] = []
    arm.ctx.enter(Phase.PLAN)
    arm.use(scene)
    robot = arm.spec
    least = 0.0 if robot.gripper is None else robot.gripper.geometry.min_aperture
    options = hand_rotations(robot, axis, arm.state.tcp_pose.rotation)
    turned = 2 * missed % len(options)
    hands = (*options[turned:], *options[:turned])
    ways = itertools.product(stroke_heights(robot, target, axis, scene.table_height), hands)
    behind = (stroke_poses(target, axis, distance, hand, height) for height, hand in ways)
    within = (poses for hand in hands for poses in inner_stroke_poses(robot, target, axis, distance, hand))
    pushes = [(least, *poses) for poses in itertools.chain(behind, within)]
    if robot.gripper is not None:
        # An open finger goes where the palm has no room.
        most = robot.gripper.geometry.max_aperture
        wide = [
            (rotation, depth + (most - least) / 2.0)
            for rotation, depth in options
            if abs(float(rotation[:, 1] @ axis)) > _SQUARE
        ]
        ways = itertools.product(stroke_heights(robot, target, axis, scene.table_height), wide)
        pushes += [(most, *stroke_poses(target, axis, distance, hand, height)) for height, hand in ways]
    for aperture, start, end in pushes:
        try:
            arm.motion.open_to(aperture)
            arm.motion.allow()
            descent = arm.line_down(start, speed=arm.tempo.near)
            approach = arm.motion.plan_joints(arm.q, descent.q[0], speed=arm.tempo.free)
            arm.motion.allow(target.id)
            push = arm.motion.plan_line(descent.q[-1], end, speed=_PUSH_SPEED)
            arm.line_up(push.q[-1], HOVER_HEIGHT, speed=arm.tempo.free)
            x, y = map(float, (centre(target) + distance * axis)[:2])
            return Stroke(approach, descent, push, (x, y), distance, aperture)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
    raise arm.clearest(failures)


def plan_push_to(
    arm: Manipulator, target: DetectedObject, scene: ObservedScene, goal: Array, missed: int = 0
) -> Stroke:
    """Return the first stroke of the first free way on which an object is pushed to a point of the table: straight, or bent.

    A bent way goes along one axis of the table and then along the other, or around what stands between. On each leg the object
    meets nothing, and the hand comes behind it.

    Args:
        arm: The skill's manipulator.
        target: What to push.
        scene: What else is there.
        goal: World xy of its middle in the end, metres (2,).
        missed: How many strokes have passed by the object: for each the hand is turned.

    Raises:
        UnreachableError: Every way leaves the robot's reach.
        CollisionError: Something is in the way of all that do not.
    """
    failures: list[SkillError] = []
    for bend in _bends(target, goal):
        try:
            strokes = [_leg(arm, target, scene, begin, end, missed) for begin, end in itertools.pairwise(bend)]
            return strokes[0]
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
    raise arm.clearest(failures)


def _bends(target: DetectedObject, goal: Array) -> Iterator[tuple[Array, ...]]:
    """Yield ways of an object to a point (2,) as the points of its middle, straight first, with legs of some length."""
    here = centre(target)[:2]
    way = goal - here
    aside = np.array([-way[1], way[0]]) / max(float(np.linalg.norm(way)), _SHORTEST_LEG)
    low, high = bounds(target)
    width = float(np.max((high - low)[:2]))
    middles = (here + way / 2.0 + k * width * aside for k in (1.0, -1.0, 2.0, -2.0))
    yield here, goal
    for bend in (np.array([goal[0], here[1]]), np.array([here[0], goal[1]]), *middles):
        if min(np.linalg.norm(bend - here), np.linalg.norm(goal - bend)) > _SHORTEST_LEG:
            yield here, bend, goal


def _leg(
    arm: Manipulator, target: DetectedObject, scene: ObservedScene, begin: Array, end: Array, missed: int
) -> Stroke:
    """Return the stroke that pushes an object from one point (2,) to another, on which it meets nothing."""
    now = shifted(scene, target.id, np.array([*(begin - centre(target)[:2]), 0.0]))
    there, way = arm.find(target.id, now), np.array([*(end - begin), 0.0])
    distance = float(np.linalg.norm(way))
    others = [
        piece
        for item in now.objects
        if item.id not in {target.id, *now.in_hands}
        for piece in at_its_height(there, item, _TIP_CLEARANCE)
    ]
    for share in np.linspace(0.0, 1.0, 1 + math.ceil(distance / _SHORTEST_LEG))[1:]:
        moved = arm.find(target.id, shifted(now, target.id, share * way))
        met = next((item for item in others if nearer(moved, item, min(_TIP_CLEARANCE, gap(there, item)))), None)
        if met is not None:
            raise CollisionError(
                f"{target.id} would meet {met.id} on its way; clear the way, or choose another place",
                phase=Phase.PLAN,
                evidence=CollisionEvidence(
                    body=target.id,
                    other=met.id,
                    depth=-gap(moved, met),
                    waypoint=round(100 * share),
                    waypoints=100,
                ),
            )
    return plan_stroke(arm, there, now, way / distance, distance, missed)


def hand_rotations(robot: RobotSpec, axis: Array, hand: Array) -> list[tuple[Array, float]]:
    """Return TCP rotations (3, 3) pointing down, wide side to the object first, each with the hand's half depth along axis.

    Args:
        robot: Whose hand.
        axis: Where to, a level unit vector (3,).
        hand: The TCP's rotation now (3, 3).
    """
    down = np.array([0.0, 0.0, -1.0])
    across = np.cross(down, axis)
    gripper = robot.gripper
    options = []
    for closing in (across, -across, axis, -axis):
        rotation = np.column_stack([np.cross(closing, down), closing, down])
        if gripper is None:
            depth = flange_depth(robot.tool_bounds, rotation.T @ axis)
        else:
            squarely = abs(float(closing @ axis)) > _SQUARE
            beside = gripper.geometry.min_aperture / 2.0 + gripper.geometry.finger_thickness
            depth = beside if squarely else gripper.geometry.finger_width / 2.0
        options.append((rotation, depth))
    # The wide side first; of two opposite hands the one that turns less.
    return sorted(
        options, key=lambda option: (abs(float(option[0][:, 1] @ axis)) > _SQUARE, -float(np.trace(hand.T @ option[0])))
    )


def flange_depth(bounds: tuple[float, float, float, float], forward: Array) -> float:
    """Return how far a flange reaches from its TCP towards `forward`, shape (3,), in the TCP frame."""
    x_min, x_max, y_min, y_max = bounds
    x = x_max if forward[0] > 0.0 else -x_min
    y = y_max if forward[1] > 0.0 else -y_min
    return x if abs(forward[0]) > abs(forward[1]) else y


def stroke_heights(robot: RobotSpec, target: DetectedObject, axis: Array, table_height: float) -> tuple[float, ...]:
    """Return heights of the TCP in a stroke, metres: the object's middle, and where that is higher, over what is beside it."""
    gripper = robot.gripper
    lowest = table_height + _TIP_CLEARANCE
    if gripper is None:
        # A flange has no fingers to reach down with: what it pushes with lies above its TCP.
        return (lowest,)
    middle = centre(target)
    usual = max(float(middle[2]), lowest + gripper.geometry.tip_depth)
    # Pushed at most half as high as it is deep, nothing tips over whose friction on what it stands on is below 1.
    half = float(support(target, axis[None])[0] - axis @ middle)
    high = min(top(target) - _TIP_HOLD, bottom(target) + half) + gripper.geometry.tip_depth
    return (usual, high) if high > usual else (usual,)


def stroke_poses(
    target: DetectedObject, axis: Array, distance: float, hand: tuple[Array, float], height: float
) -> tuple[Pose, Pose]:
    """Return the TCP poses where the stroke of a hand, as `hand_rotations` has it, begins behind an object and ends."""
    middle = centre(target)
    behind = float(support(target, -axis[None])[0] + axis @ middle)
    return _along(middle[:2] - axis[:2] * (behind + hand[1]), axis, distance, hand[0], height)


def inner_stroke_poses(
    robot: RobotSpec, target: DetectedObject, axis: Array, distance: float, hand: tuple[Array, float]
) -> Iterator[tuple[Pose, Pose]]:
    """Yield the TCP poses where the stroke of a hand begins within what holds things, before the wall that it pushes, and ends."""
    room = target.shape.room(target.size, target.opening)
    if robot.gripper is None or room is None or target.pose.rotation[2, 2] < _LEVEL:
        return
    forward = target.pose.rotation.T @ axis
    wall = target.pose.position[:2] + (target.pose.rotation @ np.array([*room.middle, 0.0]))[:2]
    wall += axis[:2] * (room.to_wall(forward) - hand[1])
    height = target.pose.xyz[2] + room.floor + _TIP_CLEARANCE + robot.gripper.geometry.tip_depth
    yield _along(wall, axis, distance, hand[0], height)


def _along(touch: Array, axis: Array, distance: float, rotation: Array, height: float) -> tuple[Pose, Pose]:
    """Return the TCP poses of a stroke that meets its object with the TCP over a point (2,): a stand-off before it, and at its end."""
    begin, finish = touch - axis[:2] * STAND_OFF, touch + axis[:2] * distance
    return (
        Pose.from_matrix(np.array([*begin, height]), rotation),
        Pose.from_matrix(np.array([*finish, height]), rotation),
    )
