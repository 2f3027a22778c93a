"""Mask of the robots in a picture: their own shapes, placed by their joints and projected, without rendering."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.motion.robot_shapes import RobotShapes
from robosandbox.perception.frame import Mask
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.types import Array, Posture, RgbdFrame

# Pixels around the robot that are taken for it, because errors of joints and calibration move its outline. Chosen.
_MARGIN_PIXELS = 3
_NEAR = 0.02  # Depth, metres, below which a point of the robot is taken to be in the lens. Chosen.
_FARTHEST_PIXEL = (
    30000  # Pixels from the picture's corner, at most, of an outline's corner: OpenCV counts them in 16 bits.
)
_IN_FRONT = 4.0 * TOLERANCES.depth  # Metres before the robot from which something stands in front of it.


class RobotMask:
    """Projects the robots' drawn shapes, each as its convex hull, into cameras.

    Args:
        shapes: Those of all robots.
    """

    def __init__(self, shapes: RobotShapes) -> None:
        self._shapes = shapes

    def place(self, arms: Mapping[str, Posture]) -> None:
        """Put the robots as their encoders say they stood."""
        self._shapes.place(arms)

    def masks(self, rgbd: RgbdFrame, carried: Sequence[Array] = ()) -> tuple[Mask, NDArray[np.float32]]:
        """Return where robots are, and how near their nearest part there may be; call `place` first.

        Args:
            rgbd: Gives the camera; a distorted picture is taken as straightened.
            carried: Points of the world, each (n, 3), whose hull is what a hand holds: it counts as part of the robot.

        Returns:
            The mask (height, width), a few pixels wider than the robot, and depths (height, width), metres: what is
            nearer than these stands before the robot.
        """
        shapes = self._shapes
        lens, pose = rgbd.intrinsics, rgbd.pose_camera_in_world
        nearest = np.full((lens.height, lens.width), np.inf, dtype=np.float32)
        rotation, position = pose.rotation, pose.position
        # All vertices at once: body to world to camera is one rotation and one shift for each part.
        turns = rotation.T @ shapes.rotations
        shifts = (shapes.positions - position) @ rotation
        every = np.einsum("nij,nj->ni", turns[shapes.part_of], shapes.vertices) + shifts[shapes.part_of]
        ends = list(shapes.ends)
        for points in carried:
            every = np.vstack([every, (points - position) @ rotation])
            ends.append(len(every))
        every, bounds = _before_lens(every, np.array(ends, dtype=np.intp))
        depths = every[:, 2]
        flat = every[:, :2] / depths[:, None] * [lens.fx, lens.fy] + [lens.cx, lens.cy]
        first = bounds[:-1]
        near = np.minimum.reduceat(depths, first)
        inside = (np.maximum.reduceat(flat, first) >= 0).all(axis=1)
        inside &= (np.minimum.reduceat(flat, first) <= [lens.width, lens.height]).all(axis=1)
        seen = np.flatnonzero(inside)
        corners = np.clip(flat, -_FARTHEST_PIXEL, _FARTHEST_PIXEL).astype(np.float32)
        # Near parts last, so that the nearest depth stays.
        for part in seen[np.argsort(-near[seen], kind="stable")]:
            outline = cv2.convexHull(corners[bounds[part] : bounds[part + 1]]).astype(np.int32)
            depth = float(near[part]) - _IN_FRONT
            cv2.fillConvexPoly(nearest, outline, depth)
            cv2.polylines(nearest, [outline], True, depth, 2 * _MARGIN_PIXELS)
        return np.isfinite(nearest), nearest


def _before_lens(points: Array, ends: NDArray[np.intp]) -> tuple[Array, NDArray[np.intp]]:
    """Return the parts' points in the camera's frame, with what of each part's hull is behind the lens cut off.

    Args:
        points: Of all parts, (n, 3).
        ends: Where each part's points end, with a 0 before the first, (parts + 1,).

    Returns:
        Points and ends of the parts that have something before the lens, in their order.
    """
    behind = points[:, 2] < _NEAR
    if not behind.any():
        return points, ends
    kept: list[Array] = []
    for begin, end in itertools.pairwise(ends):
        part, hidden = points[begin:end], behind[begin:end]
        if hidden.all():
            continue
        if hidden.any():
            # Of the hull's section with the plane, each corner lies between a point before it and one behind it.
            front, back = part[~hidden][:, None], part[hidden][None]
            share = (front[..., 2:] - _NEAR) / (front[..., 2:] - back[..., 2:])
            part = np.vstack([part[~hidden], (front + share * (back - front)).reshape(-1, 3)])
        kept.append(part)
    return np.vstack([np.zeros((0, 3)), *kept]), np.cumsum([0, *map(len, kept)])
