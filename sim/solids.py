"""Convex pieces of objects, read from the geoms of the compiled model, for judges that do not trust the scene file."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.sim.world import World
from robosandbox.types import Array, Convex, frozen_array
from robosandbox.types.solids import CIRCLE, CORNERS
from robosandbox.values import frozen


@frozen
class _Local:
    """A geom in the frame of its body."""

    body: int
    part: int
    points: Array
    radius: float


class Solids:
    """The geoms of a world's objects.

    Args:
        world: Whose; numbers in its model may not be rewritten afterwards.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self._locals = {
            item.id: () if item.shape.is_granular else tuple(_of_object(world, item.id)) for item in world.scene.objects
        }

    def of(self, data: mujoco.MjData, name: str) -> tuple[Convex, ...]:
        """Return an object's pieces where they are; `data` has up-to-date positions."""
        return tuple(
            Convex(
                points=frozen_array(one.points @ data.xmat[one.body].reshape(3, 3).T + data.xpos[one.body]),
                radius=one.radius,
                part=one.part,
            )
            for one in self._locals[name]
        )


def _of_object(world: World, name: str) -> list[_Local]:
    model, found = world.model, []
    for part, body in enumerate(world.parts[name]):
        first = int(model.body_geomadr[body])
        for geom in range(first, first + int(model.body_geomnum[body])):
            if not model.geom_contype[geom] and not model.geom_conaffinity[geom]:
                # Drawn, and not there.
                continue
            points, radius = _form(model, geom)
            rotation = np.empty(9)
            mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
            local = points @ rotation.reshape(3, 3).T + model.geom_pos[geom]
            found.append(_Local(body=int(body), part=part, points=local, radius=radius))
    return found


def _form(model: mujoco.MjModel, geom: int) -> tuple[Array, float]:
    """Return the points (k, 3) of a geom in its own frame, metres, and the radius around them."""
    size, kinds = model.geom_size[geom], mujoco.mjtGeom
    match mujoco.mjtGeom(int(model.geom_type[geom])):
        case kinds.mjGEOM_SPHERE:
            return np.zeros((1, 3)), float(size[0])
        case kinds.mjGEOM_CAPSULE:
            return np.array([[0.0, 0.0, -size[1]], [0.0, 0.0, size[1]]]), float(size[0])
        case kinds.mjGEOM_CYLINDER:
            rim = size[0] * CIRCLE
            return np.vstack([rim - [0.0, 0.0, size[1]], rim + [0.0, 0.0, size[1]]]), 0.0
        case kinds.mjGEOM_BOX:
            return CORNERS * size, 0.0
        case kinds.mjGEOM_MESH:
            return _hull_of(model, int(model.geom_dataid[geom])), 0.0
        case other:
            raise InputError(
                f"an object has a geom of kind {other.name.removeprefix('mjGEOM_').lower()}, by which nobody can judge it; "
                "make it of spheres, capsules, cylinders, boxes and meshes"
            )


def _hull_of(model: mujoco.MjModel, mesh: int) -> Array:
    """Return the corners of a mesh's hull as MuJoCo collides it, shape (k, 3), metres."""
    start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    vertices = np.asarray(model.mesh_vert[start : start + count], dtype=np.float64)
    graph = int(model.mesh_graphadr[mesh])
    if graph < 0:
        return vertices
    # The graph's layout: number of corners, number of faces, where each corner's edges begin, and the corners' vertices.
    corners = int(model.mesh_graph[graph])
    begin = graph + 2 + corners
    return np.asarray(vertices[model.mesh_graph[begin : begin + corners]])
