"""Views that cameras would have of a scene whose file is known: depths by rays through the drawn shapes, and the shapes' surfaces."""

from __future__ import annotations

import copy
from collections.abc import Iterable

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.motion.robot_shapes import DRAWN_GROUPS
from robosandbox.sim.world import World
from robosandbox.types import Array
from robosandbox.values import frozen

# Groups of the copied model: what is fixed with its parts, things that come and go, what no ray meets.
_FIXED, _THINGS, _UNSEEN = 0, 1, 5
_FARTHEST = 20.0  # Metres; what is farther is not met.
_UNLIMITED = np.pi  # Radians either way that a hinge without stops is looked along.
# Sides of the polygons that stand for circles: of a can of 8 cm they are off by 0.2 mm.
_SIDES = 48


@frozen
class DrawnJoint:
    """Joint of a part.

    Attributes:
        number: Of the joint in the model.
        address: Of its value in the model's positions.
        low: Least value, metres or radians; of a hinge without stops half a turn either way.
        high: Greatest value.
        is_hinge: Whether it turns.
        moved: Ids of the bodies that it moves.
    """

    number: int
    address: int
    low: float
    high: float
    is_hinge: bool
    moved: tuple[int, ...]


class SceneDepths:
    """A world whose parts and things stand as they are believed to, and whose robots no ray meets.

    Args:
        world: The compiled scene.

    Attributes:
        model: A copy of its model.
        data: State of that; whoever changes `qpos` calls `place`.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self.model = copy.copy(world.model)
        self.data = mujoco.MjData(self.model)
        drawn = (world.model.geom_group < DRAWN_GROUPS) & (world.model.geom_rgba[:, 3] > 0.0) & ~world.robot_geoms
        loose = np.zeros(world.model.ngeom, dtype=bool)
        for item in world.scene.objects:
            if not item.is_fixed:
                loose |= np.isin(world.model.geom_bodyid, world.parts[item.id])
        self.model.geom_group[:] = np.where(drawn, np.where(loose, _THINGS, _FIXED), _UNSEEN)

    def place(self) -> None:
        """Work out where everything is by the positions in `data`."""
        mujoco.mj_kinematics(self.model, self.data)

    def cast(self, origin: Array, rays: Array) -> NDArray[np.float32]:
        """Return where rays meet what is fixed or a part of it, in their lengths, (n,), infinite where nothing is met.

        Args:
            origin: Where all begin, world, shape (3,), metres.
            rays: Directions, world, shape (n, 3); with those of a camera's depth 1 a length is a depth.
        """
        groups = np.zeros(6, dtype=np.uint8)
        groups[_FIXED] = 1
        geoms = np.full(len(rays), -1, dtype=np.int32)
        far = np.zeros(len(rays))
        flat = np.ascontiguousarray(rays.ravel())
        mujoco.mj_multiRay(
            self.model, self.data, origin, flat, groups, True, -1, geoms, far, None, len(rays), _FARTHEST
        )
        return np.where(geoms >= 0, far, np.inf).astype(np.float32)

    def joint(self, body: int) -> DrawnJoint:
        """Return the joint of a part's body."""
        model = self.model
        joint = int(model.body_jntadr[body])
        address = int(model.jnt_qposadr[joint])
        limited, start = bool(model.jnt_limited[joint]), float(model.qpos0[address])
        low, high = model.jnt_range[joint] if limited else (start - _UNLIMITED, start + _UNLIMITED)
        moved = [body]
        for other in range(body + 1, model.nbody):
            if int(model.body_parentid[other]) in moved:
                moved.append(other)
        is_hinge = int(model.jnt_type[joint]) == mujoco.mjtJoint.mjJNT_HINGE.value
        return DrawnJoint(joint, address, float(low), float(high), is_hinge, tuple(moved))

    def overlap(self, some: NDArray[np.intp], others: NDArray[np.intp]) -> float:
        """Return how deep some geoms are in others, metres; 0 where they are apart."""
        deepest = 0.0
        for one in some:
            for other in others:
                apart = float(np.linalg.norm(self.data.geom_xpos[one] - self.data.geom_xpos[other]))
                if apart < self.model.geom_rbound[one] + self.model.geom_rbound[other]:
                    deepest = max(
                        deepest, -mujoco.mj_geomDistance(self.model, self.data, int(one), int(other), 0.0, None)
                    )
        return deepest

    def below(self, points: Array, but: int) -> Array:
        """Return the height of what is under points (n, 3), metres, minus infinity where nothing is; a body is left out."""
        found = np.full(len(points), -np.inf)
        groups = np.zeros(6, dtype=np.uint8)
        groups[[_FIXED, _THINGS]] = 1
        hit = np.full(1, -1, dtype=np.int32)
        down = np.array([0.0, 0.0, -1.0])
        for number, point in enumerate(points):
            far = mujoco.mj_ray(self.model, self.data, point, down, groups, True, but, hit)
            if hit[0] >= 0:
                found[number] = point[2] - far
        return found

    def triangles(self, name: str) -> Array:
        """Return the drawn surface of an object in the frame of its first body, triangles (n, 3, 3), metres.

        Call it while everything is where `place` put it: an object of several bodies is taken as it stands.
        """
        bodies = self._world.parts[name]
        turn, origin = self.data.xmat[bodies[0]].reshape(3, 3), self.data.xpos[bodies[0]]
        found = []
        for geom in np.flatnonzero(np.isin(self.model.geom_bodyid, bodies) & (self.model.geom_group != _UNSEEN)):
            local = _triangles(self.model, int(geom))
            if local is not None:
                rotation = turn.T @ self.data.geom_xmat[geom].reshape(3, 3)
                found.append(local @ rotation.T + turn.T @ (self.data.geom_xpos[geom] - origin))
        return np.concatenate([np.zeros((0, 3, 3)), *found])

    def corners(self, bodies: Iterable[int]) -> Array:
        """Return the corners of the boxes around the drawn geoms of some bodies, where they are, shape (n, 3), metres."""
        geoms = np.flatnonzero(np.isin(self.model.geom_bodyid, list(bodies)) & (self.model.geom_group != _UNSEEN))
        boxes = self.model.geom_aabb[geoms]
        signs = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
        local = boxes[:, None, :3] + signs * boxes[:, None, 3:]
        turned = np.einsum("gij,gcj->gci", self.data.geom_xmat[geoms].reshape(-1, 3, 3), local)
        return np.asarray((turned + self.data.geom_xpos[geoms][:, None]).reshape(-1, 3))


def _triangles(model: mujoco.MjModel, geom: int) -> Array | None:
    """Return the surface of a geom in its own frame, triangles (n, 3, 3); None of a plane and of what has none."""
    from trimesh import creation

    size = model.geom_size[geom]
    match mujoco.mjtGeom(int(model.geom_type[geom])):
        case mujoco.mjtGeom.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            begin, number = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
            vertices = model.mesh_vert[first : first + count].astype(float)
            return np.asarray(vertices[model.mesh_face[begin : begin + number]])
        case mujoco.mjtGeom.mjGEOM_BOX:
            made = creation.box(extents=2.0 * size)
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            made = creation.cylinder(radius=size[0], height=2.0 * size[1], sections=_SIDES)
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            made = creation.capsule(radius=size[0], height=2.0 * size[1], count=[_SIDES, _SIDES])
            made.apply_translation(-made.bounds.mean(axis=0))
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            made = creation.icosphere(radius=size[0])
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            made = creation.icosphere(radius=1.0)
            made.apply_scale(size)
        case _:
            return None
    return np.asarray(made.triangles)
