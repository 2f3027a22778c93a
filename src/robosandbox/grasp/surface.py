"""Surface of a union of convex pieces: sampled points, and the intersections of lines with it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robosandbox.types import Array, Pose

# Metres between points that are looked at on the surface; chosen as half of a narrow pad's width.
_SPACING = 0.007
# Number of such points at the most, and at the least so many on a face. Chosen: they cost 0.1 ms each.
_MOST_POINTS = 600
# Metres up to which a gap between two pieces is none, and by which pieces lie in one another; chosen as a voxel of V-HACD's
# on a thing of 10 cm (200,000 of them fill its box).
_SEAM = 0.002
# Cosine between a closing line and the normals of the surface at both ends, from which it holds there. Chosen: 37 degrees,
# within the 45 of friction of 1, because what tapers more is squeezed out.
_SQUARE = 0.8
_ON = 1e-6  # Metres to a plane of a piece within which a point is on it. Chosen as rounding's.
# Two coordinates (the plastic number's powers) of an even sequence on a square (M. Roberts, The unreasonable effectiveness of
# quasirandom sequences, 2018).
_EVEN = np.array([0.7548776662466927, 0.5698402909980532])


class Surface:
    """The union of convex pieces where it stands.

    Args:
        pose: Of the object.
        corners: Points that span each piece, in the object's frame, each (k, 3).
    """

    def __init__(self, pose: Pose, corners: Sequence[Array]) -> None:
        from scipy.spatial import ConvexHull

        self.corners = [pose.position + points @ pose.rotation.T for points in corners]
        self._hulls = [ConvexHull(points) for points in self.corners]
        # Outward normals and offsets of all pieces: a point p is inside one where normal . p + offset <= 0 for all its planes.
        self._planes = np.concatenate([hull.equations for hull in self._hulls])
        self._begins = np.cumsum([0, *(len(hull.equations) for hull in self._hulls[:-1])])

    @cached_property
    def middle(self) -> Array:
        """Centre of mass, if the density is the same all through, shape (3,)."""
        volumes = np.array([hull.volume for hull in self._hulls])
        middles = np.array([points.mean(axis=0) for points in self.corners])
        weighed: Array = volumes @ middles / volumes.sum()
        return weighed

    def support(self, direction: Array) -> float:
        """Return how far it reaches along a unit vector (3,) from the world's origin, metres."""
        return max(float((points @ direction).max()) for points in self.corners)

    def through(self, points: Array, direction: Array) -> tuple[Array, Array]:
        """Return where lines enter and leave each piece, metres along them from their points, each (lines, pieces).

        Args:
            points: One on each line, shape (lines, 3).
            direction: Unit vector of all of them, shape (3,).

        Where a line misses a piece it enters at infinity and leaves at minus infinity.
        """
        normals, offsets = self._planes[:, :3], self._planes[:, 3]
        slope = normals @ direction
        height = points @ normals.T + offsets
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = -height / slope
        flat = np.abs(slope) < 1e-9
        enters = np.where(slope < 0.0, crossing, -np.inf)
        leaves = np.where(slope > 0.0, crossing, np.inf)
        outside = flat & (height > 0.0)
        enters = np.where(flat, np.where(outside, np.inf, -np.inf), enters)
        leaves = np.where(flat, np.where(outside, -np.inf, np.inf), leaves)
        first = np.maximum.reduceat(enters, self._begins, axis=1)
        last = np.minimum.reduceat(leaves, self._begins, axis=1)
        missed = first >= last
        return np.where(missed, np.inf, first), np.where(missed, -np.inf, last)

    def covers(self, points: Array) -> NDArray[np.bool_]:
        """Tell of each point (k, 3) whether it is inside, shape (k,)."""
        height = points @ self._planes[:, :3].T + self._planes[:, 3]
        return np.asarray((np.maximum.reduceat(height, self._begins, axis=1) <= 0.0).any(axis=1))

    @cached_property
    def points(self) -> tuple[Array, Array]:
        """Points spread evenly over the outside and the outward normals there, each (k, 3): the same ones each time."""
        found, normals = [], []
        for hull, corners in zip(self._hulls, self.corners, strict=True):
            triangles = corners[hull.simplices]
            areas = np.linalg.norm(
                np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
            )
            counts = np.maximum(1, np.round(areas / 2.0 / _SPACING**2)).astype(int)
            which = np.repeat(np.arange(len(counts)), counts)
            u, v = ((0.5 + np.arange(1, len(which) + 1)[:, None] * _EVEN) % 1.0).T
            u, v = np.where(u + v > 1.0, 1.0 - u, u)[:, None], np.where(u + v > 1.0, 1.0 - v, v)[:, None]
            a, b, c = triangles[which].transpose(1, 0, 2)
            found.append(a + u * (b - a) + v * (c - a))
            normals.append(hull.equations[which, :3])
        points, outward = np.concatenate(found), np.concatenate(normals)
        free = ~self.covers(points + _SEAM * outward)
        points, outward = points[free], outward[free]
        step = max(1, -(-len(points) // _MOST_POINTS))
        return points[::step], outward[::step]

    @cached_property
    def lines(self) -> tuple[Array, Array, Array]:
        """Closing lines: middles (k, 3), unit vectors (k, 3) and widths (k,) of what two points of the surface hold between them.

        Each goes through a point of the surface at a right angle, to where what is under it ends, or to where the whole does, over
        gaps that fingers do not come into; nearly at a right angle there, too.
        """
        points, normals = self.points
        ends = [self._ends(point, -normal) for point, normal in zip(points, normals, strict=True)]
        owner = np.array([k for k, found in enumerate(ends) for _ in found], dtype=int)
        widths = np.array([width for found in ends for width, _ in found])
        squarely = np.array([square for found in ends for _, square in found]) > _SQUARE
        owner, widths = owner[squarely], widths[squarely]
        return points[owner] - normals[owner] * (widths / 2.0)[:, None], normals[owner], widths

    def _ends(self, point: Array, inward: Array) -> list[tuple[float, float]]:
        """Return how far what is under a point of the surface goes on, and the whole, metres, each with the cosine at which the line leaves."""
        enters, leaves = self.through(point[None], inward)
        end, piece = 0.0, -1
        for index in np.argsort(enters[0], kind="stable"):
            if enters[0][index] <= end + _SEAM and leaves[0][index] > end:
                end, piece = float(leaves[0][index]), int(index)
        last = int(leaves[0].argmax())
        beyond = float(leaves[0][last])
        found = [] if piece < 0 else [(end, self._squareness(point + end * inward, inward, piece))]
        return found + (
            [(beyond, self._squareness(point + beyond * inward, inward, last))] if beyond > end + _SEAM else []
        )

    def meets_squarely(self, points: Array, direction: Array) -> bool:
        """Tell whether a line along a unit vector (3,) leaves the surface squarely enough to be held there, at one of some points (k, 3)."""
        normals, offsets = self._planes[:, :3], self._planes[:, 3]
        at = np.abs(points @ normals.T + offsets) < _ON
        return bool((at & (normals @ direction > _SQUARE)).any())

    def _squareness(self, point: Array, direction: Array, piece: int) -> float:
        """Return the cosine between a direction and the normal of a piece where it is left."""
        planes = self._hulls[piece].equations
        left = planes[np.abs(planes[:, :3] @ point + planes[:, 3]) < _ON]
        return float((left[:, :3] @ direction).max(initial=0.0))
