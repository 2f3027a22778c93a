"""The bodies of a world as Foxglove's primitives, each in the frame of its body."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.KeyValuePair_pb2 import KeyValuePair
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive
from google.protobuf.timestamp_pb2 import Timestamp

from robosandbox.apps.export.frames import pose, vector
from robosandbox.sim.world import World
from robosandbox.types import Array

# MuJoCo's viewers and cameras show the geometry of groups 0 to 2; what is for collision alone is in the others.
_SHOWN_GROUPS = 3
_GEOM = mujoco.mjtGeom
# What geom_rgba holds where the material's colour counts.
_UNSET_RGBA = (0.5, 0.5, 0.5, 1.0)


def entities(world: World, kinds: dict[str, str], stamp: Timestamp) -> Iterator[SceneEntity]:
    """Yield each body that has a shape: the links of the arm, the table, the objects with what moves in them.

    Args:
        world: The model.
        kinds: Kind of each object by its id, for the metadata.
        stamp: When they are there from.
    """
    model = world.model
    for body, name in enumerate(world.names):
        entity = SceneEntity(timestamp=stamp, frame_id=name, id=name, frame_locked=True)
        if name in kinds:
            entity.metadata.append(KeyValuePair(key="kind", value=kinds[name]))
        first = int(model.body_geomadr[body])
        for geom in range(first, first + int(model.body_geomnum[body])):
            if model.geom_group[geom] < _SHOWN_GROUPS:
                _add(entity, model, geom)
        if entity.cubes or entity.spheres or entity.cylinders or entity.triangles:
            yield entity


def _add(entity: SceneEntity, model: mujoco.MjModel, geom: int) -> None:
    """Add a geom to its body's entity; planes and height fields have no primitive."""
    size, colour = model.geom_size[geom], _colour(model, geom)
    xyz, wxyz = model.geom_pos[geom], model.geom_quat[geom]
    here = pose(xyz, wxyz)
    match int(model.geom_type[geom]):
        case _GEOM.mjGEOM_BOX:
            entity.cubes.append(CubePrimitive(pose=here, size=vector(2.0 * size), color=colour))
        case _GEOM.mjGEOM_SPHERE:
            entity.spheres.append(SpherePrimitive(pose=here, size=vector([2.0 * size[0]] * 3), color=colour))
        case _GEOM.mjGEOM_ELLIPSOID:
            entity.spheres.append(SpherePrimitive(pose=here, size=vector(2.0 * size), color=colour))
        case _GEOM.mjGEOM_CYLINDER | _GEOM.mjGEOM_CAPSULE as kind:
            extent = vector((2.0 * size[0], 2.0 * size[0], 2.0 * size[1]))
            tube = CylinderPrimitive(pose=here, size=extent, bottom_scale=1.0, top_scale=1.0, color=colour)
            entity.cylinders.append(tube)
            if kind == _GEOM.mjGEOM_CAPSULE:
                ball = vector([2.0 * size[0]] * 3)
                for end in (-size[1], size[1]):
                    middle = pose(xyz + _turned(wxyz, np.array([0.0, 0.0, end])), wxyz)
                    entity.spheres.append(SpherePrimitive(pose=middle, size=ball, color=colour))
        case _GEOM.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            entity.triangles.append(
                TriangleListPrimitive(pose=here, points=_points(model, mesh), indices=_faces(model, mesh), color=colour)
            )
        case _:
            pass


def _points(model: mujoco.MjModel, mesh: int) -> list[Point3]:
    first = int(model.mesh_vertadr[mesh])
    vertices = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])]
    return [Point3(x=float(x), y=float(y), z=float(z)) for x, y, z in vertices]


def _faces(model: mujoco.MjModel, mesh: int) -> list[int]:
    first = int(model.mesh_faceadr[mesh])
    faces: list[int] = model.mesh_face[first : first + int(model.mesh_facenum[mesh])].ravel().tolist()
    return faces


def _colour(model: mujoco.MjModel, geom: int) -> Color:
    rgba, material = model.geom_rgba[geom], int(model.geom_matid[geom])
    if material >= 0 and np.allclose(rgba, _UNSET_RGBA):
        rgba = model.mat_rgba[material]
    r, g, b, a = (float(value) for value in rgba)
    return Color(r=r, g=g, b=b, a=a)


def _turned(wxyz: Array, xyz: Array) -> Array:
    found = np.empty(3)
    mujoco.mju_rotVecQuat(found, xyz, wxyz)
    return found
