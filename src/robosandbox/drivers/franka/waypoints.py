"""Waypoints with velocities that a controller gets to in time, out of a trajectory's rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robosandbox.types import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Waypoints:
    """Configurations that a motion passes, one after the other.

    Attributes:
        q: Configurations, rad, shape (k, n).
        qd: Speeds there, rad/s, shape (k, n).
        seconds: From the waypoint before, or the begin, shape (k,).
        stretch: By which factor it is slower than the trajectory.
    """

    q: Array
    qd: Array
    seconds: Array
    stretch: float


def begun_at(start: Array, rows: Array) -> Array:
    """Return rows, shape (k, n), that begin at `start`, shape (n,), and end where they did; what they are off by fades."""
    past = np.linspace(0.0, 1.0, len(rows))[:, None]
    faded: Array = rows + (start - rows[0]) * (1.0 - past**2 * (3.0 - 2.0 * past))
    return faded


def waypoints(rows: Array, dt: float, *, spacing: float, acceleration: Array, jerk: Array) -> Waypoints:
    """Return waypoints of a trajectory that ends at rest, slower where the controller would not get from one to the next in time.

    The controller passes a waypoint without acceleration. A joint that is to be somewhere at a speed, both given, needs one
    acceleration for the first half of the way and another for the second; in a time that is too short it turns back to get up to
    that speed. So the whole trajectory is slowed until the accelerations are there, and the time in which jerk builds them up.

    Args:
        rows: Configurations, rad, shape (k, n), k at least 2.
        dt: Seconds between them.
        spacing: Seconds between waypoints, as near as rows allow.
        acceleration: The controller's limits, rad/s^2, shape (n,).
        jerk: Likewise, rad/s^3.
    """
    velocities = np.gradient(rows, dt, axis=0)
    velocities[-1] = 0.0
    step = max(1, round(spacing / dt))
    at = np.array([0, *range(step, len(rows) - 1, step), len(rows) - 1])
    q, qd, seconds = rows[at], velocities[at], dt * np.diff(at)
    length = seconds[:, None]
    total = 2.0 * np.diff(qd, axis=0) / length
    off = np.abs(np.diff(q, axis=0) - (qd[1:] + qd[:-1]) / 2.0 * length)
    difference = 8.0 * off / length**2
    needed = (np.abs(total) + difference) / 2.0
    # Up, over from one to the other, which is twice as far, and down: so much of the time is without the full acceleration.
    building = np.minimum(4.0 * acceleration / jerk / length, 0.5)
    stretch = max(1.0, float(np.sqrt((needed / (acceleration * (1.0 - building))).max())))
    return Waypoints(q=q[1:], qd=qd[1:] / stretch, seconds=seconds * stretch, stretch=stretch)
