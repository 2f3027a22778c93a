"""Straight lines of the TCP: inverse kinematics followed from waypoint to waypoint, and why one is out of reach."""

from __future__ import annotations

import numpy as np

from robosandbox.errors import Phase, UnreachableError
from robosandbox.evidence import UnreachableEvidence
from robosandbox.robots.kinematics import Kinematics, Solution
from robosandbox.robots.robot import Robot
from robosandbox.types import Array, Pose, matrix_about_axis

# Way of the TCP from one waypoint of a line to the next, metres; chosen as a quarter of the smallest thing on the table.
_LINE_STEP = 0.01
# Way of the TCP that one radian of turn along a line counts as, metres; chosen as the length of a hand.
_HAND = 0.2
# Largest turn of a joint from one waypoint of a line to the next, rad, above which the step is halved, and the share of a
# step below which it is another posture; chosen as three times what a step turns a joint 10 cm away.
_LINE_JUMP, _FINEST = 0.35, 0.1
# Distance from a joint's limit at which it is told to be there, rad or m; chosen: far less than anybody sees, far more than rounding.
_AT_LIMIT = 1e-3


def line_path(solver: Kinematics, robot: Robot, q_start: Array, tcp_pose: Pose, *, most_waypoints: int) -> Array:
    """Return configurations (k, n) along a straight line of the TCP, its orientation turned evenly along it.

    Args:
        solver: The robot's kinematics.
        robot: For messages.
        q_start: Shape (n,).
        tcp_pose: Where the line ends.
        most_waypoints: How many there are at most where no singularity asks for more.

    Raises:
        UnreachableError: A point of the line is out of reach, or only with another arm posture.
    """
    position, rotation = solver.forward(q_start)
    goal_position, goal_rotation = tcp_pose.position, tcp_pose.rotation
    axis, angle = _axis_angle(rotation.T @ goal_rotation)
    length = max(float(np.linalg.norm(goal_position - position)), _HAND * angle)
    stride = 1.0 / int(np.clip(np.ceil(length / _LINE_STEP), 2, most_waypoints - 1))
    path, step, done, before = [q_start], stride, 0.0, 0.0
    while done < 1.0:
        ahead = done + step if done + step < 1.0 - 1e-9 else 1.0
        waypoint = position + ahead * (goal_position - position)
        turned = rotation @ matrix_about_axis(axis, ahead * angle) if angle > 1e-6 else goal_rotation
        # Going on as before is the best guess for the next waypoint; near a singularity staying is.
        guesses = [path[-1]]
        if len(path) > 1:
            guesses.insert(0, path[-1] + (ahead - done) / (done - before) * (path[-1] - path[-2]))
        first, *others = guesses
        solution = solver.descend(waypoint, turned, first)
        for guess in others:
            if solution.solved and np.abs(solution.q - path[-1]).max() <= _LINE_JUMP:
                break
            solution = solver.descend(waypoint, turned, guess)
        if not solution.solved:
            raise unreachable(solver, robot, Pose.from_matrix(waypoint, turned), solution)
        jump = np.abs(solution.q - path[-1])
        if jump.max() > _LINE_JUMP:
            # Near a singularity joints turn far in little way; in a jump to another posture no step is small enough.
            if step < _FINEST * stride:
                raise _in_another_posture(solver, robot, Pose.from_matrix(waypoint, turned), solution, jump)
            step *= 0.5
            continue
        path.append(solution.q)
        before, done, step = done, ahead, min(stride, 2.0 * step)
    return np.array(path)


def unreachable(solver: Kinematics, robot: Robot, target: Pose, best: Solution) -> UnreachableError:
    """Return the error of a TCP pose that is not reached, with how near the best solution comes."""
    stuck = (best.q <= robot.lower + _AT_LIMIT) | (best.q >= robot.upper - _AT_LIMIT)
    joints = tuple(name for name, at_limit in zip(robot.joints, stuck, strict=True) if at_limit)
    nearest = Pose.from_matrix(*solver.forward(best.q))
    x, y, z = target.xyz
    limits = f"; at their limits: {', '.join(joints)}" if joints else ""
    return UnreachableError(
        f"TCP target ({x:.3f}, {y:.3f}, {z:.3f}) is out of reach: the nearest pose found misses it by "
        f"{best.position_error * 1000:.1f} mm and {np.degrees(best.orientation_error):.1f} deg{limits}; "
        "move the target or the base closer",
        phase=Phase.PLAN,
        evidence=UnreachableEvidence(
            target=target,
            position_error=best.position_error,
            orientation_error=best.orientation_error,
            joints_at_limits=joints,
            nearest=nearest,
        ),
    )


def _in_another_posture(
    solver: Kinematics, robot: Robot, target: Pose, found: Solution, jump: Array
) -> UnreachableError:
    x, y, z = target.xyz
    joint = int(jump.argmax())
    return unreachable(solver, robot, target, found).with_(
        message=f"the straight way is reached at ({x:.3f}, {y:.3f}, {z:.3f}) in another posture of the arm only: "
        f"{robot.joints[joint]} would jump by {np.degrees(jump[joint]):.0f} deg; come from elsewhere"
    )


def _axis_angle(rotation: Array) -> tuple[Array, float]:
    """Return the unit axis (3,) and angle in 0..pi of a rotation matrix (3, 3)."""
    angle = float(np.arccos(np.clip((np.trace(rotation) - 1.0) / 2.0, -1.0, 1.0)))
    if angle < 1e-6:
        return np.array([0.0, 0.0, 1.0]), 0.0
    if angle > np.pi - 1e-4:
        symmetric = (rotation + np.eye(3)) / 2.0
        column = int(np.diag(symmetric).argmax())
        return symmetric[:, column] / np.linalg.norm(symmetric[:, column]), angle
    skew = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    return skew / (2.0 * np.sin(angle)), angle
