"""From a geometric path to a trajectory within velocity and acceleration limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robosandbox.types import Array, Trajectory, frozen_array


def spline(knots: Array, samples: int) -> Array:
    """Return `samples` points of the natural cubic spline through `knots` (k, n), ends included, shape (samples, n).

    Knots are spaced by the joint distance between them, so that unequal steps do not bend the curve.
    """
    distance = np.linalg.norm(knots[1:] - knots[:-1], axis=1)
    apart = distance > 1e-9
    if not apart.all():
        knots = knots[np.concatenate([[True], apart])]
        if len(knots) < 2:
            return np.repeat(knots, samples, axis=0)
        distance = np.linalg.norm(knots[1:] - knots[:-1], axis=1)
    u = np.concatenate([[0.0], np.cumsum(distance)])
    at = np.linspace(0.0, u[-1], samples)
    if len(knots) == 2:
        straight: Array = knots[0] + (at / u[-1])[:, None] * (knots[1] - knots[0])
        return straight
    h = u[1:] - u[:-1]
    slope = (knots[1:] - knots[:-1]) / h[:, None]
    inner = len(h) - 1
    system = np.zeros((inner, inner))
    # Its three diagonals, in steps through all entries one after the other.
    entries = system.reshape(-1)
    entries[:: inner + 1] = 2.0 * (h[:-1] + h[1:])
    entries[1 :: inner + 1] = entries[inner :: inner + 1] = h[1:-1]
    second = np.zeros_like(knots)
    second[1:-1] = np.linalg.solve(system, 6.0 * (slope[1:] - slope[:-1]))
    k = np.clip(np.searchsorted(u, at, side="right") - 1, 0, len(h) - 1)
    left, right, width = (at - u[k])[:, None], (u[k + 1] - at)[:, None], h[k][:, None]
    curve: Array = (
        (second[k] * right**3 + second[k + 1] * left**3) / (6.0 * width)
        + (knots[k] / width - second[k] * width / 6.0) * right
        + (knots[k + 1] / width - second[k + 1] * width / 6.0) * left
    )
    return curve


def bounded_spline(knots: Array, samples: int, lower: Array, upper: Array) -> Array:
    """Return a spline as `spline` does, but for joints that would leave their limits on it: these go from knot to knot only.

    Between two knots such a joint turns nowhere, with a continuous velocity: Fritsch and Carlson, "Monotone piecewise cubic
    interpolation" (SIAM Journal on Numerical Analysis, 1980), with the slopes of Fritsch and Butland (1984).

    Args:
        knots: Shape (k, n).
        samples: How many points.
        lower: Joint limits, shape (n,).
        upper: Likewise.
    """
    curve = spline(knots, samples)
    lower, upper = np.minimum(lower, knots.min(axis=0)), np.maximum(upper, knots.max(axis=0))
    out = ((curve < lower) | (curve > upper)).any(axis=0)
    if out.any():
        distance = np.linalg.norm(knots[1:] - knots[:-1], axis=1)
        apart = np.concatenate([[True], distance > 1e-9])
        u, knots = np.concatenate([[0.0], np.cumsum(distance[apart[1:]])]), knots[apart][:, out]
        curve[:, out] = np.clip(_monotone(u, knots, samples), lower[out], upper[out])
    return curve


def _monotone(u: Array, knots: Array, samples: int) -> Array:
    """Return `samples` points, shape (samples, n), of the curve that is at `knots` (k, n) at `u` (k,), monotone between them."""
    at = np.linspace(0.0, u[-1], samples)
    h = (u[1:] - u[:-1])[:, None]
    secant = (knots[1:] - knots[:-1]) / h
    slope = np.concatenate([secant[:1], np.zeros_like(knots[1:-1]), secant[-1:]])
    before, after = secant[:-1], secant[1:]
    goes_on = before * after > 0.0
    near, far = 2.0 * h[1:] + h[:-1], h[1:] + 2.0 * h[:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (near + far) / (near / before + far / after)
    slope[1:-1] = np.where(goes_on, mean, 0.0)
    k = np.clip(np.searchsorted(u, at, side="right") - 1, 0, len(h) - 1)
    along, width = ((at - u[k]) / h[k, 0])[:, None], h[k]
    curve: Array = (
        (2.0 * along**3 - 3.0 * along**2 + 1.0) * knots[k]
        + (along**3 - 2.0 * along**2 + along) * width * slope[k]
        + (3.0 * along**2 - 2.0 * along**3) * knots[k + 1]
        + (along**3 - along**2) * width * slope[k + 1]
    )
    return curve


def time_path(path: Array, velocity: Array, acceleration: Array, dt: float) -> Trajectory:
    """Return a rest-to-rest trajectory along `path` that keeps both limits at every joint.

    The path is followed with a trapezoidal speed profile whose cruise speed and acceleration are the largest
    that the path's first and second derivatives admit anywhere along it.

    Args:
        path: Finely sampled configurations at equal path steps, shape (k, n).
        velocity: Limit per joint, shape (n,).
        acceleration: Limit per joint, shape (n,).
        dt: Seconds between rows of the result.
    """
    span = np.abs(path - path[0]).max()
    if len(path) < 2 or span < 1e-9:
        return Trajectory(q=frozen_array(path[-1:]), dt=dt)
    steps = len(path) - 1
    first = _differences(path) * steps
    second = _differences(first) * steps if steps > 2 else np.zeros_like(path)
    slope = np.abs(first).max(axis=0)
    bend = np.abs(second).max(axis=0)
    straight = bend.max() < 1e-6 * slope.max()
    with np.errstate(divide="ignore"):
        speed = float((velocity / slope).min())
        if straight:
            ramp = float((acceleration / slope).min())
        else:
            # Half of the acceleration limit is for bends at speed, half for speeding up.
            speed = min(speed, float(np.sqrt(0.5 * acceleration / np.maximum(bend, 1e-12)).min()))
            ramp = float((0.5 * acceleration / slope).min())
    s = _trapezoid(speed, ramp, dt)
    at = s * steps
    k = np.minimum(at.astype(int), steps - 1)
    fraction = (at - k)[:, None]
    q = path[k] * (1.0 - fraction) + path[k + 1] * fraction
    q[0], q[-1] = path[0], path[-1]
    return Trajectory(q=frozen_array(q), dt=dt)


def _differences(rows: Array) -> Array:
    """Return by how much rows (k, n) change from one to the next: central differences, one-sided at both ends, (k, n)."""
    change = np.empty_like(rows)
    change[1:-1] = (rows[2:] - rows[:-2]) / 2.0
    change[0], change[-1] = rows[1] - rows[0], rows[-1] - rows[-2]
    return change


def join(parts: Sequence[Trajectory]) -> Trajectory:
    """Return trajectories that begin where the one before ended, with equal dt, as one."""
    rows = [parts[0].q, *(part.q[1:] for part in parts[1:])]
    return Trajectory(q=frozen_array(np.concatenate(rows)), dt=parts[0].dt)


def _trapezoid(speed: float, ramp: float, dt: float) -> Array:
    """Return s(t) from 0 to 1 at multiples of dt for a cruise speed and a ramp in 1/s and 1/s^2.

    The duration is rounded up to a whole number of steps and the profile slowed to fit, so limits still hold.
    """
    if speed * speed / ramp >= 1.0:
        accelerating = np.sqrt(1.0 / ramp)
        cruising = 0.0
    else:
        accelerating = speed / ramp
        cruising = (1.0 - speed * accelerating) / speed
    ideal = 2.0 * accelerating + cruising
    count = max(2, int(np.ceil(ideal / dt)))
    t = np.arange(count + 1) * (ideal / count)
    peak = 1.0 / (accelerating + cruising)
    slope = peak / accelerating
    s = np.where(
        t < accelerating,
        0.5 * slope * t * t,
        np.where(
            t <= accelerating + cruising,
            peak * (t - 0.5 * accelerating),
            1.0 - 0.5 * slope * np.maximum(ideal - t, 0.0) ** 2,
        ),
    )
    clipped: Array = np.clip(s, 0.0, 1.0)
    return clipped
