"""The strokes of a push: how the hand is turned, how high it goes, and where its way begins and ends."""

from __future__ import annotations

import itertools

import numpy as np

from robosandbox.errors import CollisionError, Phase, SkillError, UnreachableError
from robosandbox.skills.primitives.manipulator import HOVER_HEIGHT, Manipulator, most_telling, raised
from robosandbox.types import Array, DetectedObject, ObservedScene, Pose, Trajectory
from robosandbox.types.robot import RobotSpec
from robosandbox.values import frozen
from robosandbox.world.relations import bottom, centre, support, top

# Metres between fingers and object before a stroke; chosen as ten times perception's error (halved 2 % shorter
# episodes, doubled 10 % longer).
STAND_OFF = 0.012
# Metres between fingertips and table; chosen as four times the planner's clearance.
_TIP_CLEARANCE = 0.004
# How much of an object's height a fingertip has before it at least that pushes it high, metres; chosen as half a pad of
# small grippers.
_TIP_HOLD = 0.012
# Share of the joints' speed limits; chosen so that what is pushed stays at the fingers (halved 11 % longer episodes,
# doubled 12 % shorter, all succeed).
_PUSH_SPEED = 0.12


@frozen
class Stroke:
    """The ways of a push: to over where it begins, down to there, and along."""

    approach: Trajectory
    descent: Trajectory
    push: Trajectory


def plan_stroke(
    arm: Manipulator, target: DetectedObject, scene: ObservedScene, axis: Array, distance: float, missed: int = 0
) -> Stroke:
    """Return the first free ways on which the closed hand gets behind an object, along, and up from there.

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
    if robot.gripper is not None:
        arm.motion.open_to(robot.gripper.geometry.min_aperture)
    options = hand_rotations(robot, axis, arm.state.tcp_pose.rotation)
    turned = 2 * missed % len(options)
    hands = (*options[turned:], *options[:turned])
    ways = itertools.product(stroke_heights(robot, target, axis, scene.table_height), hands)
    for height, (rotation, half_depth) in ways:
        start, end = stroke_poses(target, axis, distance, rotation, half_depth, height)
        try:
            arm.motion.allow()
            descent = arm.line_to(start, raised(start, HOVER_HEIGHT), speed=arm.tempo.near)
            approach = arm.motion.plan_joints(arm.q, descent.q[0], speed=arm.tempo.free)
            arm.motion.allow(target.id)
            push = arm.motion.plan_line(descent.q[-1], end, speed=_PUSH_SPEED)
            arm.motion.plan_line(push.q[-1], raised(end, HOVER_HEIGHT))
            return Stroke(approach, descent, push)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
    raise most_telling(failures)


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
            squarely = abs(float(closing @ axis)) > 0.5
            depth = gripper.geometry.finger_thickness if squarely else gripper.geometry.finger_width / 2.0
        options.append((rotation, depth))
    # The wide side first; of two opposite hands the one that turns less.
    return sorted(
        options, key=lambda option: (abs(float(option[0][:, 1] @ axis)) > 0.5, -float(np.trace(hand.T @ option[0])))
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
    target: DetectedObject, axis: Array, distance: float, rotation: Array, half_depth: float, height: float
) -> tuple[Pose, Pose]:
    """Return the TCP poses where the stroke begins and ends."""
    middle = centre(target)
    behind = float(support(target, -axis[None])[0] + axis @ middle)
    begin = middle - axis * (behind + half_depth + STAND_OFF)
    finish = middle - axis * (behind + half_depth) + axis * distance
    return (
        Pose.from_matrix(np.array([begin[0], begin[1], height]), rotation),
        Pose.from_matrix(np.array([finish[0], finish[1], height]), rotation),
    )
