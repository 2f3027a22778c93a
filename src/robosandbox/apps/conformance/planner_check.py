"""The checks that any grasp planner and any motion planner must pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from robosandbox.errors import CollisionError, UnreachableError
from robosandbox.grasp.protocols import GraspPlanner
from robosandbox.motion.protocols import MotionPlanner
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Array, DetectedObject, Grasp, ObservedScene, Pose, Timing, Trajectory
from robosandbox.types.robot import RobotSpec

# Number of grasps of a planner that are looked at; chosen because skills rarely weigh more.
_GRASPS = 20
# Pads may be pressed this far beyond their measured gap, metres: the error of a size that perception has seen.
_WIDTH_SLACK = 0.002
# How far a TCP may lie outside the ball around an object that it holds, metres; chosen as a fingertip's length beyond
# the TCP.
_TCP_SLACK = 0.05
# What counts as at a pose, metres and radians: the accuracy that inverse kinematics is measured to.
_POSITION_TOLERANCE = 1e-3
_ANGLE_TOLERANCE = np.deg2rad(0.5)
# How far a straight line may bend between its waypoints, metres; chosen as the clearance that the planner here keeps
# from obstacles.
_LINE_TOLERANCE = 2e-3
# Factor; chosen because rows of a trajectory are differences of rounded numbers: 2 % beyond a velocity limit is not a
# broken limit.
_SPEED_SLACK = 1.02
# The length of the checked line, metres; chosen so that every bundled arm can go it from home.
_RISE = 0.06
# A place that no arm reaches, metres; chosen beyond any arm's length.
_FAR = np.array([0.0, 0.0, 50.0])
# Below the table's top, metres; chosen so that no part of a hand fits in between.
_BELOW_TABLE = 0.05


def check_grasp_planner(
    planner: GraspPlanner,
    target: DetectedObject,
    scene: ObservedScene,
    robot: RobotSpec,
    *,
    pieces: Sequence[Array] = (),
) -> tuple[Grasp, ...]:
    """Check a grasp planner's promises about an object that the robot's gripper can hold.

    Args:
        planner: The grasp planner.
        target: What to hold.
        scene: Where it stands among others.
        robot: A robot with a gripper.
        pieces: For a mesh: points that span each of its convex pieces, in the object's frame, metres, each (k, 3).

    Returns:
        The first grasps.

    Raises:
        AssertionError: With a sentence that says which promise is broken.
    """
    _demand(robot.gripper is not None, "the robot has no gripper to check with")

    def first(arm: RobotSpec) -> tuple[Grasp, ...]:
        return tuple(islice(planner.candidates(target, scene, arm, pieces=pieces), _GRASPS))

    found = first(robot)
    _demand(bool(found), f"{target.id}: no grasp of an object that the gripper can hold")
    _demand(found == first(robot), f"{target.id}: two answers for the same scene")
    _demand(first(replace(robot, gripper=None)) == (), f"{target.id}: grasps for an arm without a gripper")
    widest = robot.gripper.geometry.max_aperture + _WIDTH_SLACK if robot.gripper else 0.0
    radius = (
        float(np.linalg.norm(target.size))
        if not pieces
        else float(np.linalg.norm(np.concatenate(pieces), axis=1).max())
    )
    for grasp in found:
        _demand(grasp.object == target.id, f"a grasp of {grasp.object!r} where one of {target.id!r} was asked for")
        _demand(bool(grasp.how), f"{target.id}: a grasp without a word for its kind")
        fits = (
            0.0 < grasp.width <= widest if robot.gripper and robot.gripper.geometry.cup is None else grasp.width == 0.0
        )
        _demand(fits, f"{target.id}: width {grasp.width:g} m; the gripper opens {widest:g} m")
        away = float(np.linalg.norm(grasp.tcp_pose.position - target.pose.position))
        _demand(away <= radius + _TCP_SLACK, f"{target.id}: the TCP closes {away:g} m from the object's centre")
    return found


def check_motion_planner(planner: MotionPlanner, ctx: SkillContext) -> None:
    """Check a motion planner's promises in a loaded world with free space above the robot's home.

    Args:
        planner: The motion planner.
        ctx: A loaded world, its arm at home.

    Raises:
        AssertionError: With a sentence that says which promise is broken.
    """
    arm, scene = ctx.arm, ctx.look()
    before = arm.state()
    planner.use(ctx.planning(scene), before)
    home = before.q
    tcp = planner.forward(home)
    _demand(_same(tcp, before.tcp_pose), "forward() does not give the TCP pose that the world shows")
    goal = Pose.from_matrix(tcp.position + np.array([0.0, 0.0, _RISE]), tcp.rotation)
    _check_kinematics(planner, arm.spec, home, goal)
    _demand(planner.touch(home) is None, "touch() finds a collision where the arm stands free")
    q_goal = planner.ik(goal, home)
    _check_trajectory(planner.plan_joints(home, q_goal), arm.spec, home, q_goal)
    line = planner.plan_line(home, goal)
    _check_trajectory(line, arm.spec, home, None)
    quick = planner.plan_line(home, goal, speed=Timing(share=1.0))
    _check_trajectory(quick, arm.spec, home, None)
    _demand(
        quick.duration <= line.duration, "plan_line() takes longer when it is to be timed optimally at the full limits"
    )
    points = np.array([planner.forward(q).position for q in line.q])
    _demand(bool(np.abs(points[:, :2] - tcp.position[:2]).max() <= _LINE_TOLERANCE), "plan_line() is not straight")
    _demand(_same(planner.forward(line.q[-1]), goal), "plan_line() does not end at its goal")
    through = planner.plan_through(home, [goal, tcp])
    _check_trajectory(through, arm.spec, home, None)
    _demand(_same(planner.forward(through.q[-1]), tcp), "plan_through() does not end at its last pose")
    _check_table(planner, scene, home, tcp)
    after = arm.state()
    _demand(after.time == before.time and bool((after.q == before.q).all()), "planning moved the world")


def _check_kinematics(planner: MotionPlanner, robot: RobotSpec, home: Array, goal: Pose) -> None:
    q = planner.ik(goal, home)
    _demand(_same(planner.forward(q), goal), "ik() does not put the TCP at the pose")
    _demand(bool(((q >= robot.lower) & (q <= robot.upper)).all()), "ik() passes the joint limits")
    try:
        planner.ik(Pose.from_matrix(_FAR, goal.rotation), home, restarts=1)
    except UnreachableError:
        return
    raise AssertionError(f"ik() has an answer for {_FAR} m, which is out of reach")


def _check_table(planner: MotionPlanner, scene: ObservedScene, home: Array, tcp: Pose) -> None:
    """Demand that a line through the table's top is refused, by whatever stands above it or by the table itself."""
    below = np.array([*tcp.position[:2], scene.table_height - _BELOW_TABLE])
    try:
        planner.plan_line(home, Pose.from_matrix(below, tcp.rotation))
    except (CollisionError, UnreachableError):
        return
    raise AssertionError("plan_line() goes through the table")


def _check_trajectory(trajectory: Trajectory, robot: RobotSpec, start: Array, goal: Array | None) -> None:
    q = trajectory.q
    _demand(trajectory.dt > 0.0 and len(q) >= 2, "a trajectory needs two rows and time between them")
    _demand(not q.flags.writeable, "a trajectory's rows can be written to")
    _demand(bool(np.allclose(q[0], start, atol=1e-6)), "a trajectory does not begin where it was to")
    _demand(goal is None or bool(np.allclose(q[-1], goal, atol=1e-6)), "a trajectory does not end where it was to")
    _demand(bool(((q >= robot.lower - 1e-9) & (q <= robot.upper + 1e-9)).all()), "a trajectory passes joint limits")
    speed = np.abs(np.diff(q, axis=0)).max(axis=0) / trajectory.dt
    _demand(
        bool((speed <= _SPEED_SLACK * robot.velocity_limits).all()), "a trajectory is faster than the joints may be"
    )


def _same(pose: Pose, other: Pose) -> bool:
    cosine = 0.5 * (float(np.trace(pose.rotation.T @ other.rotation)) - 1.0)
    near = float(np.linalg.norm(pose.position - other.position)) <= _POSITION_TOLERANCE
    return near and float(np.arccos(np.clip(cosine, -1.0, 1.0))) <= _ANGLE_TOLERANCE


def _demand(holds: bool, otherwise: str) -> None:
    if not holds:
        raise AssertionError(otherwise)
