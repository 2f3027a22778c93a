"""From actions in -1..1 to commanded joints and gripper."""

from __future__ import annotations

from typing import Literal

import numpy as np

from robosandbox.driver import Driver
from robosandbox.driver.clamps import TOLERANCES, braking_rows
from robosandbox.driver.joint_steps import JointSteps
from robosandbox.errors import InputError, SkillError
from robosandbox.robots.kinematics import Kinematics
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import Array, Trajectory, matrix_from_rotation_vector
from robosandbox.types.robot import RobotSpec

ActionKind = Literal["ee", "joint"]
# What an end-effector action of 1 asks for within a second, metres; chosen as the fastest that the skills were measured
# to move the TCP of the bundled arm at while they lift (0.42 m/s).
_METRES_PER_SECOND = 0.4
_RADIANS_PER_SECOND = 2.0
# How far the target may run ahead of an arm that is held up, metres; chosen as one and a half actions of 50 ms: an arm
# that is let loose does not leap.
_LEAD_METRES = 0.03
_FULL_TURN = np.pi
# Metres that an arm keeps off what does not give way, and seconds of its way that it keeps off beside: what servos trail by is another
# way for each joint. Nearer it goes no faster than so many m/s, and no deeper than so many metres: servos of 18 N/mm, as the bundled
# arm's are, then press with half of what tasks allow.
_CLEAR, _TRAILING, _FEELING, _DEEPEST = 0.003, 0.01, 0.01, 0.001
# m/s at which it may come upon what gives way: the reduced speed of ISO 10218-1.
_SHOVING = 0.25
# Metres that no point of an arm goes farther between two places at which is looked.
_APART = 0.02
# Share of what its motors can give with which a gripper opens, or closes onto what stands there: that is not pressed on then. And
# places on the fingers' way at which is looked for it.
_OPENING, _LOOKS = 0.25, 4
# Actions whose ticks are counted: of a rate that does not divide that of control they differ by one.
_COUNTED = 101
# Shares of what is asked for that are tried before it brakes.
_SHARES = (1.0, 0.5, 0.25, 0.1)


class Controller:
    """Carries out actions of one arm, one control period each, within its joints' limits of speed and acceleration.

    Other arms hold where they are.

    Args:
        driver: Of the robot.
        world: Its model.
        kind: `ee`: translation and rotation of the TCP, world axes, and the gripper; `joint`: where each joint is to be
            between its limits, and the gripper. The gripper, -1 open and 1 closed, comes last; an arm without one has no
            such number.
        rate: Actions a second: where the control rate is no multiple of it, they take one control tick more or less than others.
        arm: The arm's name.

    Raises:
        InputError: The rate is not above 0, or beyond that of control.
    """

    def __init__(self, driver: Driver, world: MuJoCoBackend, kind: ActionKind, rate: float, arm: str) -> None:
        most = 1.0 / driver.control_timestep
        if not 0.0 < rate <= most:
            raise InputError(f"control_hz: {rate:g} actions a second; give more than 0, to {most:g}, the control rate")
        self._tick = driver.control_timestep
        self._ticks_of_one = most / rate
        lasts = [self._tick * ticks for number in range(1, _COUNTED) for ticks in self._pieces(number)]
        self._actions = 0
        self._arm = driver.arms[arm]
        self._hands = [hand for hand in driver.hands.values() if hand.arm == arm]
        self._world = world
        self._kind = kind
        self._period = 0.0
        robot = self._arm.spec
        self._solver = Kinematics.of(world.model, world.robots[arm])
        self._ahead = world.lookahead(arm)
        self._low = np.where(np.isfinite(robot.lower), robot.lower, -_FULL_TURN)
        self._high = np.where(np.isfinite(robot.upper), robot.upper, _FULL_TURN)
        self._steps = JointSteps(robot, lasts)
        self._closed, self._opens = 0.0, False
        gripper = robot.gripper
        limited = gripper is not None and driver.capabilities.grip_limit
        self._strength = float(gripper.force_limits.sum()) if gripper is not None and limited else np.inf
        self._position: Array = np.zeros(3)
        self._rotation: Array = np.eye(3)
        self.reset()

    @property
    def size(self) -> int:
        """The number of an action's components."""
        return (6 if self._kind == "ee" else self._arm.spec.n) + len(self._hands)

    @property
    def spec(self) -> RobotSpec:
        """Specification of the robot."""
        return self._arm.spec

    @property
    def period(self) -> float:
        """Seconds of an action."""
        return self._ticks_of_one * self._tick

    @property
    def commanded(self) -> tuple[Array, float]:
        """Configuration (n,) that the arm was sent to last, and how far its gripper is to be closed, 0 to 1; 0 without one."""
        return self._steps.q.copy(), self._closed

    def reset(self) -> None:
        """Begin where the arm stands."""
        if self._solver.model is not self._world.model:
            # A layout with other things in it is another model.
            self._solver = Kinematics.of(self._world.model, self._world.robots[self._arm.name])
        self._ahead = self._world.lookahead(self._arm.name)
        self._actions = 0
        self._begin_here()

    def _begin_here(self) -> None:
        """Take where the arm stands for where it was sent."""
        self._steps.begin(self._arm.state().q)
        self._closed = min(max(self._hands[0].state().closed, 0.0), 1.0) if self._hands else 0.0
        self._position, self._rotation = self._solver.forward(self._steps.q)

    def apply(self, action: Array) -> None:
        """Let the period of one action pass with it, shape (size,), each component in -1..1.

        Raises:
            InputError: It has another shape, or numbers that are not finite; nothing has moved.
            SkillError: A limit of the robot or task was passed; the arm holds.
        """
        robot = self._arm.spec
        given = np.asarray(action, dtype=float)
        if given.shape != (self.size,):
            raise InputError(f"action: has shape {given.shape}; {self._kind} actions have shape ({self.size},)")
        if not np.isfinite(given).all():
            raise InputError(f"action: {given.tolist()} holds a number that is not finite; give numbers in -1..1")
        action = np.clip(given, -1.0, 1.0)
        self._actions += 1
        pieces = self._pieces(self._actions)
        self._period = sum(pieces) * self._tick
        self._move_fingers(action)
        goal = self._moved(action) if self._kind == "ee" else self._low + 0.5 * (action[: robot.n] + 1.0) * self._span
        left = self._period
        try:
            for ticks in pieces:
                lasts = ticks * self._tick
                wanted, change = self._steps.wanted(goal, lasts, left)
                left -= lasts
                way = self._steps.go(self._kept_out(wanted, change, lasts), lasts)
                self._arm.follow(Trajectory(q=way, dt=lasts, goes_on=True))
        except SkillError:
            self._begin_here()
            raise

    def _move_fingers(self, action: Array) -> None:
        """Send the fingers to where an action has them: as hard as they can where they close, and lightly where they may meet something."""
        for hand in self._hands:
            before, self._closed = self._closed, 0.5 * (float(action[-1]) + 1.0)
            if self._closed != before:
                self._opens = self._closed < before
            may_meet = np.isfinite(self._strength) and (self._opens or self._comes_nearer(hand.state().closed))
            hand.set_gripper(self._closed, _OPENING * self._strength if may_meet else None)

    def _comes_nearer(self, closed: float) -> bool:
        """Tell whether a finger comes up to what does not give way on its way from where it is closed to, as those of a leaning hand do."""
        now = self._ahead.distances(self._steps.q).bare
        way = np.linspace(np.clip(closed, 0.0, 1.0), self._closed, _LOOKS + 1)[1:]
        nearest = min(self._ahead.distances(self._steps.q, float(at)).bare for at in way)
        return nearest < min(_CLEAR, now - _DEEPEST)

    def _pieces(self, number: int) -> list[int]:
        """Return the control ticks for which joints keep one speed in an action, counted from 1: no more than the clamps look at."""
        ticks = round(number * self._ticks_of_one) - round((number - 1) * self._ticks_of_one)
        steps = -(-ticks // max(1, round(TOLERANCES.window / self._tick)))
        return [ticks * (k + 1) // steps - ticks * k // steps for k in range(steps)]

    def _kept_out(self, wanted: Array, change: Array, period: float) -> Array:
        """Return the speed (n,) for some seconds, as near to what is wanted as the arm can still come to rest from before it presses.

        Args:
            wanted: Speed of each joint, shape (n,).
            change: By how much it may change, likewise.
            period: Seconds.
        """
        robot, least, most = self._arm.spec, self._steps.velocity - change, self._steps.velocity + change
        fastest = robot.reach[1] * float(np.abs(wanted).sum())
        feeling = min(1.0, _FEELING / fastest) if fastest > 0.0 else 0.0
        now = self._ahead.distances(self._steps.q)
        # What is no nearer than it is now but for a little is as near.
        others, own = (max(off - 0.5 * _FEELING * period, min(off, -_DEEPEST)) for off in (now.others, now.own))
        for share in (*_SHARES, feeling):
            velocity = np.clip(share * wanted, least, most)
            speed = robot.reach[1] * float(np.abs(velocity).max())
            slowly = robot.reach[1] * float(np.abs(velocity).sum()) <= 1.01 * _FEELING
            off = -_DEEPEST if slowly else _CLEAR + _TRAILING * speed
            found = [self._ahead.distances(row) for row in self._until_rest(velocity, period)]
            if any(one.others < min(off, others) or one.own < min(0.0, own) for one in found):
                continue
            if speed <= _SHOVING or not any(one.comes_upon for one in found):
                return velocity
        return np.clip(np.zeros(robot.n), least, most)

    def _until_rest(self, velocity: Array, period: float) -> Array:
        """Return configurations (k, n) on the way of an arm that keeps a speed (n,) for some seconds and then brakes, `_APART` apart."""
        robot = self._arm.spec
        keeps = self._steps.q + velocity * np.arange(self._tick, period + 0.5 * self._tick, self._tick)[:, None]
        rows = np.vstack([keeps, braking_rows(robot, keeps[-1], velocity, self._tick)])
        rows = np.clip(rows, robot.lower, robot.upper)
        gone = np.cumsum(robot.reach[1] * np.abs(np.diff(rows, axis=0, prepend=self._steps.q[None])).sum(axis=1))
        numbers = np.unique((gone / _APART).astype(int), return_index=True)[1]
        found: Array = np.vstack([rows[numbers], rows[-1:]])
        return found

    def joint_action(self, q: Array, closed: float = 0.0) -> Array:
        """Return the action of kind `joint` that asks for a configuration.

        Args:
            q: Shape (n,).
            closed: 0 for the open gripper, 1 for the closed one; of no matter to an arm without one.
        """
        action = 2.0 * (np.asarray(q, dtype=float) - self._low) / self._span - 1.0
        return np.append(action, 2.0 * closed - 1.0) if self._hands else action

    @property
    def _span(self) -> Array:
        span: Array = self._high - self._low
        return span

    def _moved(self, action: Array) -> Array:
        """Return a configuration whose TCP is where the action asks for, or as near as one step comes."""
        here = self._arm.state().tcp_pose.position
        asked = self._position + action[:3] * _METRES_PER_SECOND * self._period
        self._position = here + np.clip(asked - here, -_LEAD_METRES, _LEAD_METRES)
        self._rotation = matrix_from_rotation_vector(action[3:6] * _RADIANS_PER_SECOND * self._period) @ self._rotation
        found = self._solver.descend(self._position, self._rotation, self._steps.q)
        if not found.solved:
            # What cannot be reached is not aimed at any further.
            self._position, self._rotation = self._solver.forward(found.q)
        return found.q
