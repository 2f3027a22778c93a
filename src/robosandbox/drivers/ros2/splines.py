"""How fast ros2_control's joint_trajectory_controller moves between points: by cubics where they have speeds, by lines where not.

<https://control.ros.org/kilted/doc/ros2_controllers/joint_trajectory_controller/doc/trajectory.html>
"""

from __future__ import annotations

import numpy as np

from robosandbox.types import Array

# Ratio between two times that are tried, and how many are: up to some ten thousand times the least.
_STEP, _TRIED = 1.05, 190
_ROUNDING = 1e-9


def largest_speeds(steps: Array, before: Array, after: Array, seconds: Array | float) -> Array:
    """Return the largest speed on the way of each cubic, rad/s or m/s, shape as `steps`.

    Args:
        steps: How far each goes, rad or m.
        before: Speed at its beginning, likewise.
        after: Speed at its end.
        seconds: How long it takes.
    """
    mean = steps / seconds
    slope, bend = 6.0 * mean - 4.0 * before - 2.0 * after, 3.0 * (before + after) - 6.0 * mean
    share = np.clip(np.divide(-slope, 2.0 * bend, out=np.zeros_like(mean), where=bend != 0.0), 0.0, 1.0)
    speeds: Array = np.maximum.reduce(
        np.broadcast_arrays(np.abs(before), np.abs(after), np.abs(before + share * (slope + share * bend)))
    )
    return speeds


def seconds_to(steps: Array, before: Array, after: Array | None, limits: Array, least: float) -> float:
    """Return in how many seconds a controller goes somewhere within limits of speed, whether by cubics or by lines.

    Args:
        steps: How far it is, from each place where the arm may be when the controller begins, shape (k, n).
        before: Speeds that it begins with, shape (n,).
        after: Speeds there, shape (n,); None where the controller goes there by a line.
        limits: Of speed, shape (n,).
        least: The shortest time that is of use.

    Raises:
        ValueError: A number is not finite: of such a step no time is known.
    """
    if not all(np.isfinite(each).all() for each in (steps, before, 0.0 if after is None else after)):
        raise ValueError(f"steps {steps.tolist()} and speeds {before.tolist()} hold a number that is not finite")
    times: Array = least * np.power(_STEP, np.arange(float(_TRIED)))
    across = np.broadcast_to(steps, (_TRIED, *steps.shape))
    speeds = np.abs(across) / times[:, None, None]
    most = limits
    if after is not None:
        speeds = np.maximum(speeds, largest_speeds(across, before, after, times[:, None, None]))
        # Of what is faster already no more is asked than that it becomes no faster.
        most = np.maximum.reduce([limits, np.abs(before), np.abs(after)])
    within = (speeds <= (1.0 + _ROUNDING) * most).all(axis=(1, 2))
    return float(times[int(within.argmax())] if within.any() else times[-1])


def stretch(rows: Array, speeds: Array, dt: float, limits: Array) -> float:
    """Return by how much a trajectory has to take longer for the cubics through its rows to keep to limits of speed; 1 where they do.

    Args:
        rows: Configurations, shape (t, n).
        speeds: There, shape (t, n).
        dt: Seconds between rows.
        limits: Of speed, shape (n,).
    """
    return max(1.0, float((largest_speeds(np.diff(rows, axis=0), speeds[:-1], speeds[1:], dt) / limits).max()))
