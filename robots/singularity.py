"""Singularity measure of an arm that is about to lose a direction of motion."""

from __future__ import annotations

import numpy as np

from robosandbox.robots.kinematics import Kinematics
from robosandbox.types import Array

# Least speed of the tool per speed of the joints, m/rad per metre of reach, below which an arm counts as singular; chosen as
# a twelfth of the 0.38 that the Panda has at home.
_SINGULAR = 0.03
# Least singular value of the Jacobian in units of reach and radians (dimensionless); chosen as a tenth of a joint's own
# effect at full reach.
_STRETCHED = 0.1
# Share of a lost wrench that is a force, above which it is one and no couple; chosen as the half.
_FORCE = 0.5
# Singular value (dimensionless) below which a direction is lost exactly; chosen as a tenth of nearly lost.
_EXACT = 0.1 * _STRETCHED


def conditioning(kinematics: Kinematics, q: Array) -> float:
    """Return how far the arm is at `q` (n,) from losing a direction of motion: 0 singular; metres per radian."""
    position, _ = kinematics.forward(q)
    return float(np.linalg.svd(kinematics.jacobian(position)[:3], compute_uv=False)[-1])


def centring(kinematics: Kinematics, q: Array) -> float:
    """Return how far the joint nearest to a limit is from it at `q` (n,): 0 at the limit, 1 in the middle."""
    half = (kinematics.upper - kinematics.lower) / 2.0
    return float((1.0 - np.abs(q - (kinematics.upper + kinematics.lower) / 2.0) / half).min())


def is_singular(kinematics: Kinematics, q: Array, length: float) -> bool:
    """Tell whether the arm cannot move its tool one way at `q` (n,), or holds a force without its motors.

    An arm that is stretched out, or folded onto its own axis, holds any force along a line without a motor: a direction
    that it has lost is a force. A wrist whose axes line up loses a turn: a couple, of which an arm can make its way out.

    Args:
        kinematics: The arm.
        q: Shape (n,).
        length: How far it reaches, metres; what makes metres comparable to radians.
    """
    if conditioning(kinematics, q) < _SINGULAR * length:
        return True
    lost, _, _ = _lost(kinematics, q, length)
    return bool(lost.size and np.linalg.norm(lost[:3], 2) > _FORCE)


def singularity(kinematics: Kinematics, q: Array, length: float) -> str | None:
    """Say in which way the arm is surely singular at `q` (n,), or None.

    A narrower question than `is_singular`: a start pose with a wrist that is nearly straight is no good choice, and no
    fault either. Stretched out, an arm holds a force along the line from its first joint to its tool without a motor.

    Args:
        kinematics: The arm.
        q: Shape (n,).
        length: How far it reaches, metres.
    """
    ratio = conditioning(kinematics, q) / max(length, 1e-6)
    if ratio < _SINGULAR:
        return f"the tool cannot move one way ({ratio:.3f} m/rad per metre)"
    lost, values, line = _lost(kinematics, q, length)
    if lost.size and float(np.linalg.norm(line @ lost[:3])) > _FORCE:
        return "it is stretched out and cannot move along its own line"
    exact = lost[:, values < _EXACT]
    if exact.size and float(np.linalg.norm(exact[:3], 2)) > _FORCE:
        return "axes of its joints line up and a direction is lost"
    return None


def _lost(kinematics: Kinematics, q: Array, length: float) -> tuple[Array, Array, Array]:
    """Return the wrenches nearly lost at `q` (6, k), their singular values (k,) and the line from root to tool (3,)."""
    position, _ = kinematics.forward(q)
    jacobian = kinematics.jacobian(position)
    jacobian[:3] /= max(length, 1e-6)
    u, s, _ = np.linalg.svd(jacobian, full_matrices=False)
    # Lost directions come together, as in an arm whose elbow and wrist are straight at once: any mixture is lost.
    weak = np.flatnonzero(s[: min(6, kinematics.n)] < _STRETCHED)
    line = position - kinematics.root()
    return u[:, weak], s[weak], line / max(float(np.linalg.norm(line)), 1e-9)
