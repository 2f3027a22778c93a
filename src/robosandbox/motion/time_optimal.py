"""Time-optimal timing of a path: as fast along each stretch of it as the limits of the joints let it go there.

Reachability analysis after Pham and Pham, "A new approach to time-optimal path parameterization based on reachability
analysis" (IEEE Transactions on Robotics, 2018): of the squared path speed x = (ds/dt)^2 a backward pass finds at each grid
point the largest from which the end can still be reached, a forward pass then takes the largest that is among them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robosandbox.types import Array, Trajectory, frozen_array

# Share of a limit by which a corner may be outside of it; chosen as rounding.
_ROUNDING = 1e-9
# Coefficient of an acceleration, rad, below which it is none; chosen far less than a joint moves between two samples.
_NONE = 1e-9
# How often a trajectory is slowed down where it is over the limits, and the share of a limit that is not over; chosen: once is
# enough for most, and a thousandth is far less than a limit is known to.
_CORRECTIONS, _OVER = 6, 1.001


Indices = NDArray[np.intp]


def optimal_trajectory(
    path: Array, velocity: Array, acceleration: Array, dt: float, *, cap: Array | None = None, smoothing: float = 0.0
) -> Trajectory:
    """Return the fastest rest-to-rest trajectory along `path` that keeps the limits at every joint.

    Each joint's motion is averaged over `smoothing` seconds, which bounds its jerk by twice the acceleration limit over that
    time, keeps both limits (they are convex), and leaves the path by at most acceleration * smoothing^2 / 24.

    Args:
        path: Finely sampled configurations of a smooth curve, shape (k, n), at equal steps of its parameter.
        velocity: Limit per joint, shape (n,).
        acceleration: Limit per joint, shape (n,).
        dt: Seconds between rows of the result.
        cap: Largest path speed at each sample, in samples per second, shape (k,); none where it is infinite.
        smoothing: Seconds.
    """
    if len(path) < 2 or np.abs(path - path[0]).max() < 1e-9:
        return Trajectory(q=frozen_array(path[-1:]), dt=dt)
    cap = np.full(len(path), np.inf) if cap is None else cap
    rows = path[-1:]
    for correction in range(_CORRECTIONS + 1):
        squared = _squared_speeds(path, velocity, acceleration, cap)
        rows, at = _rows(path, squared, dt)
        over = _over(rows, velocity, acceleration, dt)
        if over.max() <= _OVER:
            break
        # Between the samples limits are kept to second order of their distance; what is over is taken off by going slower
        # there, and where that is not enough, everywhere.
        worst = np.full(len(path), 1.0 if correction < _CORRECTIONS // 2 else over.max())
        for offset in range(-1, 3):
            np.maximum.at(worst, np.clip(at + offset, 0, len(path) - 1), over)
        cap = np.where(worst > 1.0, np.minimum(cap, np.sqrt(squared) / worst), cap)
    return Trajectory(q=frozen_array(_averaged(rows, round(smoothing / dt))), dt=dt)


def _over(rows: Array, velocity: Array, acceleration: Array, dt: float) -> Array:
    """Return how many times too fast each row is passed, at least, shape (t,); at most 1 where the limits are kept."""
    speed = (np.abs(np.diff(rows, axis=0)) / dt / velocity).max(axis=1)
    change = np.sqrt((np.abs(np.diff(rows, 2, axis=0)) / dt**2 / acceleration).max(axis=1))
    over: Array = np.append(speed, 0.0)
    over[1:-1] = np.maximum(over[1:-1], change)
    return over


def _squared_speeds(path: Array, velocity: Array, acceleration: Array, cap: Array) -> Array:
    """Return the squared path speed at each sample, (samples/s)^2, shape (k,), 0 at both ends."""
    first, second = _middle_derivatives(path)
    with np.errstate(divide="ignore"):
        quickest = (velocity / np.abs(first)).min(axis=1)
    # A sample is passed no faster than the intervals on both sides of it may be.
    top = np.minimum(np.minimum(np.append(quickest, np.inf), np.append(np.inf, quickest)), cap) ** 2
    top[[0, -1]] = 0.0
    # q'' x + q' u at the middle of an interval, with x the mean of its ends' x and u half their difference: a joint's
    # acceleration is here * x[i] + there * x[i + 1].
    here, there = _nonzero(0.5 * (second - first)), _nonzero(0.5 * (second + first))
    # As lines: |x[i] - back * x[i + 1]| <= back_room, and |x[i + 1] - ahead * x[i]| <= ahead_room.
    back, back_room = -there / here, acceleration / np.abs(here)
    ahead, ahead_room = (-here / there).tolist(), (acceleration / np.abs(there)).tolist()
    tops = top.tolist()
    reach = [0.0] * len(path)
    lines = zip(back.tolist(), back_room.tolist(), strict=True)
    for i, (slopes, rooms) in reversed(list(enumerate(lines))):
        reach[i] = _widest(slopes, rooms, tops[i], reach[i + 1])
    speeds = [0.0] * len(path)
    for i, (slopes, rooms) in enumerate(zip(ahead, ahead_room, strict=True)):
        most = min(room + slope * speeds[i] for slope, room in zip(slopes, rooms, strict=True))
        speeds[i + 1] = max(0.0, min(reach[i + 1], most))
    return np.array(speeds)


def _nonzero(values: Array) -> Array:
    """Return values with those that are as good as zero made small, so that one may divide by them."""
    return np.where(np.abs(values) < _NONE, _NONE, values)


def _middle_derivatives(path: Array) -> tuple[Array, Array]:
    """Return first and second derivatives per sample in the middle of each interval, each (k - 1, n)."""
    first = np.diff(path, axis=0)
    second = np.zeros_like(first)
    if len(path) > 2:
        at_samples = np.diff(path, 2, axis=0)
        at_samples = np.concatenate([at_samples[:1], at_samples, at_samples[-1:]])
        second = 0.5 * (at_samples[1:] + at_samples[:-1])
    return first, second


def _widest(slopes: list[float], rooms: list[float], top: float, most: float) -> float:
    """Return the largest x in 0..top for which there is a y in 0..most with |x - slope y| <= room on every line.

    That is a convex polygon around the origin, so x is largest at `most` where the line that binds there rises with y.
    """
    x, slope = min((room + slope * most, slope) for slope, room in zip(slopes, rooms, strict=True))
    held = max(slope * most - room for slope, room in zip(slopes, rooms, strict=True))
    if x >= top and held <= top:
        return top
    if slope >= 0.0 and 0.0 <= x <= top and x >= held:
        return x
    # Otherwise at one of its corners.
    a = np.array([*slopes, *slopes, 0.0])
    b = np.array([*rooms, *(-room for room in rooms), top])
    with np.errstate(divide="ignore", invalid="ignore"):
        y = ((b[None, :] - b[:, None]) / (a[:, None] - a[None, :])).ravel()
    y = np.append(y[(y >= 0.0) & (y <= most)], most)
    lines, widths = np.array(slopes)[:, None], np.array(rooms)[:, None]
    high = np.minimum((lines * y + widths).min(axis=0), top)
    low = (lines * y - widths).max(axis=0)
    slack = _ROUNDING * (1.0 + top)
    return max(0.0, float(high[high >= low - slack].max(initial=0.0)))


def _rows(path: Array, squared: Array, dt: float) -> tuple[Array, Indices]:
    """Return configurations at multiples of dt, shape (t, n), and the samples that they come after, shape (t,).

    Args:
        path: As in `optimal_trajectory`.
        squared: Squared path speeds at the samples, shape (k,).
        dt: Seconds.
    """
    speeds = np.sqrt(squared)
    # At least a hundred-thousandth of a path in a second, so that no time is infinite.
    spans = 2.0 / np.maximum(speeds[1:] + speeds[:-1], 1e-5 * len(path))
    begins = np.concatenate([[0.0], np.cumsum(spans)])
    count = max(1, int(np.ceil(begins[-1] / dt - 1e-9)))
    at = np.linspace(0.0, begins[-1], count + 1)
    k = np.clip(np.searchsorted(begins, at, side="right") - 1, 0, len(spans) - 1)
    since = at - begins[k]
    push = 0.5 * (squared[1:] - squared[:-1])
    along = np.clip(speeds[k] * since + 0.5 * push[k] * since**2, 0.0, 1.0)[:, None]
    slope = np.gradient(path, axis=0)
    # Cubic Hermite interpolation.
    rows: Array = (
        (2.0 * along**3 - 3.0 * along**2 + 1.0) * path[k]
        + (along**3 - 2.0 * along**2 + along) * slope[k]
        + (3.0 * along**2 - 2.0 * along**3) * path[k + 1]
        + (along**3 - along**2) * slope[k + 1]
    )
    rows[0], rows[-1] = path[0], path[-1]
    return rows, k


def _averaged(rows: Array, width: int) -> Array:
    """Return rows averaged over `width` intervals, longer by as many, shape (t + width, n)."""
    if width < 1:
        return rows
    padded = np.concatenate([np.repeat(rows[:1], width, axis=0), rows, np.repeat(rows[-1:], width, axis=0)])
    total = np.concatenate([np.zeros((1, rows.shape[1])), np.cumsum(padded, axis=0)])
    averaged: Array = (total[width + 1 :] - total[: -width - 1]) / (width + 1)
    averaged[0], averaged[-1] = rows[0], rows[-1]
    return averaged
