"""A push that feels: as fast as what is felt allows, giving way upwards, stopped where the thing resists too much.

A stiff hand that pushes a thing jams: friction at the fingers presses the thing down, which adds to its friction on the table,
which adds to the force of the fingers; where the two coefficients multiply to 1 there is no end to it (measured before this
was written: 300 N on a cube of 1 kg that slides under 10 N). So the hand comes slowly, follows its path by integral action, which
holds the height that a loaded arm would lose, and rises where it feels that it presses down.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from robosandbox.driver import Guard
from robosandbox.driver.clamps import TOLERANCES
from robosandbox.errors import LimitError, Phase
from robosandbox.evidence import LimitEvidence
from robosandbox.robots.kinematics import Kinematics
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.types import MAX_FORCE_N, Array, Trajectory
from robosandbox.values import frozen

# m/s, each at the force that a robot may press with by default and in proportion below it. A servo trails its target by its
# damping over its stiffness, and presses with what it trails by where it is stopped at once: 1.8 N for each mm/s on the
# bundled arm, as measured.
_FREE_SPEED = 0.02  # Before the thing; chosen so that a thing nearer than seen is met with 36 N.
_TOUCH_SPEED = (
    0.006  # Where it is to be met; chosen so that 11 N come of it, and no more than half the limit with an impact.
)
_PUSH_SPEED = 0.03  # At most; chosen so that 54 N come of it where the thing meets a wall.
# Metres before the thing from which the hand goes slowly; chosen as twice perception's error (p95, docs/measured.md).
_NEAR = 0.005
# m/s^2 with which it goes faster again; chosen so that full speed takes half a second (halved, pushes of 3 kg press up
# to 10 % less and take 20 % longer).
_ACCELERATION = 0.03
# Share of the limit over which the hand goes as slowly as it does at all, and the share of its speed that this is; chosen: at
# less it stands still before what slides under the whole limit.
_SLOW_FROM, _SLOWEST = 0.5, 0.25
# Share of the limit at which the hand gives way, going by how the force grew in the last tick: what comes after is the arm
# running on (up to 20 % of the limit, as measured at these speeds).
_YIELD = 0.85
# Metres by which it gives way; chosen so that a servo of 18 N/mm, as the bundled arm's are, lets go.
_STEP_BACK = 0.0005
# How often in a row it yields within `_STUCK` metres until the thing counts as resisting; chosen.
_TRIES, _STUCK = 8, 0.002
# m/s of the hand upwards for each newton that it presses down beyond `_LIGHT` newtons; chosen so that 30 N are relieved
# at the speed of the push (at a third of it, things of 3 kg jam; at three times, they are lifted).
_GIVE, _LIGHT = 0.001, 2.0
# Metres by which the hand may trail its command, and seconds in a row in which integral action brings it nearer or not at all: stiff
# servos trail by 4 mm at 80 N (measured on the bundled arm), those of small arms by 7 where they push at all.
_TRAILS, _TRAILED = 0.01, 0.12
# Seconds by which servos that are sent at a speed lag behind at the most, as the drivers of real arms reckon with; of summed ticks; share of
# the speed of its way from which a hand gets on.
_LAGS, _ROUNDING, _STANDS = 0.2, 1e-9, 0.2
# Seconds for each metre of the way until it is given up; chosen as that of the slowest push, twice.
_SECONDS_PER_METRE = 300.0
# m/s and metres by which the hand comes off what it pushed, and control ticks in which it has to feel nothing; chosen so
# that integral action, which halves what is left in 8 ticks, has forgotten the load.
_OFF_SPEED, _OFF, _FREE_TICKS = 0.03, 0.003, 12
# Seconds that coming off may take; chosen as thirty times what it takes without a load.
_OFF_SECONDS = 3.0
# Metres within which the hand is sent to a place beside its way: at 18 N/mm, as of `_STEP_BACK`, 0.02 N.
_FINE = 1e-6


@frozen
class Pressed:
    """Result of a push.

    Attributes:
        force: The most that the hand pressed with, N; None where the driver does not tell.
        arrived: Whether it came to the end of its way, or to where it would pass over the thing; where not, the thing resisted.
        spent: Joint whose servo gave all that it can where the thing resisted; None where none did, or where that is not told.
    """

    force: float | None
    arrived: bool
    spent: str | None = None


def press_along(
    arm: Manipulator, way: Trajectory, target: str, *, most: float, before: float, rise: float = math.inf
) -> Pressed:
    """Push a thing along a straight way and come off it; without a force sensor, follow the way to its end.

    Args:
        arm: Its hand is where the way begins.
        way: Of the TCP, straight.
        target: What is pushed.
        most: With how many newtons at most.
        before: How far along the way the thing is met, metres.
        rise: How far the hand may give way upwards before it would pass over the thing, metres.

    Raises:
        LimitError: The robot pressed too hard on something else.
    """
    path = StraightPath.of(arm, way)
    if not arm.driver.capabilities.wrist_wrench:
        try:
            arm.follow(way, Phase.PUSH, yielding=True, guards=(_trailing(arm, way, path),))
        except _Trails:
            return Pressed(force=None, arrived=False)
        return Pressed(force=None, arrived=True)
    arm.ctx.enter(Phase.PUSH)
    arm.ctx.announce(way)
    push = _Push(arm, path, target, most, rise)
    arrived = push.go(before)
    spent = None if arrived else arm.spent()
    push.come_off()
    return Pressed(force=push.force, arrived=arrived, spent=spent)


class _Trails(Exception):
    """The hand does not get on; the driver holds the arm."""


def _trailing(arm: Manipulator, way: Trajectory, path: StraightPath) -> Guard:
    """Return the guard that stops a hand which feels nothing where it stays behind on a straight way and gets on no more.

    What follows it more slowly than it was timed, as a controller at a quarter of its speed, still gets on.
    """
    driver, begun = arm.driver, arm.driver.time
    share = driver.capabilities.speed
    places = deque[float](maxlen=math.ceil(_TRAILED / driver.control_timestep))
    least = _STANDS * share * path.length / max(way.duration, way.dt) * _TRAILED

    def trails() -> Exception | None:
        here = path.place(arm.state.tcp_pose.position)
        row = int((driver.time - begun - _LAGS) * share / way.dt)
        behind = path.along[min(max(row, 0), len(path.along) - 1)] - here
        stands = len(places) == places.maxlen and here - places[0] < least
        places.append(here)
        return _Trails() if stands and behind > _TRAILS else None

    return trails


@frozen
class StraightPath:
    """A straight way as places along it, metres, with the configuration at each.

    Attributes:
        start: Where the TCP begins, shape (3,).
        axis: Its direction, shape (3,).
        along: Distances from there, metres, shape (k,).
        q: The configurations, shape (k, n).
        kinematics: Of the arm.
    """

    start: Array
    axis: Array
    along: Array
    q: Array
    kinematics: Kinematics

    @classmethod
    def of(cls, arm: Manipulator, way: Trajectory) -> StraightPath:
        """Return the way of a trajectory of the TCP along a line."""
        kinematics = arm.planning.kinematics(position_tolerance=_FINE)
        places = np.array([kinematics.forward(row)[0] for row in way.q])
        axis = (places[-1] - places[0]) / np.linalg.norm(places[-1] - places[0])
        along = np.maximum.accumulate((places - places[0]) @ axis)
        return cls(start=places[0], axis=axis, along=along, q=way.q, kinematics=kinematics)

    @property
    def length(self) -> float:
        """Length, metres."""
        return float(self.along[-1])

    def at(self, place: float, lift: float, bent: Array | float = 0.0) -> Array:
        """Return the configuration (n,) at a place along the way, raised by `lift` metres.

        Args:
            place: Metres from its start.
            lift: Metres upwards; the orientation is kept as far as the arm can.
            bent: How far the joints were off those of the way at about that lift, shape (n,): of an arm that has several
                configurations there, the next to that is taken.
        """
        on_way = np.array([np.interp(place, self.along, column) for column in self.q.T])
        if lift == 0.0:
            return on_way
        position, rotation = self.kinematics.forward(on_way)
        return self.kinematics.descend(position + [0.0, 0.0, lift], rotation, on_way + bent).q

    def place(self, point: Array) -> float:
        """Return how far along the way a point (3,) of the world is, metres."""
        return float((point - self.start) @ self.axis)


@dataclass(slots=True)
class _Push:
    """The hand on its way.

    Attributes:
        force: The most that it has felt, N.
        _place: Where it is to be along the way, metres.
        _lift: By how much it is to be raised there, metres.
        _sent: Place and lift of the last command.
        _rows: Configurations of the last window that were commanded, each of shape (n,).
    """

    arm: Manipulator
    way: StraightPath
    target: str
    most: float
    rise: float
    force: float = 0.0
    _felt: float = 0.0
    _place: float = 0.0
    _lift: float = 0.0
    _sent: tuple[float, float] = (0.0, 0.0)
    _rows: list[Array] = field(default_factory=list)
    _speed: float = 0.0
    _was: float = math.inf
    _ran: float = 0.0
    _stopped: bool = False
    _yields: list[float] = field(default_factory=list)

    def go(self, before: float) -> bool:
        """Go to the end of the way, `before` metres of it freely, or until it would pass over; return False where the thing resists."""
        driver, share = self.arm.driver, min(1.0, self.most / MAX_FORCE_N)
        deadline = driver.time + _SECONDS_PER_METRE * self.way.length / share
        touched, trailed = False, 0.0
        while self._place < self.way.length:
            grown = self._feel()
            touched = touched or self._felt > 0.0
            trailed = trailed + driver.control_timestep if self._trails() > _TRAILS else 0.0
            if self._stopped or self._felt + max(0.0, grown) > _YIELD * self.most:
                if self._is_stuck():
                    return False
                self._place, self._speed = min(self._place, self._here() - _STEP_BACK), 0.0
            elif trailed > _TRAILED + _ROUNDING:
                return False
            elif trailed:
                self._speed = 0.0
            elif self._lift > self.rise:
                return True
            elif driver.time > deadline:
                return False
            elif (
                grown < 0.0
                and self._felt > _SLOW_FROM * self.most
                and self._ran > max(self._speed, share * _SLOWEST * _PUSH_SPEED)
            ):
                # A thing that sticks and then slides frees the hand, which leaps after it by all that its servos trail, and knocks
                # against it in a single tick: the hand lets go of that while it still speeds up, and not at once, as a thing that
                # it has tipped would fall on it.
                back = self._place - _OFF_SPEED * driver.control_timestep
                self._place, self._speed = min(self._place, max(back, self._reached())), 0.0
            elif touched:
                slowed = max(_SLOWEST, 1.0 - self._felt / (_SLOW_FROM * self.most))
                self._speed = min(self._speed + _ACCELERATION * driver.control_timestep, slowed * share * _PUSH_SPEED)
            else:
                near = self._place > before - _NEAR
                self._speed = share * (_TOUCH_SPEED if near else _FREE_SPEED)
            self._advance(self._speed)
        return True

    def come_off(self) -> None:
        """Go back until nothing is felt and the servos no longer press."""
        driver = self.arm.driver
        deadline, free = driver.time + _OFF_SECONDS, 0
        while free < _FREE_TICKS and driver.time < deadline:
            self._feel()
            if self._felt > 0.0:
                free = 0
                self._place = min(self._place, self._here())
            elif free == 0:
                free = 1
                self._place -= _OFF
            else:
                # A joint that may not be sent so far at once is still on its way.
                free += self._sent == (self._place, self._lift)
            self._advance(0.0 if free else -_OFF_SPEED)

    def _feel(self) -> float:
        """Read the force and the hand's speed, and give way upwards to a press down; return by how much the force grew, N."""
        here = self._here()
        self._ran, self._was = (here - self._was) / self.arm.driver.control_timestep, here
        force = self.arm.force_on(self.target)
        before, self._felt = self._felt, float(np.linalg.norm(force))
        self.force = max(self.force, self._felt)
        up = float(force[2])
        beyond = np.sign(up) * max(0.0, abs(up) - _LIGHT)
        self._lift = max(0.0, self._lift - _GIVE * beyond * self.arm.driver.control_timestep)
        return self._felt - before

    def _advance(self, speed: float) -> None:
        tick = self.arm.driver.control_timestep
        self._place = float(np.clip(self._place + speed * tick, 0.0, self.way.length))
        self._stopped = False
        try:
            self._send()
        except LimitError as error:
            evidence = error.evidence
            if not isinstance(evidence, LimitEvidence) or evidence.touching not in ((self.target,), ("something",)):
                raise
            # The limit itself has stopped the arm where this was to give way before it.
            self._stopped = True

    def _send(self) -> None:
        """Let a tick pass with the hand sent to its place, or as near to it as its joints may be sent at once.

        Joints that are sent no further apart in a window of the clamps than half of what their acceleration takes them there may
        stop or turn round in the next one.
        """
        window, limits = TOLERANCES.window, self.arm.spec.acceleration_limits
        ticks = round(window / self.arm.driver.control_timestep)
        last, goal = np.array(self._sent), np.array([self._place, self._lift])
        rows = np.array(self._rows[-ticks:] or [self.way.at(*last)])
        bent = (rows[-1] - self.way.at(last[0], 0.0)) * (goal[1] / last[1] if last[1] > 0.0 else 0.0)
        step = self.way.at(self._place, self._lift, bent) - rows[-1]
        room = np.where(step > 0.0, rows.min(axis=0) - rows[-1], rows[-1] - rows.max(axis=0)) + 0.5 * limits * window**2
        share = float(np.clip(np.min(room / np.maximum(np.abs(step), 1e-12)), 0.0, 1.0))
        row = rows[-1] + share * step
        self.arm.trim(row)
        place, lift = goal if share == 1.0 else last + share * (goal - last)
        self._sent = float(place), float(lift)
        # With where it begins: from there it goes as little at once.
        self._rows = [*rows, row]

    def _reached(self) -> float:
        """Return the place along the way at which the command has the hand where it is, metres."""
        commanded, _ = self.way.kinematics.forward(self._rows[-1])
        return self._sent[0] + self._here() - self.way.place(commanded)

    def _trails(self) -> float:
        """Return how far the hand is from where it was sent last, metres."""
        if not self._rows:
            return 0.0
        commanded, _ = self.way.kinematics.forward(self._rows[-1])
        return float(np.linalg.norm(commanded - self.arm.state.tcp_pose.position))

    def _here(self) -> float:
        return self.way.place(self.arm.state.tcp_pose.position)

    def _is_stuck(self) -> bool:
        """Tell whether the hand yields for the last of several times at one place."""
        self._yields.append(self._here())
        last = self._yields[-_TRIES:]
        return len(last) == _TRIES and max(last) - min(last) < _STUCK
