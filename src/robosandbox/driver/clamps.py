"""What a command may ask for: joint limits, speeds and accelerations of the robot; checked before anything moves."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from robosandbox.errors import FaultError, LimitError, Phase
from robosandbox.evidence import LimitEvidence
from robosandbox.values import frozen

if TYPE_CHECKING:
    from robosandbox.types import Array, Trajectory
    from robosandbox.types.robot import RobotSpec


@frozen(kw_only=True)
class Tolerances:
    """How exactly limits are kept; nothing else in this room is a number of its own.

    Attributes:
        position: By how much a command may pass a joint's limit, rad or m: what encoders' noise leaves of a configuration
            that was read at a limit (0.2 mrad in the driver `hardware`), a few times over, and a quarter of what skills call
            arrived.
        share: By which share a command may pass a speed or an acceleration: ten times what a trajectory that is timed to a
            limit is off by (0.1 %).
        window: Over how many seconds a joint's acceleration is taken, the time in which a servo's position loop answers
            (20 rad/s): a corner of a path of straight pieces that is rounded within it is none. How far a joint may go in
            that time is also how far off a command may begin.
        still: Joint speed below which an arm stands, rad/s or m/s: it moves by 0.1 mm in a tick of 10 ms at a metre's reach.
        braking: In how many times the time that the slowest joint brakes in from its full speed a stop has to be over: one to
            hear of it, one to brake, one for the servo to swing out.
    """

    position: float = 1e-3
    share: float = 0.01
    window: float = 0.05
    still: float = 0.01
    braking: float = 3.0


TOLERANCES = Tolerances()
_MOVED_NOT = "nothing has moved"
_PER_S2 = "rad/s^2 (or m/s^2)"


class Clamps:
    """The limits of an arm's commands, one after the other.

    Args:
        spec: Whose.
        tick: Seconds between commands.
    """

    def __init__(self, spec: RobotSpec, tick: float) -> None:
        self._spec = spec
        self._tick = tick
        # Where the arm was sent last, shape (n,); None where it does not go by that any longer.
        self._last: Array | None = None
        # Where it was sent in the last two windows, and until which of the driver's seconds; it stood there before.
        self._path: list[tuple[float, Array]] = []
        # The speed at which a trajectory ended that was to go on, shape (n,).
        self._going: Array | None = None
        self._least, self._most = spec.lower - TOLERANCES.position, spec.upper + TOLERANCES.position
        self._speed = (1.0 + TOLERANCES.share) * spec.velocity_limits
        self._change = (1.0 + TOLERANCES.share) * spec.acceleration_limits
        self._leap = TOLERANCES.window * self._speed

    def forget(self) -> None:
        """Take note that the arm stands, and no longer goes by what it was sent last."""
        self._last, self._path, self._going = None, [], None

    def check_trajectory(self, trajectory: Trajectory, time: float, measured: Callable[[], Array]) -> None:
        """Check every row of a trajectory, that it begins where the arm is, and that the arm can stop where it ends.

        Args:
            trajectory: What is to be followed.
            time: The driver's seconds now.
            measured: Returns the configuration that the arm has, shape (n,); asked only where it matters.

        Raises:
            LimitError: A row passes a limit of position, speed or acceleration, the first is elsewhere, or it begins or ends at
                a speed that the arm does not get to, or out of, in time.
            FaultError: Where the arm is matters, and what is measured is no finite number.
            ValueError: It is of another shape, or holds a number that is not finite.
        """
        q, dt = trajectory.q, trajectory.dt
        self._check_numbers(q, "a trajectory", 2)
        self._check_positions(q, measured)
        self._check_leap(q[0], "the trajectory begins", measured)
        if len(q) < 2:
            return
        if not dt > 0.0:
            raise ValueError(f"a trajectory has {dt} s between its rows; give seconds above 0")
        velocity = (q[1:] - q[:-1]) / dt
        if (np.abs(velocity) > self._speed).any():
            raise self._too_much(np.abs(velocity), self._spec.velocity_limits, "move at", "rad/s (or m/s)", "speed")
        # The most that a joint's speed changes within a window, however it does so.
        rows = min(len(velocity), max(2, round(TOLERANCES.window / dt) + 1))
        if len(velocity) > 1:
            seconds = max(TOLERANCES.window, (rows - 1) * dt)
            windows = np.lib.stride_tricks.sliding_window_view(velocity, rows, axis=0)
            change = (windows.max(axis=-1) - windows.min(axis=-1)) / seconds
            if (change > self._change).any():
                raise self._too_much(change, self._spec.acceleration_limits, "accelerate by", _PER_S2, "acceleration")
        seconds = min(TOLERANCES.window, trajectory.duration)
        before = self._sent(time) - self._sent(time - seconds) if self._path else 0.0
        self._check_change((_at(trajectory, seconds) - q[0] - before) / seconds, "where it begins")
        if not trajectory.goes_on:
            self._check_change(
                (q[-1] - _at(trajectory, trajectory.duration - seconds)) / seconds, "where it ends, at a speed"
            )

    def check_step(self, goal: Array, time: float, measured: Callable[[], Array]) -> None:
        """Check a configuration, shape (n,), that is commanded at once; arguments and errors as in `check_trajectory`."""
        self._check_numbers(goal, "a goal", 1)
        self._check_positions(goal[None], measured)
        self._check_leap(goal, "the goal is", measured)
        if self._path:
            window, end = TOLERANCES.window, time + self._tick
            now, before = self._sent(end - window), self._sent(end - 2.0 * window)
            self._check_change((goal - 2.0 * now + before) / window, "from one goal to the next")

    def followed(self, trajectory: Trajectory, time: float) -> None:
        """Take note that a trajectory has been followed to its end, at this second of the driver's."""
        q, dt, duration = trajectory.q, trajectory.dt, trajectory.duration
        if len(q) < 2:
            self.stepped(q[-1], time)
            return
        seconds = np.arange(0.0, min(2.0 * TOLERANCES.window, duration) + 0.5 * self._tick, self._tick)[::-1]
        self._remember([(time - float(ago), _at(trajectory, duration - float(ago))) for ago in seconds], time)
        self._last = q[-1]
        self._going = (q[-1] - q[-2]) / dt if trajectory.goes_on and len(q) > 1 else None

    def stepped(self, goal: Array, time: float) -> None:
        """Take note that a configuration has been commanded in the tick that ends at this second of the driver's."""
        self._remember([(time, goal)], time)
        self._last, self._going = goal, None

    def _remember(self, sent: list[tuple[float, Array]], time: float) -> None:
        oldest = time - 2.0 * TOLERANCES.window - 0.5 * self._tick
        self._path = [*(one for one in self._path if oldest < one[0] < sent[0][0]), *sent]

    def _sent(self, time: float) -> Array:
        """Return where the arm was sent at a second of the driver's, shape (n,)."""
        late = time + 0.5 * self._tick
        return next((q for at, q in reversed(self._path) if at <= late), self._path[0][1])

    def braking(self, time: float) -> Array | None:
        """Return rows, shape (k, n), a tick apart, in which the arm comes to rest where it was to go on and does not; else None."""
        velocity = self._going
        if velocity is None or self._last is None or time - self._path[-1][0] > 0.5 * self._tick:
            return None
        rows = braking_rows(self._spec, self._last, velocity, self._tick)
        return rows if len(rows) else None

    def _check_change(self, change: Array, where: str) -> None:
        """Check a change of speed (n,) that comes about in one window."""
        change = np.abs(change)
        if not (change > TOLERANCES.window * self._change).any():
            return
        limits = self._spec.acceleration_limits
        joint = int((change / limits).argmax())
        name, value, limit = self._spec.joints[joint], float(change[joint]) / TOLERANCES.window, float(limits[joint])
        raise self._refused(
            f"{name} would accelerate by {value:.3g} {_PER_S2} {where}, and its limit is {limit:.3g}",
            f"acceleration of {name}, {_PER_S2}",
            value,
            0.0,
            limit,
            remedy="begin at the speed that it has, and end at rest",
        )

    def _check_numbers(self, q: Array, what: str, dimensions: int) -> None:
        if q.ndim != dimensions or q.shape[-1] != self._spec.n or not len(q):
            raise ValueError(f"{what} has shape {q.shape}; {self._spec.name} has {self._spec.n} joints")
        if not np.isfinite(q).all():
            raise ValueError(f"{what} holds a number that is not finite; {_MOVED_NOT}")

    def _check_positions(self, q: Array, measured: Callable[[], Array]) -> None:
        if not ((q < self._least) | (q > self._most)).any():
            return
        # An arm that stands outside may come in.
        stands = self._standing(measured)
        lower = np.minimum(self._least, stands - TOLERANCES.position)
        upper = np.maximum(self._most, stands + TOLERANCES.position)
        over = np.maximum(lower - q, q - upper)
        if over.max() <= 0.0:
            return
        row, joint = (int(index) for index in np.unravel_index(over.argmax(), over.shape))
        name, low, high = self._spec.joints[joint], float(self._spec.lower[joint]), float(self._spec.upper[joint])
        raise self._refused(
            f"{name} would be at {q[row, joint]:.4g} rad (or m){_in_row(row, len(q))}, and its limits are {low:.4g}..{high:.4g}",
            f"position of {name}, rad or m",
            float(q[row, joint]),
            low,
            high,
        )

    def _standing(self, measured: Callable[[], Array]) -> Array:
        stands = measured()
        if not np.isfinite(stands).all():
            joint = int((~np.isfinite(stands)).argmax())
            raise FaultError(
                f"{self._spec.joints[joint]} is measured to be at {stands[joint]}, which is no position; {_MOVED_NOT}: look "
                "what the driver reads",
                phase=Phase.CHECK,
            )
        return stands

    def _check_leap(self, q: Array, what: str, measured: Callable[[], Array]) -> None:
        if self._last is not None and not (np.abs(q - self._last) > self._leap).any():
            return
        stands = self._standing(measured)
        off = np.abs(q - stands)
        if not (off > self._leap).any():
            return
        joint = int((off / np.maximum(self._leap, 1e-9)).argmax())
        name, most = self._spec.joints[joint], float(self._leap[joint])
        raise self._refused(
            f"{name} is at {stands[joint]:.4g} rad (or m), and {what} at {q[joint]:.4g}: {off[joint]:.3g} away, and in "
            f"{TOLERANCES.window:g} s it goes {most:.3g}",
            f"leap of {name}, rad or m",
            float(off[joint]),
            0.0,
            most,
            remedy="begin where the arm stands",
        )

    def _too_much(self, values: Array, limits: Array, does: str, unit: str, what: str) -> LimitError:
        row, joint = (int(index) for index in np.unravel_index((values - limits).argmax(), values.shape))
        name, value, limit = self._spec.joints[joint], float(values[row, joint]), float(limits[joint])
        return self._refused(
            f"{name} would {does} {value:.3g} {unit}{_in_row(row, len(values))}, and its limit is {limit:.3g}",
            f"{what} of {name}, {unit}",
            value,
            0.0,
            limit,
            remedy="make the trajectory slower",
        )

    def _refused(
        self, said: str, quantity: str, value: float, low: float, high: float, *, remedy: str = "send another"
    ) -> LimitError:
        return LimitError(
            f"{said}; {_MOVED_NOT}: {remedy}",
            phase=Phase.CHECK,
            evidence=LimitEvidence(quantity=quantity, value=value, low=low, high=high),
        )


def _at(trajectory: Trajectory, seconds: float) -> Array:
    """Return where a trajectory is after so many seconds, shape (n,)."""
    row = seconds / trajectory.dt
    first = min(int(row), len(trajectory.q) - 2)
    share = row - first
    at: Array = (1.0 - share) * trajectory.q[first] + share * trajectory.q[first + 1]
    return at


def braking_rows(spec: RobotSpec, q: Array, velocity: Array, dt: float) -> Array:
    """Return rows, shape (k, n), in which an arm comes to rest within its limits; none where it is at rest.

    Args:
        spec: Whose.
        q: Where it is, shape (n,).
        velocity: How fast it is there, rad/s or m/s, shape (n,).
        dt: Seconds between rows; the first is that long after `q`.
    """
    rate = spec.acceleration_limits * dt
    ticks = math.ceil(float((np.abs(velocity) / rate).max()))
    slower = np.arange(1, ticks + 1)[:, None] * rate
    speeds = np.sign(velocity) * np.maximum(np.abs(velocity) - slower, 0.0)
    rows: Array = np.clip(q + np.cumsum(speeds, axis=0) * dt, spec.lower, spec.upper)
    return rows


def braking_seconds(spec: RobotSpec) -> tuple[float, float]:
    """Return the shortest and the longest time in which a joint of a robot brakes from its full speed, s."""
    seconds = spec.velocity_limits / spec.acceleration_limits
    return float(seconds.min()), float(seconds.max())


def _in_row(row: int, rows: int) -> str:
    return f" in row {row} of {rows}" if rows > 1 else ""
