"""Inertias that a body can have, and what to put in place of those it cannot."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.types import Array
from robosandbox.values import frozen

_DENSITY = 500.0  # Kilograms per cubic metre of a link of which nobody says the mass. Chosen between foam and steel.
_LEAST_MASS = 1e-3  # Mass of a link at the least, kg. Chosen because MuJoCo refuses moving bodies without mass.
# Principal inertia, kg m^2, at the least. Chosen because MuJoCo refuses moving bodies without inertia.
_LEAST_INERTIA = 1e-8
# Ratio by which the largest principal inertia may exceed the sum of the others, because files round. Chosen.
_TRIANGLE_SLACK = 1e-3


@frozen
class Inertial:
    """Mass (kg), centre of mass in the body frame (3,), inertia about it in body axes (3, 3)."""

    mass: float
    centre: Array
    matrix: Array


def fault(mass: float, matrix: Array) -> str | None:
    """Return what is impossible about an inertia, or None."""
    if not np.isfinite(mass) or not np.isfinite(matrix).all():
        return "is not finite"
    if mass <= 0.0:
        return f"has mass {mass:g}"
    principal = np.linalg.eigvalsh((matrix + matrix.T) / 2.0)
    if principal[0] <= 0.0:
        return f"has a principal moment of {principal[0]:.2g} kg m^2"
    if principal[2] > (principal[0] + principal[1]) * (1.0 + _TRIANGLE_SLACK):
        return "has a principal moment larger than the other two together"
    if np.sqrt(principal[2] / mass) > 5.0:
        return f"is spread over {np.sqrt(principal[2] / mass):.0f} m"
    return None


def of_box(low: Array, high: Array, mass: float | None = None) -> Inertial:
    """Return the inertia of a solid box with corners `low` and `high` (3,), of a plausible or a given mass."""
    size = np.maximum(high - low, 1e-3)
    weight = max(_LEAST_MASS, _DENSITY * 0.5 * float(np.prod(size))) if mass is None else mass
    square = size**2
    moments = np.maximum(weight / 12.0 * (square.sum() - square), _LEAST_INERTIA)
    return Inertial(weight, (low + high) / 2.0, np.diag(moments))


def write(body: mujoco.MjsBody, inertial: Inertial | None) -> None:
    """Give a body this inertia and no other; None makes it massless."""
    body.explicitinertial = True
    if inertial is None:
        body.mass, body.inertia = 0.0, [0.0, 0.0, 0.0]
        return
    moments, axes = np.linalg.eigh((inertial.matrix + inertial.matrix.T) / 2.0)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, axes.flatten())
    body.mass = inertial.mass
    body.ipos = inertial.centre
    body.iquat = quat
    body.inertia = np.maximum(moments, _LEAST_INERTIA / 100.0)
