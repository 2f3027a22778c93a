"""Where the robot is in a picture: its own shapes, placed by its joints and projected, without drawing the scene again."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.motion.robot_shapes import RobotShapes
from robosandbox.perception.frame import Mask
from robosandbox.types import Array, RgbdFrame

# Pixels around the robot that are taken for it, because errors of joints and calibration move its outline. Chosen.
_MARGIN_PIXELS = 3
_NEAR = 0.02  # Depth, metres, below which a point of the robot is taken to be in the lens. Chosen.
_IN_FRONT = 0.012  # Metres before the robot from which something stands in front of it. Chosen above the depth noise.


class RobotMask:
    """Projects the robot's drawn shapes, each as its convex hull, into cameras.

    Args:
        shapes: The robot's.
    """

    def __init__(self, shapes: RobotShapes) -> None:
        self._shapes = shapes

    def place(self, q: Array, gripper_q: Array) -> None:
        """Put the robot as its encoders say it stood."""
        self._shapes.place(q, gripper_q)

    def masks(self, rgbd: RgbdFrame, carried: Array | None = None) -> tuple[Mask, NDArray[np.float32]]:
        """Return where the robot is, and how near its nearest part there may be; call `place` first.

        Args:
            rgbd: Gives the camera; a distorted picture is taken as straightened.
            carried: Points of the world (n, 3) whose hull is what the hand holds: it counts as part of the robot.

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
        if carried is not None:
            every = np.vstack([every, (carried - position) @ rotation])
            ends.append(len(every))
        depths = np.maximum(every[:, 2], _NEAR)
        flat = every[:, :2] / depths[:, None] * [lens.fx, lens.fy] + [lens.cx, lens.cy]
        first = np.array(ends[:-1], dtype=int)
        near = np.minimum.reduceat(depths, first)
        ahead = np.maximum.reduceat(every[:, 2], first) >= _NEAR
        inside = (np.maximum.reduceat(flat, first) >= 0).all(axis=1)
        inside &= (np.minimum.reduceat(flat, first) <= [lens.width, lens.height]).all(axis=1)
        seen = np.flatnonzero(ahead & inside)
        corners = np.clip(flat, -4000, 4000).astype(np.float32)
        # Near parts last, so that the nearest depth stays.
        for part in seen[np.argsort(-near[seen], kind="stable")]:
            outline = cv2.convexHull(corners[ends[part] : ends[part + 1]]).astype(np.int32)
            depth = float(near[part]) - _IN_FRONT
            cv2.fillConvexPoly(nearest, outline, depth)
            cv2.polylines(nearest, [outline], True, depth, 2 * _MARGIN_PIXELS)
        return np.isfinite(nearest), nearest
