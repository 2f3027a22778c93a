"""The motion planner: inverse kinematics, joint moves and straight TCP lines, checked all along and timed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from robosandbox.errors import CollisionError, Phase
from robosandbox.evidence import CollisionEvidence
from robosandbox.motion.collision import CollisionChecker
from robosandbox.motion.line import line_path, unreachable
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.motion.sampling import find_knots
from robosandbox.motion.time_optimal import optimal_trajectory
from robosandbox.motion.timing import bounded_spline, join, time_path
from robosandbox.robots.kinematics import Kinematics
from robosandbox.robots.robot import Robot
from robosandbox.shapes import CONTAINER_WALL
from robosandbox.types import ArmState, Array, DetectedObject, Pose, Speed, Timing, Trajectory

# Turn of the farthest-moving joint from one waypoint of a joint path to the next, rad; chosen as 5 cm at an arm's length.
_JOINT_STEP = 0.06
# How far ways over obstacles are raised, once and twice, metres; chosen as a mug and a hand's clearance.
_VIA_HEIGHT = 0.12
# How often the knots of a sampled way are doubled before it is followed with stops; chosen: eight times the knots.
_SMOOTHINGS = 3
# Samples of a path that is timed optimally, at least; chosen: with half of them motions of six tasks take 4 % longer, with
# twice as many 2 % less.
_SAMPLES = 101
# Seconds over which an optimally timed motion is averaged, against jerk; chosen as five times the 4 ms that keep the jerk limits
# of a Panda, which are 500 times those of acceleration (in its maker's interface documentation). From 0 to 50 ms the bundled arm
# stays as near its path, within 1.2 mm.
_SMOOTHING = 0.02
# Times that a motion is timed anew which is to last longer; chosen: after three it lasts as told within 3 %.
_STRETCHES = 3
# Metres that a way leaves to what it passes, where it can; chosen as what pixels err by (2.2 mm p95) and a fast arm strays from its
# path (1.2 mm), both more than twice: a hand that grazes a bin's wall at full speed shoves it by centimetres.
_ROOM = 0.008
# Metres from one sample to the next at which the TCP counts as standing; chosen as rounding.
_STANDING = 1e-9
# Steps in which fingers' whole range is checked at the least: of a jaw of 8 cm that swings by 90 degrees less than it is thick.
_SWINGS = 16
# What things stand on: one who may touch the table may touch the floor beside it, where things fall to.
_GROUND = frozenset({"table", "floor"})


class DLSMotionPlanner:
    """Plans on MjData of its own; never touches the live world.

    Args:
        n_waypoints: The most waypoints at which a path is solved and checked.
        dt: Seconds between rows of a trajectory.
        clearance: Distance to keep from obstacles, metres.
    """

    def __init__(self, n_waypoints: int = 160, dt: float = 0.005, *, clearance: float = 0.001) -> None:
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

    def use(self, planning: PlanningScene, state: ArmState, *, held: str | None = None) -> None:
        """Take the world to plan in.

        Args:
            planning: The robot, and the objects where they are believed to be; those without a body are not avoided.
            state: How the robot stands now.
            held: Id of the object that moves with the TCP.
        """
        # Scenes that share a model share what was learned of it.
        if self._planning is None or not planning.shares_model(self._planning):
            self._solver = planning.kinematics()
            self._checker = self.checker_of(planning)
        self._planning = planning
        checker = self._collisions
        planning.arrange(checker)
        if state.gripper:
            checker.set_gripper(state.gripper.joint)
        target = planning.seen.find(held) if held else None
        body = planning.body(target.id) if target else None
        if target and body is not None:
            checker.hold(body, state.tcp_pose.inverse() @ target.pose)
        else:
            checker.hold(None)
        checker.allow(())
        checker.stand(state.q)

    def checker_of(self, planning: PlanningScene) -> CollisionChecker:
        """Return a new checker of what the paths of this planner may touch."""
        return planning.collisions(self.clearance)

    def allow(self, *names: str, by_hand: Iterable[str] = (), touched: bool = False) -> None:
        """Let the robot and what it holds touch these bodies, with the parts of them, from now on, and no others.

        "table" is all ground: the floor beside it, too. What is named `by_hand` no link before the hand may touch. With `touched` the
        robot may touch what it touches where it stands as well, no deeper than it does.
        """
        self._collisions.allow(self._bodies(names), self._bodies(by_hand))
        self._collisions.stay_in_touch(touched)

    def move_part(self, name: str, value: float, load: Iterable[DetectedObject] = ()) -> None:
        """Check the plans that follow with a part's joint at a value, metres or radians, and what goes with it where that is then."""
        assert self._planning is not None
        body = self._planning.body(name)
        if body is not None:
            self._collisions.slide(body, value)
        for item in load:
            body = self._planning.body(item.id)
            if body is not None:
                self._collisions.place(body, item.pose)

    def open_to(self, aperture: float) -> None:
        """Check the paths that follow with the fingers `aperture` apart, metres."""
        gripper = self._robot.gripper
        if gripper:
            self._collisions.set_gripper(gripper.geometry.joint_for_aperture(aperture))

    def touch_between(self, q: Array, start: float, end: float) -> CollisionError | None:
        """Return the error that fingers would be which go at `q` (n,) from `start` metres apart to `end`, that included; None for none.

        In steps that no wall fits between: the gap of a jaw that swings far open grows no more, while its tip goes on.
        """
        gripper = self._robot.gripper
        if not gripper:
            return self.touch(q)
        geometry = gripper.geometry
        first, last = geometry.joint_for_aperture(start), geometry.joint_for_aperture(end)
        steps = max(
            1,
            math.ceil(abs(end - start) / (2.0 * CONTAINER_WALL)),
            round(abs(last - first) / np.ptp(geometry.joint_samples) * _SWINGS),
        )
        for joint in np.linspace(first, last, steps + 1)[1:]:
            self._collisions.set_gripper(float(joint))
            met = self.touch(q)
            if met is not None:
                return met
        return None

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
            raise unreachable(solver, self._robot, tcp_pose, solution)
        return solution.q

    def touch(self, q: Array) -> CollisionError | None:
        """Return the error that standing at `q` (n,) would be, or None."""
        return self._collision(q[None, :])

    def plan_joints(self, q_start: Array, q_goal: Array, *, speed: Speed = 0.5) -> Trajectory:
        """Return a trajectory free of collision: straight in joint space, else over raised via poses, else sampled.

        One that passes things with room, where there is one, goes before one that does not.

        Args:
            q_start: Shape (n,).
            q_goal: Shape (n,).
            speed: Share of the robot's limits, or an optimal timing.

        Raises:
            CollisionError: Neither way is free; the evidence is the direct way's.
        """
        path, narrow = self._joint_path(np.array([q_start, q_goal])), None
        error = self._collision(path)
        if error is None:
            narrow = self._timed(path, speed)
            if not self._collisions.is_narrow(path, _ROOM):
                return narrow
        for knots in self._detours(q_start, q_goal):
            trajectory = self._timed(self._joint_path(knots), speed)
            if self._collision(trajectory.q) is None:
                if not self._collisions.is_narrow(trajectory.q, _ROOM):
                    return trajectory
                narrow = narrow or trajectory
        if narrow is not None:
            return narrow
        assert error is not None
        sampled = self._sampled(q_start, q_goal, speed)
        if sampled is None:
            raise error
        return sampled

    def _sampled(self, q_start: Array, q_goal: Array, speed: Speed) -> Trajectory | None:
        """Return a way found by sampling, as smooth as the obstacles allow."""
        robot, checker = self._robot, self._collisions
        # An end that touches cannot be cured by another way.
        if checker.touch(q_start) or checker.touch(q_goal):
            return None
        knots = find_knots(
            lambda q, other: checker.first_touch(np.array([q, other])) is None,
            q_start,
            q_goal,
            robot.lower,
            robot.upper,
        )
        return None if knots is None else self._smoothed(knots, speed)

    def _smoothed(self, knots: Array, speed: Speed) -> Trajectory:
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

    def plan_line(self, q_start: Array, tcp_pose: Pose, *, speed: Speed = 0.5) -> Trajectory:
        """Return a straight TCP line with the orientation turned evenly along it.

        Args:
            q_start: Shape (n,).
            tcp_pose: Where the line ends.
            speed: Share of the robot's limits, or an optimal timing.

        Raises:
            UnreachableError: A point of the line is out of reach, or only with another arm posture.
            CollisionError: Something is in the way.
        """
        path = self._line_path(q_start, tcp_pose)
        error = self._collision(path)
        if error is not None:
            raise error
        return self._timed(path, speed)

    def plan_through(self, q_start: Array, tcp_poses: Sequence[Pose], *, speed: Speed = 0.5) -> Trajectory:
        """Return a trajectory that takes the TCP through poses on straight lines, checked all along.

        It stops at the poses between only where something is so near that there is no room to round them.

        Args:
            q_start: Shape (n,).
            tcp_poses: One or more.
            speed: Share of the robot's limits, or an optimal timing.

        Raises:
            UnreachableError: A point of the way is out of reach, or only with another arm posture.
            CollisionError: Something is in the way.
        """
        lines = [np.array([q_start])]
        for pose in tcp_poses:
            lines.append(self._line_path(lines[-1][-1], pose))
        path = np.concatenate([lines[0], *(line[1:] for line in lines[1:])])
        error = self._collision(path)
        if error is not None:
            raise error
        rounded = self._timed(path, speed)
        if len(tcp_poses) == 1 or self._collision(rounded.q) is None:
            return rounded
        return join([self._timed(line, speed) for line in lines[1:]])

    def _line_path(self, q_start: Array, tcp_pose: Pose) -> Array:
        return line_path(self._kinematics, self._robot, q_start, tcp_pose, most_waypoints=self.n_waypoints)

    def _joint_path(self, knots: Array) -> Array:
        distance = float(np.abs(np.diff(knots, axis=0)).max(axis=1).sum())
        return self._curve(knots, int(np.clip(np.ceil(distance / _JOINT_STEP), 2, self.n_waypoints - 1)) + 1)

    def _curve(self, knots: Array, samples: int) -> Array:
        """Return a smooth curve through knots that leaves the joints' limits no further than they do."""
        return bounded_spline(knots, samples, self._robot.lower, self._robot.upper)

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

    def _timed(self, path: Array, speed: Speed) -> Trajectory:
        robot = self._robot
        if isinstance(speed, Timing):
            return self._optimal(self._curve(path, max(2 * len(path), _SAMPLES)), speed)
        # Differences need a path finer than the waypoints that were checked; the spline runs through all of them.
        fine = self._curve(path, max(2 * len(path), 33)) if len(path) > 2 else path
        return time_path(fine, speed * robot.velocity_limits, speed * robot.acceleration_limits, self.dt)

    def _optimal(self, path: Array, timing: Timing) -> Trajectory:
        """Return the fastest trajectory along a smooth path (k, n)."""
        robot, cap = self._robot, self._cap(path, timing)

        def timed(slower: float) -> Trajectory:
            return optimal_trajectory(
                path,
                slower * timing.share * robot.velocity_limits,
                slower**2 * timing.share * robot.acceleration_limits,
                self.dt,
                cap=None if cap is None else slower * cap,
                smoothing=_SMOOTHING,
            )

        trajectory, slower = timed(1.0), 1.0
        if 0.0 < trajectory.duration < timing.least:
            # A motion that takes k times as long has a k-th of its speeds and a k-th squared of its accelerations, but for its smoothing.
            for _ in range(_STRETCHES):
                slower *= trajectory.duration / timing.least
                trajectory = timed(slower)
        return trajectory

    def _cap(self, path: Array, timing: Timing) -> Array | None:
        """Return the largest path speed, samples/s, shape (k,), at which the TCP is as slow near the ends as it has to be."""
        if not np.isfinite(min(timing.departure, timing.arrival, timing.most)):
            return None
        places = np.array([self._kinematics.forward(q)[0] for q in path])
        steps = np.maximum(np.linalg.norm(np.gradient(places, axis=0), axis=1), _STANDING)
        gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
        left = gone[-1] - gone
        leaving = np.where(gone < timing.near, timing.departure, np.inf)
        arriving = np.where(left < timing.unsure, timing.arrival * np.sqrt(np.maximum(left / timing.near, 1.0)), np.inf)
        cap: Array = np.minimum(np.minimum(leaving, arriving), timing.most) / steps
        return cap

    def _collision(self, path: Array) -> CollisionError | None:
        found = self._collisions.first_touch(path)
        if found is None:
            return None
        index, touch = found
        remedy = "clear the way or approach from elsewhere"
        if touch.own:
            here = "the arm touches itself where it stands; start from another configuration, as another home"
            remedy = here if index == 0 else "the arm would touch itself; approach from elsewhere"
        evidence = CollisionEvidence(
            body=touch.body, other=touch.other, depth=touch.depth, waypoint=index, waypoints=len(path)
        )
        return CollisionError(
            f"{evidence.told()} at waypoint {index + 1} of {len(path)}; {remedy}", phase=Phase.PLAN, evidence=evidence
        )

    def _bodies(self, names: Iterable[str]) -> list[int]:
        wanted = set(names)
        if wanted & _GROUND:
            wanted |= _GROUND
        bodies = enumerate(self._collisions.names)
        return [body for body, name in bodies if name in wanted or name.partition("/")[0] in wanted]

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
