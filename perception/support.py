"""Support functions of the shapes that are fitted: h(m) = max over a shape's points of m . x, linear in centre and sizes.

(Boyd and Vandenberghe, Convex Optimization, 2.5.)
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from robosandbox.perception.evidence import SurfacePoints
from robosandbox.types import Array

Form = Literal["box", "cylinder", "lying", "sphere"]
SIZES: dict[Form, int] = {"box": 3, "cylinder": 2, "lying": 2, "sphere": 1}
# After so much of a turn a shape looks the same; 0 where it always does.
TURNS: dict[Form, float] = {"box": np.pi / 2.0, "cylinder": 0.0, "lying": np.pi, "sphere": 0.0}

# Numbers below this are rounding errors of unit vectors' coordinates. Chosen far above 2e-16, far below what matters.
_ROUNDING = 1e-12


def axes_of(shape: Form, yaw: float) -> Array:
    """Return the axes (3, 3), as columns, of a shape at a heading."""
    c, s = np.cos(yaw), np.sin(yaw)
    if shape == "lying":
        # The axis comes last and lies along the heading.
        return np.array([[0.0, -s, c], [0.0, c, s], [-1.0, 0.0, 0.0]])
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def support_terms(shape: Form, yaw: float | Array, normals: Array) -> Array:
    """Return d h(m) / d sizes for unit vectors m (n, 3): (n, k), or (g, n, k) for g headings."""
    headings = np.asarray(yaw)
    terms = np.empty((*headings.shape, len(normals), SIZES[shape]))
    if shape == "sphere":
        terms[:] = 1.0
        return terms
    x, y, z = normals.T
    c, s = np.cos(headings)[..., None], np.sin(headings)[..., None]
    if shape == "box":
        terms[..., 0] = np.abs(c * x + s * y)
        terms[..., 1] = np.abs(c * y - s * x)
        terms[..., 2] = np.abs(z)
        return terms
    axial = np.abs(z) if shape == "cylinder" else np.abs(c * x + s * y)
    terms[..., 0] = np.sqrt(np.maximum(1.0 - axial * axial, 0.0))
    terms[..., 1] = axial
    return terms


def turn_terms(shape: Form, yaw: float, normals: Array) -> Array:
    """Return the derivatives (n, k) of `support_terms` by the heading; where it has an edge the mean of both sides."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = normals[:, 0], normals[:, 1]
    ahead, aside = c * x + s * y, c * y - s * x
    terms = np.zeros((len(normals), SIZES[shape]))
    if shape == "box":
        terms[:, 0] = _sign(ahead) * aside
        terms[:, 1] = -_sign(aside) * ahead
    elif shape == "lying":
        terms[:, 1] = _sign(ahead) * aside
        terms[:, 0] = -ahead * aside / np.sqrt(np.maximum(1.0 - ahead**2, 1e-9))
    return terms


def _sign(values: Array) -> Array:
    """Return the signs of numbers; those of rounding errors are 0, as a normal across an edge belongs to neither side."""
    return np.asarray(np.sign(values) * (np.abs(values) > _ROUNDING))


def faces_of(
    shape: Form, centre: Array, sizes: Array, axes: Array, surface: SurfacePoints
) -> tuple[Array, NDArray[np.intp] | None, Array]:
    """Return the faces that points lie on, of those that the camera sees.

    Returns:
        Their outward normals (j, 3); which of them each point lies on, (n,), None where each has one of its own; and how
        far out of it each point is, (n,), metres.
    """
    if shape == "box":
        local = axes.T @ surface.rows - (axes.T @ centre)[:, None]
        away = (axes.T @ surface.rows_to_camera) < 0.0
        out = np.where(away, -local, local) - sizes[:, None]
        face = (out[1] > out[0]).astype(np.intp)
        most = np.maximum(out[0], out[1])
        face[out[2] > most] = 2
        # The faces' normals, those that point against the axes last.
        face += 3 * away.take(face * away.shape[1] + np.arange(away.shape[1]))
        return np.concatenate([axes.T, -axes.T]), face, np.maximum(most, out[2])
    offset = surface.points - centre
    if shape == "sphere":
        length = _lengths(offset)
        return offset / np.maximum(length, 1e-9)[:, None], None, length - sizes[0]
    axis = axes[:, 2]
    along = offset @ axis
    across = offset - along[:, None] * axis
    radius = _lengths(across)
    sign = np.copysign(1.0, surface.to_camera @ axis)
    above, beside = sign * along - sizes[1], radius - sizes[0]
    flat = above > beside
    across /= np.maximum(radius, 1e-9)[:, None]
    across[flat] = sign[flat, None] * axis
    return across, None, np.maximum(above, beside)


def _lengths(vectors: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))
