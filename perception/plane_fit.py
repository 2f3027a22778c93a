"""Planes fitted to points: how far a board's face tilts from the vertical."""

from __future__ import annotations

import numpy as np

from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.types import Array

# Number of triples of points that are tried (RANSAC, Fischler and Bolles 1981), so that with 30 % of the points in the plane
# a triple in it is missed in 4 % of the cases.
_DRAWS = 120
_MUCH_OF_IT = 0.3  # Share of the points that must be in it. Chosen.
_LEAST_LEAN = np.radians(8.0)  # Angle in radians from which a plane is no top. Chosen: what the fits forgive.
_MOST_LEAN = np.radians(65.0)  # Angle in radians from which it is a side. Chosen.


def plane_tilt(points: Array) -> Array | None:
    """Return the least rotation (3, 3) that takes the vertical to the normal of the points' plane, if that is oblique.

    The plane is the best of many through three points (Fischler and Bolles, Random Sample Consensus, 1981).
    """
    rng = np.random.default_rng(0)
    a, b, c = (points[rng.integers(len(points), size=_DRAWS)] for _ in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    normals, starts = normals[lengths > 1e-6] / lengths[lengths > 1e-6, None], a[lengths > 1e-6]
    if not len(normals):
        return None
    near = np.abs(points @ normals.T - np.einsum("ij,ij->i", normals, starts)) < TOLERANCES.depth
    best = near[:, int(near.sum(axis=0).argmax())]
    if best.mean() < _MUCH_OF_IT:
        return None
    chosen = points[best]
    normal = np.linalg.svd(chosen - chosen.mean(axis=0), full_matrices=False)[2][2]
    normal = normal * np.sign(normal[2])
    if not _LEAST_LEAN < np.arccos(np.clip(normal[2], -1.0, 1.0)) < _MOST_LEAN:
        return None
    x, y, z = normal
    # Rodrigues' rotation about the horizontal axis across the normal's slope.
    return np.array(
        [
            [1.0 - x * x / (1.0 + z), -x * y / (1.0 + z), x],
            [-x * y / (1.0 + z), 1.0 - y * y / (1.0 + z), y],
            [-x, -y, z],
        ]
    )
