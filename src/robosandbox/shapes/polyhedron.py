"""Convex polyhedra: pieces of meshes."""

from __future__ import annotations

from typing import Literal

import numpy as np

from robosandbox.spatial import Array, Vec3
from robosandbox.values import frozen


@frozen
class PolyhedronHull:
    """The convex hull of points.

    Attributes:
        points: In its own frame, whose origin is the middle of the box around them, metres.
        form: Tells it from other hulls in JSON.
    """

    points: tuple[Vec3, ...]
    form: Literal["polyhedron"] = "polyhedron"

    @property
    def corners(self) -> Array:
        """The points, shape (k, 3)."""
        return np.array(self.points)

    @property
    def half_extents(self) -> Array:
        """Half-extents of the box around it in its own frame, metres, shape (3,)."""
        half: Array = np.abs(self.corners).max(axis=0)
        return half

    @property
    def radius(self) -> float:
        """Radius of the ball around it, metres."""
        return float(np.linalg.norm(self.corners, axis=1).max())

    @property
    def volume(self) -> float:
        """Cubic metres."""
        return float(np.linalg.det(self._tetrahedra()).sum()) / 6.0

    def support(self, local: Array) -> Array:
        """Return how far it reaches along unit vectors of its own frame, shape (n, 3), metres, shape (n,)."""
        reach: Array = (local @ self.corners.T).max(axis=1)
        return reach

    def inertia(self, mass: float) -> Array:
        """Return the principal inertia (3,) of the solid body about its centre of mass, the least first, kg m^2.

        Second moments of tetrahedra with one corner at the origin (Tonon, Explicit exact formulas for the 3-D tetrahedron
        inertia tensor, 2004).
        """
        corners = self._tetrahedra()
        volumes = np.linalg.det(corners) / 6.0
        sums = corners.sum(axis=1)
        share = volumes / volumes.sum()
        middle = share @ sums / 4.0
        second = np.einsum("t,tki,tkj->ij", share, corners, corners) + np.einsum("t,ti,tj->ij", share, sums, sums)
        second = second / 20.0 - np.outer(middle, middle)
        moments = mass * np.linalg.eigvalsh(np.eye(3) * np.trace(second) - second)
        return np.asarray(moments, dtype=np.float64)

    def _tetrahedra(self) -> Array:
        """Return its surface's triangles, which make tetrahedra with a point inside, seen from there, shape (t, 3, 3)."""
        from scipy.spatial import ConvexHull

        points = self.corners
        hull = ConvexHull(points)
        corners = points[hull.simplices]
        outward = np.einsum(
            "ti,ti->t", np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), hull.equations[:, :3]
        )
        flipped: Array = np.where((outward < 0.0)[:, None, None], corners[:, ::-1], corners)
        return flipped
