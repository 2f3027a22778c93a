"""Meshes that collide as several convex pieces: each is taken hold of as a solid, where the others leave room."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robosandbox.grasp.solid import Solid
from robosandbox.shapes.box import Box
from robosandbox.types import Array, DetectedObject, Grasp, Pose

# How far inside the surface there must be material under a finger, and outside it none, metres. Chosen because V-HACD's
# voxels of an object of 10 cm are about 2 mm, by which pieces overlap or leave a gap.
_NEAR = 0.003


class Pieces:
    """The convex pieces of an object where it stands.

    Args:
        target: What perception says of it.
        corners: Points that span each piece, in the object's frame, each of shape (k, 3).
    """

    def __init__(self, target: DetectedObject, corners: Sequence[Array]) -> None:
        from scipy.spatial import ConvexHull

        self._target = target
        self._corners = corners
        # Outward normals and offsets: a point p is inside where normal . p + offset <= 0 for all.
        self._planes = [ConvexHull(points).equations for points in corners]

    def solids(self) -> list[Solid]:
        """Return what fingers may close on: every piece, and the hull of all of them."""
        whole = Solid(self._target, _outermost(np.concatenate(self._corners)))
        return [*map(self._solid, self._corners), whole] if len(self._corners) > 1 else [whole]

    def meets(self, grasp: Grasp) -> bool:
        """Tell whether both fingers meet material where they close, with nothing of the object where they are before.

        The hull of one piece says itself where fingers meet it.
        """
        if len(self._planes) == 1:
            return True
        pose = self._target.pose
        middle = (grasp.tcp_pose.position - pose.position) @ pose.rotation
        closing = grasp.tcp_pose.rotation[:, 1] @ pose.rotation
        for side in (closing, -closing):
            if not self._fills(middle + side * (grasp.width / 2.0 - _NEAR)):
                return False
            if self._fills(middle + side * (grasp.width / 2.0 + _NEAR)):
                return False
        return True

    def _fills(self, point: Array) -> bool:
        return any(bool((planes[:, :3] @ point + planes[:, 3] <= 0.0).all()) for planes in self._planes)

    def _solid(self, corners: Array) -> Solid:
        middle, half = (corners.max(axis=0) + corners.min(axis=0)) / 2.0, np.ptp(corners, axis=0) / 2.0
        x, y, z = map(float, middle)
        pose = self._target.pose @ Pose(xyz=(x, y, z))
        return Solid(replace(self._target, kind=Box.kind, size=tuple(map(float, half)), pose=pose), corners - middle)


def _outermost(points: Array) -> Array:
    from scipy.spatial import ConvexHull

    corners: Array = points[ConvexHull(points).vertices]
    return corners
