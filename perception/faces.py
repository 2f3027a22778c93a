"""The faces of a fitted shape on which surface points lie."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robosandbox.perception.evidence import SurfacePoints
from robosandbox.perception.support import Form
from robosandbox.types import Array


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
