"""A guard that stops the arm where it goes otherwise than its twin went: in position, force or time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Self

import numpy as np

from robosandbox.driver import TOLERANCES
from robosandbox.errors import SkillError, TwinError
from robosandbox.evidence import LimitEvidence
from robosandbox.skills.events import Intended
from robosandbox.types import Array, Trajectory, force_limits, frozen_array
from robosandbox.values import frozen

if TYPE_CHECKING:
    from robosandbox.agent.context import AgentContext

# Control ticks in a row that make a force out of a knock, as for the limits of force.
_TICKS = 2


@frozen(kw_only=True)
class Track:
    """Course of an arm in one call.

    Attributes:
        q: Joint positions at each control tick, rad or m, shape (k, n).
        moving_seconds: Time in which it was in motion.
        force_n: Largest force between the arm and the rest, N; None where that is not felt.
        moves: Whether arm or gripper went elsewhere than they stood.
    """

    q: Array
    moving_seconds: float
    force_n: float | None
    moves: bool


class Tracker:
    """A listener to ticks that takes down how the arm goes.

    Args:
        ctx: Whose arm.
    """

    def __init__(self, ctx: AgentContext) -> None:
        self._ctx = ctx
        self._feels = ctx.driver.capabilities.wrist_wrench
        self.begin()

    def begin(self) -> None:
        """Begin anew."""
        state = self._ctx.arm.state()
        self._rows: list[Array] = [state.q]
        self._closed = [0.0 if state.gripper is None else state.gripper.closed]
        self._time = self._ctx.driver.time
        self.moving_seconds: float = 0.0
        self.force_n: float = 0.0

    def __call__(self) -> None:
        """Take down a tick."""
        self.step()
        state = self._ctx.arm.state()
        self._rows.append(state.q)
        self._closed.append(0.0 if state.gripper is None else state.gripper.closed)

    def step(self) -> float:
        """Count a tick's time, and return the force that is felt, N; 0 where none is."""
        now = self._ctx.driver.time
        if self._ctx.mode == "moving":
            self.moving_seconds += now - self._time
        self._time = now
        if not self._feels:
            return 0.0
        force = float(np.linalg.norm(self._ctx.driver.senses.force_on(None, self._ctx.arm.name)))
        self.force_n = max(self.force_n, force)
        return force

    def track(self) -> Track:
        """Return how it went so far."""
        q = frozen_array(np.array(self._rows))
        return Track(
            q=q,
            moving_seconds=self.moving_seconds,
            force_n=self.force_n if self._feels else None,
            moves=max(np.ptp(q, axis=0).max(), np.ptp(self._closed)) > TOLERANCES.still,
        )


class TwinGuard:
    """Compares an arm with its twin in the same call, after every control tick, as long as it is entered.

    The arm has to be on a way that the twin took in the call, or on one that the call has announced since: each call is planned
    anew from what is seen by then. A joint may be off by the way in which it brakes from its limit of speed. The motions may
    take three times as long as the twin's, or as they are to take, at the driver's speed, as a stop may, and for each a stop
    more, in which it comes to rest. The arm may press by as much harder as its limits let it press on what it does not mean to
    touch.

    Args:
        ctx: Whose arm.
        track: The twin's.
    """

    def __init__(self, ctx: AgentContext, track: Track) -> None:
        self._ctx, self._track = ctx, track
        self._now = Tracker(ctx)
        spec = ctx.arm.spec
        self._off: Array = spec.velocity_limits**2 / (2.0 * spec.acceleration_limits)
        self._ways = [_Way(track.q)]
        self._announced = 0.0
        self._pressing = 0
        self._leave: Callable[[], None] = ctx.events.subscribe(self._hear)

    def __enter__(self) -> Self:
        self._ctx.driver.guards.append(self)
        return self

    def __exit__(self, *_: object) -> None:
        self._leave()
        self._ctx.driver.guards.remove(self)

    def __call__(self) -> SkillError | None:
        """Return what differs, or None."""
        force = self._now.step()
        return self._position() or self._force(force) or self._time()

    def _hear(self, event: object) -> None:
        if isinstance(event, Intended) and isinstance(event.intent, Trajectory):
            self._ways.append(_Way(event.intent.q))
            self._announced += event.intent.duration

    def _position(self) -> SkillError | None:
        q = self._ctx.arm.state().q
        closest: Array = np.full(len(q), np.inf)
        # The last way first: it is mostly the one.
        for way in reversed(self._ways):
            off = way.nearest(q, self._off)
            if (off <= self._off).all():
                return None
            if (off / self._off).max() < (closest / self._off).max():
                closest = off
        joint = int((closest / self._off).argmax())
        value, most, name = float(closest[joint]), float(self._off[joint]), self._ctx.arm.spec.joints[joint]
        return self._differs(
            f"position: {name} is {value:.3f} rad (or m) off the way that it takes on the twin, and {most:.3f} are usual",
            f"{name}: distance from the twin's way, rad or m",
            value,
            most,
        )

    def _force(self, force: float) -> SkillError | None:
        if self._track.force_n is None:
            return None
        most = self._track.force_n + force_limits(*self._ctx.all_limits())[1]
        self._pressing = self._pressing + 1 if force > most else 0
        if self._pressing < _TICKS:
            return None
        return self._differs(
            f"force: the arm presses with {force:.1f} N, its twin pressed with {self._track.force_n:.1f} N at the most, and up to "
            f"{most:.1f} N are usual",
            "force, N",
            force,
            most,
        )

    def _time(self) -> SkillError | None:
        ctx, gone = self._ctx, self._now.moving_seconds
        planned = max(self._track.moving_seconds, self._announced) / ctx.driver.capabilities.speed
        most = TOLERANCES.braking * planned + len(self._ways) * ctx.stop_deadline
        if gone <= most:
            return None
        return self._differs(
            f"time: the arm has moved for {gone:.1f} s, its twin had done so after {self._track.moving_seconds:.1f} s, and up to "
            f"{most:.1f} s are usual",
            "time in motion, s",
            gone,
            most,
        )

    def _differs(self, said: str, quantity: str, value: float, most: float) -> SkillError:
        return TwinError(
            f"the arm and its twin differ in {said}; the arm holds: look what it met and whether things are where they are "
            "believed to be, then say it again",
            phase=self._ctx.phase,
            evidence=LimitEvidence(quantity=quantity, value=value, low=0.0, high=most),
        )


class _Way:
    """A way of joints, straight between its rows.

    Args:
        q: Rows, shape (k, n).
    """

    def __init__(self, q: Array) -> None:
        self._begin, self._steps = q[: max(1, len(q) - 1)], np.diff(q, axis=0) if len(q) > 1 else np.zeros_like(q)
        self._lengths = np.maximum((self._steps**2).sum(axis=1), np.finfo(float).tiny)

    def nearest(self, q: Array, unit: Array) -> Array:
        """Return by how much each joint is off the nearest place of the way, shape (n,); joints are compared in `unit` (n,)."""
        share = np.clip(((q - self._begin) * self._steps).sum(axis=1) / self._lengths, 0.0, 1.0)
        off = np.abs(q - self._begin - share[:, None] * self._steps)
        nearest: Array = off[(off / unit).max(axis=1).argmin()]
        return nearest
