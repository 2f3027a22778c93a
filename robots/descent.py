"""Arithmetic of one step of a descent: the turn between two axes, and the Newton step within the limits of joints."""

from __future__ import annotations

import numpy as np

from robosandbox.types import Array, cross


def turn_of_axis(rotation: Array, approach: Array) -> Array:
    """Return the rotation vector (3,) that turns the approach axis of `rotation` (3, 3) into `approach` (3,)."""
    axis = rotation[:, 2]
    turn = cross(axis, approach)
    length = float(np.sqrt(turn @ turn))
    angle = float(np.arctan2(length, axis @ approach))
    if length < 1e-6:
        # Opposite directions: about any axis across.
        turned: Array = rotation[:, 0] * (angle if angle > 1.0 else 0.0)
        return turned
    return turn * (angle / length)


def bounded_step(q: Array, hessian: Array, gradient: Array, lower: Array, upper: Array) -> Array:
    """Return the Newton step (n,) from `q` (n,); a joint that it pushes against its limit is held and it is solved again."""
    try:
        step: Array = np.asarray(np.linalg.solve(hessian, gradient), dtype=float)
    except np.linalg.LinAlgError:
        # Of lengths beyond all measure the damping is lost in rounding: nothing is reached.
        return np.zeros(len(q))
    reached = q + step
    if ((reached >= lower) & (reached <= upper)).all():
        return step
    blocked = ((reached < lower) & (q <= lower)) | ((reached > upper) & (q >= upper))
    if blocked.any() and not blocked.all():
        free = np.flatnonzero(~blocked)
        step = np.zeros(len(q))
        step[free] = np.linalg.solve(hessian[np.ix_(free, free)], gradient[free])
    return step
