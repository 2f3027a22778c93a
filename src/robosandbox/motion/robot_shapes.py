"""Drawn shapes of the robots of a cell as points, placed by their joints."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.robots.robot import Robot
from robosandbox.types import Array, Posture
from robosandbox.values import frozen

# Geoms of these groups are drawn, as MuJoCo's own viewer does by default.
DRAWN_GROUPS = 3
# Corners of the polygons that stand for circles; chosen: a circle of 20 pixels is off by half a pixel.
_ROUND = 14
# The most points kept of one mesh; chosen: more do not change its outline by a pixel at 640 x 480.
_MOST_VERTICES = 150


@frozen
class _Part:
    body: int
    vertices: Array


class RobotShapes:
    """Points whose convex hulls, part by part, are the robots as they are drawn.

    Args:
        model: A model with the robots in it; of its objects nothing is read.
        robots: The robots bound to it, by the name of their arm.

    Attributes:
        vertices: All parts' points, each in the frame of its body, metres, shape (k, 3).
        part_of: The part that each point belongs to, shape (k,).
        ends: Where each part's points end among all, with a 0 before the first, shape (parts + 1,).
    """

    def __init__(self, model: mujoco.MjModel, robots: Mapping[str, Robot]) -> None:
        self._model = model
        self._robots = robots
        self._data = mujoco.MjData(model)
        bodies = frozenset().union(*(robot.bodies for robot in robots.values()))
        parts = [
            _Part(int(model.geom_bodyid[geom]), vertices)
            for geom in range(model.ngeom)
            if int(model.geom_bodyid[geom]) in bodies
            and model.geom_group[geom] < DRAWN_GROUPS
            and model.geom_rgba[geom, 3] > 0.0
            and (vertices := _vertices(model, geom)) is not None
        ]
        self._bodies = np.array([part.body for part in parts], dtype=int)
        self.vertices: Array = np.vstack([np.zeros((0, 3)), *(part.vertices for part in parts)])
        counts = np.array([len(part.vertices) for part in parts], dtype=int)
        self.part_of: NDArray[np.intp] = np.repeat(np.arange(len(parts)), counts)
        self.ends: NDArray[np.intp] = np.concatenate([[0], np.cumsum(counts)])

    def place(self, arms: Mapping[str, Posture]) -> None:
        """Put the robots as their encoders say they stood.

        Args:
            arms: Postures by the name of the arm; the joints of a gripper are left as they are where there are none.
        """
        for name, posture in arms.items():
            robot = self._robots[name]
            self._data.qpos[robot.qpos_indices] = posture.q
            if robot.gripper is not None and len(posture.gripper_q):
                self._data.qpos[robot.gripper.joint_indices] = posture.gripper_q
        mujoco.mj_kinematics(self._model, self._data)

    @property
    def rotations(self) -> Array:
        """Each part's rotation from its body's frame to the world, shape (parts, 3, 3)."""
        rotations: Array = self._data.xmat[self._bodies].reshape(-1, 3, 3)
        return rotations

    @property
    def positions(self) -> Array:
        """Position of each part's body in the world, metres, shape (parts, 3)."""
        positions: Array = self._data.xpos[self._bodies]
        return positions


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
    from scipy.spatial import ConvexHull, QhullError

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
