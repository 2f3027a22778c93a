"""The motion planner: inverse kinematics, joint moves and straight TCP lines, checked all along and timed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robosandbox.errors import CollisionError, Phase, UnreachableError
from robosandbox.evidence import CollisionEvidence, UnreachableEvidence
from robosandbox.motion.collision import CollisionChecker
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.motion.sampling import find_knots
from robosandbox.motion.timing import join, spline, time_path
from robosandbox.robots.kinematics import Kinematics, Solution
from robosandbox.robots.robot import Robot
from robosandbox.types import Array, Observation, Pose, Trajectory, matrix_about_axis

# Way of the TCP from one waypoint of a line to the next, metres; chosen as a quarter of the smallest thing on the table.
_LINE_STEP = 0.01
# Way of the TCP that one radian of turn along a line counts as, metres; chosen as the length of a hand.
_HAND = 0.2
# Turn of the farthest-moving joint from one waypoint of a joint path to the next, rad; chosen as 5 cm at an arm's length.
_JOINT_STEP = 0.06
# Largest turn of a joint from one waypoint of a line to the next, rad, above which the step is halved, and the share of a
# step below which it is another posture; chosen as three times what a step turns a joint 10 cm away.
_LINE_JUMP, _FINEST = 0.35, 0.1
# Distance from a joint's limit at which it is told to be there, rad or m; chosen: far less than anybody sees, far more than rounding.
_AT_LIMIT = 1e-3
# How far ways over obstacles are raised, once and twice, metres; chosen as a mug and a hand's clearance.
_VIA_HEIGHT = 0.12
# How often the knots of a sampled way are doubled before it is followed with stops; chosen: eight times the knots.
_SMOOTHINGS = 3
# Distances between examined configurations of a sampled way, rad, first and where that was too coarse; tried with
# benchmarks/planning.py.
_RESOLUTIONS = (0.02, 0.005)
# What things stand on: one who may touch the table may touch the floor beside it, where things fall to.
_GROUND = frozenset({"table", "floor"})


class DLSMotionPlanner:
    """Plans on MjData of its own; never touches the live world.

    Args:
        n_waypoints: The most waypoints at which a path is solved and checked.
        dt: Seconds between rows of a trajectory.
        clearance: Distance to keep from obstacles, metres.
    """

    def __init__(self, n_waypoints: int = 160, dt: float = 0.005, *, clearance: float = 0.002) -> None:
        if n_waypoints < 2 or dt <= 0.0:
            raise ValueError(
                f"n_waypoints={n_waypoints}, dt={dt}: a path takes two waypoints or more and a positive step"
            )
        self.n_waypoints = n_waypoints
        self.dt = dt
        self.clearance = clearance
        self._planning: PlanningScene | None = None
        self._solver: Kinematics | None = None
        self._checker: CollisionChecker | None = None

    def use(self, planning: PlanningScene, state: Observation, *, held: str | None = None) -> None:
        """Take the world to plan in.

        Args:
            planning: The robot, and the objects where they are believed to be; those without a body are not avoided.
            state: How the robot stands now.
            held: Id of the object that moves with the TCP.
        """
        # Scenes that share a model share what was learned of it.
        if self._planning is None or not planning.shares_model(self._planning):
            self._solver = planning.kinematics()
            self._checker = planning.collisions(self.clearance)
        self._planning = planning
        checker = self._collisions
        for item in planning.seen.objects:
            body = planning.body(item.id)
            if body is not None:
                checker.place(body, item.pose)
                if item.opening is not None:
                    checker.slide(body, item.opening)
        if state.gripper:
            checker.set_gripper(state.gripper.joint)
        target = planning.seen.find(held) if held else None
        body = planning.body(target.id) if target else None
        if target and body is not None:
            checker.hold(body, state.tcp_pose.inverse() @ target.pose)
        else:
            checker.hold(None)
        checker.allow(())

    def allow(self, *names: str) -> None:
        """Let the robot and what it holds touch these bodies, with the parts of them, from now on, and no others.

        "table" is all ground: the floor beside it, too.
        """
        wanted = set(names)
        if wanted & _GROUND:
            wanted |= _GROUND
        bodies = enumerate(self._collisions.names)
        self._collisions.allow(b for b, name in bodies if name in wanted or name.partition("/")[0] in wanted)

    def open_to(self, aperture: float) -> None:
        """Check the paths that follow with the fingers `aperture` apart, metres."""
        gripper = self._robot.gripper
        if gripper:
            self._collisions.set_gripper(gripper.geometry.joint_for_aperture(aperture))

    def forward(self, q: Array) -> Pose:
        """Return the TCP pose in the world at `q` (n,)."""
        return Pose.from_matrix(*self._kinematics.forward(q))

    def ik(self, tcp_pose: Pose, seed: Array | None = None, *, restarts: int = 60) -> Array:
        """Return a configuration (n,) that puts the TCP at `tcp_pose`, near `seed` where it can.

        Raises:
            UnreachableError: None was found; the evidence says how close one comes.
        """
        solver = self._kinematics
        start = self._robot.home_q if seed is None else seed
        solution = solver.solve(tcp_pose.position, tcp_pose.rotation, start, restarts=restarts)
        if not solution.solved:
            raise self._unreachable(tcp_pose, solution)
        return solution.q

    def touch(self, q: Array) -> CollisionError | None:
        """Return the error that standing at `q` (n,) would be, or None."""
        return self._collision(q[None, :])

    def plan_joints(self, q_start: Array, q_goal: Array, *, speed: float = 0.5) -> Trajectory:
        """Return a trajectory free of collision: straight in joint space, else over raised via poses, else sampled.

        Args:
            q_start: Shape (n,).
            q_goal: Shape (n,).
            speed: Fraction of the robot's velocity limits.

        Raises:
            CollisionError: Neither way is free; the evidence is the direct way's.
        """
        path = self._joint_path(np.array([q_start, q_goal]))
        error = self._collision(path)
        if error is None:
            return self._timed(path, speed)
        for knots in self._detours(q_start, q_goal):
            trajectory = self._timed(self._joint_path(knots), speed)
            if self._collision(trajectory.q) is None:
                return trajectory
        sampled = self._sampled(q_start, q_goal, speed)
        if sampled is None:
            raise error
        return sampled

    def _sampled(self, q_start: Array, q_goal: Array, speed: float) -> Trajectory | None:
        """Return a way found by sampling, as smooth as the obstacles allow."""
        robot, checker = self._robot, self._collisions
        # An end that touches cannot be cured by another way.
        if checker.touch(q_start) or checker.touch(q_goal):
            return None
        for resolution in _RESOLUTIONS:
            knots = find_knots(
                lambda q: checker.touch(q) is None, q_start, q_goal, robot.lower, robot.upper, resolution=resolution
            )
            if knots is None:
                return None
            if self._collision(knots) is None:
                return self._smoothed(knots, speed)
        return None

    def _smoothed(self, knots: Array, speed: float) -> Trajectory:
        """Return a trajectory along a free polyline, round at the corners where there is room."""
        for _ in range(_SMOOTHINGS):
            trajectory = self._timed(self._joint_path(knots), speed)
            if self._collision(trajectory.q) is None:
                return trajectory
            # With more knots the curve keeps closer to the free polyline.
            middles = 0.5 * (knots[1:] + knots[:-1])
            knots = np.insert(knots, range(1, len(knots)), middles, axis=0)
        knot_pairs = np.stack([knots[:-1], knots[1:]], axis=1)
        return join([self._timed(self._joint_path(pair), speed) for pair in knot_pairs])

    def plan_line(self, q_start: Array, tcp_pose: Pose, *, speed: float = 0.5) -> Trajectory:
        """Return a straight TCP line with the orientation turned evenly along it.

        Args:
            q_start: Shape (n,).
            tcp_pose: Where the line ends.
            speed: Fraction of the robot's velocity limits.

        Raises:
            UnreachableError: A point of the line is out of reach, or only with another arm posture.
            CollisionError: Something is in the way.
        """
        path = self._line_path(q_start, tcp_pose)
        error = self._collision(path)
        if error is not None:
            raise error
        return self._timed(path, speed)

    def plan_through(self, q_start: Array, tcp_poses: Sequence[Pose], *, speed: float = 0.5) -> Trajectory:
        """Return a trajectory that takes the TCP through poses on straight lines, without a stop, checked all along.

        Args:
            q_start: Shape (n,).
            tcp_poses: One or more.
            speed: Fraction of the robot's velocity limits.

        Raises:
            UnreachableError: A point of the way is out of reach, or only with another arm posture.
            CollisionError: Something is in the way.
        """
        parts = [np.array([q_start])]
        for pose in tcp_poses:
            parts.append(self._line_path(parts[-1][-1], pose)[1:])
        path = np.concatenate(parts)
        error = self._collision(path)
        if error is not None:
            raise error
        return self._timed(path, speed)

    def _line_path(self, q_start: Array, tcp_pose: Pose) -> Array:
        solver = self._kinematics
        position, rotation = solver.forward(q_start)
        goal_position, goal_rotation = tcp_pose.position, tcp_pose.rotation
        axis, angle = _axis_angle(rotation.T @ goal_rotation)
        length = max(float(np.linalg.norm(goal_position - position)), _HAND * angle)
        stride = 1.0 / int(np.clip(np.ceil(length / _LINE_STEP), 2, self.n_waypoints - 1))
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
                raise self._unreachable(Pose.from_matrix(waypoint, turned), solution)
            jump = np.abs(solution.q - path[-1])
            if jump.max() > _LINE_JUMP:
                # Near a singularity joints turn far in little way; in a jump to another posture no step is small enough.
                if step < _FINEST * stride:
                    raise self._in_another_posture(Pose.from_matrix(waypoint, turned), solution, jump)
                step *= 0.5
                continue
            path.append(solution.q)
            before, done, step = done, ahead, min(stride, 2.0 * step)
        return np.array(path)

    def _joint_path(self, knots: Array) -> Array:
        distance = float(np.abs(np.diff(knots, axis=0)).max(axis=1).sum())
        return spline(knots, int(np.clip(np.ceil(distance / _JOINT_STEP), 2, self.n_waypoints - 1)) + 1)

    def _detours(self, q_start: Array, q_goal: Array) -> list[Array]:
        """Return knots of ways over the obstacles: up, across, down; and by way of home."""
        ways = []
        raised = []
        for q in (q_start, q_goal):
            position, rotation = self._kinematics.forward(q)
            for height in (_VIA_HEIGHT, 2.0 * _VIA_HEIGHT):
                solution = self._kinematics.descend(position + [0.0, 0.0, height], rotation, q)
                if solution.solved:
                    raised.append((height, solution.q))
        for height in (_VIA_HEIGHT, 2.0 * _VIA_HEIGHT):
            vias = [q for h, q in raised if h == height]
            if len(vias) == 2:
                ways.append(np.array([q_start, *vias, q_goal]))
        ways.append(np.array([q_start, self._robot.home_q, q_goal]))
        return ways

    def _timed(self, path: Array, speed: float) -> Trajectory:
        robot = self._robot
        # np.gradient needs a path finer than the waypoints that were checked; the spline runs through all of them.
        fine = spline(path, max(2 * len(path), 33)) if len(path) > 2 else path
        return time_path(fine, speed * robot.velocity_limits, speed * robot.acceleration_limits, self.dt)

    def _collision(self, path: Array) -> CollisionError | None:
        found = self._collisions.first_touch(path)
        if found is None:
            return None
        index, touch = found
        remedy = "clear the way or approach from elsewhere"
        if touch.own:
            here = "the arm touches itself where it stands; start from another configuration, as another home"
            remedy = here if index == 0 else "the arm would touch itself; approach from elsewhere"
        return CollisionError(
            f"{touch.body} would touch {touch.other} ({touch.depth * 1000:.1f} mm deep) at waypoint {index + 1} of "
            f"{len(path)}; {remedy}",
            phase=Phase.PLAN,
            evidence=CollisionEvidence(
                body=touch.body, other=touch.other, depth=touch.depth, waypoint=index, waypoints=len(path)
            ),
        )

    def _in_another_posture(self, target: Pose, found: Solution, jump: Array) -> UnreachableError:
        x, y, z = target.xyz
        joint = int(jump.argmax())
        error = self._unreachable(target, found)
        error.message = (
            f"the straight way is reached at ({x:.3f}, {y:.3f}, {z:.3f}) in another posture of the arm only: "
            f"{self._robot.joints[joint]} would jump by {np.degrees(jump[joint]):.0f} deg; come from elsewhere"
        )
        return error

    def _unreachable(self, target: Pose, best: Solution) -> UnreachableError:
        robot = self._robot
        stuck = (best.q <= robot.lower + _AT_LIMIT) | (best.q >= robot.upper - _AT_LIMIT)
        joints = tuple(name for name, at_limit in zip(robot.joints, stuck, strict=True) if at_limit)
        nearest = self.forward(best.q)
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

    @property
    def _kinematics(self) -> Kinematics:
        if self._solver is None:
            raise RuntimeError("the motion planner has no world yet; call use(sim, scene) first")
        return self._solver

    @property
    def _robot(self) -> Robot:
        return self._collisions.robot

    @property
    def _collisions(self) -> CollisionChecker:
        if self._checker is None:
            raise RuntimeError("the motion planner has no world yet; call use(sim, scene) first")
        return self._checker


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
