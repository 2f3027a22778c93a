"""Convex shape as a grasp planner sees it: its extents, and the lines along which fingers meet it squarely."""

from __future__ import annotations

from collections.abc import Sequence
from typing import assert_never

import numpy as np

from robosandbox.grasp.hand import UP, unit
from robosandbox.shapes.hull import BoxHull, CapsuleHull, CylinderHull, SphereHull
from robosandbox.shapes.polyhedron import PolyhedronHull
from robosandbox.types import Array, DetectedObject
from robosandbox.values import frozen
from robosandbox.world.relations import centre, support

ROUND_DIRECTIONS = 8  # Number of closing lines across a round object, over half a turn. Chosen.
_UPRIGHT = 0.9  # Cosine from which an axis is upright. Chosen: 26 degrees.
# Sine of the angle over the table of a closing line at the most. Chosen because steeper ones would need a finger under the
# object.
STEEPEST = 0.6
_SAME = 0.98  # Cosine from which two faces' normals are the same. Chosen: 11 degrees.
_FACES = 8  # Number of faces of a mesh that are tried, the largest first. Chosen.
_ROLLS = np.radians([0.0, 25.0, -25.0])  # Angles about its axis, radians, at which what lies round is held. Chosen.


@frozen
class ConvexObject:
    """A convex shape where it stands.

    Attributes:
        seen: What perception says of it.
        hull: Corners of its convex hull in its own frame, shape (k, 3); None where kind and size say it all.
    """

    seen: DetectedObject
    hull: Array | None = None

    @property
    def middle(self) -> Array:
        """The middle of its box, world, shape (3,)."""
        return centre(self.seen)

    def support(self, directions: Array) -> Array:
        """Return how far it reaches along unit vectors (n, 3) from the world's origin, shape (n,)."""
        if self.hull is None:
            return support(self.seen, directions)
        corners = self.seen.pose.position + self.hull @ self.seen.pose.rotation.T
        reach: Array = (directions @ corners.T).max(axis=1)
        return reach

    def between(self, closing: Array) -> tuple[float, Array]:
        """Return the extent along a unit vector, metres, and the middle between the surfaces there, shape (3,)."""
        high, low = self.support(np.array([closing, -closing]))
        point = self.middle
        return float(high + low), point + closing * (float(high - low) / 2.0 - float(closing @ point))

    def closings(self) -> list[Array]:
        """Return unit vectors (3,) along which fingers meet it squarely, each up to its sign; none is steep."""
        axes = self.seen.pose.rotation.T
        hull = self.seen.shape.hull(self.seen.size)
        match hull:
            case BoxHull() | PolyhedronHull() if self.hull is not None:
                found = self._across_faces()
            case BoxHull() | PolyhedronHull():
                found = list(axes)
            case CylinderHull() | CapsuleHull():
                found = self._across_axis(axes[2], has_faces=isinstance(hull, CylinderHull))
            case SphereHull():
                found = _compass(UP)
            case _:
                assert_never(hull)
        return [axis for axis in found if abs(axis[2]) < STEEPEST]

    def _across_axis(self, axis: Array, *, has_faces: bool) -> list[Array]:
        if abs(axis[2]) > _UPRIGHT:
            return _compass(axis)
        level = unit(np.cross(axis, UP))
        across = [level * np.cos(roll) + np.cross(axis, level) * np.sin(roll) for roll in _ROLLS]
        # A disc on its edge is held by its faces.
        return [*across, axis] if has_faces else across

    def _across_faces(self) -> list[Array]:
        """Return the normals of the hull's largest faces that have something flat, or an edge, opposite."""
        normals, areas = face_normals(self.hull if self.hull is not None else np.zeros((0, 3)))
        world = normals @ self.seen.pose.rotation.T
        chosen: list[Array] = []
        for index in np.argsort(-areas, kind="stable"):
            normal = world[index]
            if all(abs(float(normal @ other)) < _SAME for other in chosen):
                chosen.append(normal)
            if len(chosen) == _FACES:
                break
        return [*chosen, *_compass(UP)]


def face_normals(corners: Array) -> tuple[Array, Array]:
    """Return the unit normals (f, 3) of a convex hull's flat faces and their areas (f,)."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(corners)
    except QhullError:
        return np.zeros((0, 3)), np.zeros(0)
    normals = hull.equations[:, :3]
    a, b, c = (corners[hull.simplices[:, k]] for k in range(3))
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    # Triangles of one flat face have the same normal.
    rounded, where = np.unique(normals.round(2), axis=0, return_inverse=True)
    total = np.bincount(where.reshape(-1), weights=areas, minlength=len(rounded))
    lengths = np.linalg.norm(rounded, axis=1, keepdims=True)
    directions: Array = rounded / lengths
    return directions, total.astype(np.float64)


def _compass(axis: Array) -> list[Array]:
    """Return directions all round an upright axis (3,), at right angles to it."""
    angles = np.arange(ROUND_DIRECTIONS) * np.pi / ROUND_DIRECTIONS
    flat: Sequence[Array] = [np.array([np.cos(a), np.sin(a), 0.0]) for a in angles]
    return [unit(direction - axis * (axis @ direction)) for direction in flat]
