"""Objects from OBJ and STL files."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.ranges import LEAST_LENGTH, MOST_LENGTH
from robosandbox.shapes.body import Contact
from robosandbox.sim.objects.geoms import PREFIX, add_geom
from robosandbox.types import Array, SceneObject


def add_mesh(spec: mujoco.MjSpec, body: mujoco.MjsBody, item: SceneObject) -> None:
    """Add a mesh object's geom, the middle of its box at the body's origin.

    Raises:
        InputError: Its file is none, or holds no mesh.
    """
    name = PREFIX + item.id
    if item.mesh is None or not item.mesh.is_file():
        raise InputError(f"objects[{item.id}].mesh: {str(item.mesh)!r} is not a file")
    if item.collision == "coacd":
        raise InputError(f"objects[{item.id}].collision: 'coacd' is not available yet; use 'hull'")
    low, high = mesh_bounds(item)
    spec.add_mesh(name=name, file=str(item.mesh.resolve()), scale=[item.scale] * 3)
    form = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name, "pos": -(low + high) / 2.0}
    add_geom(body, item, Contact(), item.mass, **form)


def mesh_bounds(item: SceneObject) -> tuple[Array, Array]:
    """Return the corners (3,), (3,) of a mesh object's box in its file's frame, metres.

    Raises:
        InputError: The file holds no mesh that MuJoCo can read.
    """
    spec = mujoco.MjSpec()
    spec.add_mesh(name="mesh", file=str(item.mesh and item.mesh.resolve()), scale=[item.scale] * 3)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh")
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"objects[{item.id}].mesh: {str(item.mesh)!r}: {' '.join(str(error).split())}") from None
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[0])
    points = model.mesh_vert[: model.mesh_vertnum[0]] @ rotation.reshape(3, 3).T + model.geom_pos[0]
    low, high = points.min(axis=0), points.max(axis=0)
    longest = float((high - low).max())
    if not LEAST_LENGTH <= longest <= MOST_LENGTH:
        raise InputError(
            f"objects[{item.id}].scale: {item.scale:g} makes it {longest:g} m long, outside {LEAST_LENGTH:g} to "
            f"{MOST_LENGTH:g} m; give metres per unit of the file"
        )
    return low, high
