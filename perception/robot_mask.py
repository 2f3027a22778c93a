"""Where the robot is in a picture: its own shapes, placed by its joints and projected, without drawing the scene again."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from robosandbox.perception.frame import Mask
from robosandbox.robots.robot import Robot
from robosandbox.types import Array, RgbdFrame

_DRAWN_GROUPS = 3
_MARGIN_PIXELS = 3
_NEAR = 0.02
_IN_FRONT = 0.012
_ROUND = 14
_MOST_VERTICES = 150


@dataclass(frozen=True, slots=True)
class _Part:
    body: int
    vertices: Array


class RobotMask:
    """Projects the robot's drawn shapes, each as its convex hull, into cameras.

    It reads the robot's part of a model and keeps data of its own; objects are none of its business.

    Args:
        model: A model with the robot in it.
        robot: The robot bound to it.
    """

    def __init__(self, model: mujoco.MjModel, robot: Robot) -> None:
        self._model = model
        self._robot = robot
        self._data = mujoco.MjData(model)
        parts = [
            _Part(int(model.geom_bodyid[geom]), vertices)
            for geom in range(model.ngeom)
            if int(model.geom_bodyid[geom]) in robot.bodies
            and model.geom_group[geom] < _DRAWN_GROUPS
            and model.geom_rgba[geom, 3] > 0.0
            and (vertices := _vertices(model, geom)) is not None
        ]
        self._bodies = np.array([part.body for part in parts], dtype=int)
        self._vertices = np.vstack([np.zeros((0, 3)), *(part.vertices for part in parts)])
        counts = np.array([len(part.vertices) for part in parts], dtype=int)
        self._part_of = np.repeat(np.arange(len(parts)), counts)
        self._ends = np.concatenate([[0], np.cumsum(counts)])

    def place(self, q: Array, gripper_q: Array) -> None:
        """Put the robot as its encoders say it stood."""
        self._data.qpos[self._robot.qpos_indices] = q
        if self._robot.gripper is not None and len(gripper_q):
            self._data.qpos[self._robot.gripper.joint_indices] = gripper_q
        mujoco.mj_kinematics(self._model, self._data)

    def masks(self, rgbd: RgbdFrame, carried: Array | None = None) -> tuple[Mask, NDArray[np.float32]]:
        """Return where the robot is, and how near its nearest part there may be; call `place` first.

        Args:
            rgbd: Gives the camera; a distorted picture is taken as straightened.
            carried: Points of the world (n, 3) whose hull is what the hand holds: it counts as part of the robot.

        Returns:
            The mask (height, width), a few pixels wider than the robot, and depths (height, width), metres: what is
            nearer than these stands before the robot.
        """
        lens, pose = rgbd.intrinsics, rgbd.pose_camera_in_world
        nearest = np.full((lens.height, lens.width), np.inf, dtype=np.float32)
        rotation, position = pose.rotation, pose.position
        # All vertices at once: body to world to camera is one rotation and one shift for each part.
        turns = rotation.T @ self._data.xmat[self._bodies].reshape(-1, 3, 3)
        shifts = (self._data.xpos[self._bodies] - position) @ rotation
        every = np.einsum("nij,nj->ni", turns[self._part_of], self._vertices) + shifts[self._part_of]
        ends = list(self._ends)
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


def _vertices(model: mujoco.MjModel, geom: int) -> Array | None:
    """Return points whose hull is the geom, in its body's frame, (n, 3)."""
    size = model.geom_size[geom]
    match mujoco.mjtGeom(int(model.geom_type[geom])):
        case mujoco.mjtGeom.mjGEOM_BOX:
            local = _corners() * size
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            local = _ball() * size[0]
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            local = _ball() * size
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            ball = _ball() * size[0]
            local = np.vstack([ball + [0.0, 0.0, size[1]], ball - [0.0, 0.0, size[1]]])
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            ring = _ring() * size[0]
            local = np.vstack([ring + [0.0, 0.0, size[1]], ring - [0.0, 0.0, size[1]]])
        case mujoco.mjtGeom.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            local = _thinned(model.mesh_vert[first : first + count].astype(np.float64))
        case _:
            return None
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
    points: Array = local @ rotation.reshape(3, 3).T + model.geom_pos[geom]
    return points


def _thinned(vertices: Array) -> Array:
    """Return the extreme ones of a mesh's vertices: those of its hull, of many the ones that reach farthest some way."""
    try:
        hull = np.array(vertices[ConvexHull(vertices).vertices])
    except QhullError:
        # A flat mesh has no volume; all its vertices are extreme.
        hull = vertices
    if len(hull) <= _MOST_VERTICES:
        return hull
    # Spread evenly over the sphere (Fibonacci's lattice).
    heights = 1.0 - (2.0 * np.arange(_MOST_VERTICES) + 1.0) / _MOST_VERTICES
    angles = np.arange(_MOST_VERTICES) * np.pi * (3.0 - np.sqrt(5.0))
    across = np.sqrt(1.0 - heights**2)
    directions = np.column_stack([across * np.cos(angles), across * np.sin(angles), heights])
    return np.array(hull[np.unique((hull @ directions.T).argmax(axis=0))])


def _corners() -> Array:
    return np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


def _ring() -> Array:
    angles = np.arange(_ROUND) * 2.0 * np.pi / _ROUND
    # On the circle that has the same area on average as the ring has between its corners.
    wide = 1.0 / float(np.sqrt(np.cos(np.pi / _ROUND)))
    return wide * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(_ROUND)])


def _ball() -> Array:
    rings = [
        np.column_stack([_ring()[:, :2] * np.cos(tilt), np.full(_ROUND, np.sin(tilt))])
        for tilt in np.radians([-60.0, -30.0, 0.0, 30.0, 60.0])
    ]
    return np.vstack([*rings, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
