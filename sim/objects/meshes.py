"""The drawn triangles of objects from OBJ and STL files."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.robots.importers.meshes import add_mesh
from robosandbox.shapes.mesh_file import grouped_mesh, mesh_bounds
from robosandbox.sim.objects.geoms import PREFIX
from robosandbox.types import SceneObject


def add_drawing(spec: mujoco.MjSpec, body: mujoco.MjsBody, item: SceneObject) -> None:
    """Add what is seen of a mesh object, the middle of its box at the body's origin; its pieces collide and weigh.

    Raises:
        InputError: Its file is none, or holds no mesh of a useful size.
    """
    if item.mesh is None:
        return
    name = PREFIX + item.id
    grouped = grouped_mesh(item.mesh)
    if grouped is None:
        spec.add_mesh(name=name, file=str(item.mesh.resolve()), scale=[item.scale] * 3)
    else:
        add_mesh(spec, name, item.scale * grouped.vertices, grouped.faces)
    middle = np.sum(mesh_bounds(item.mesh, item.scale, of=item.id), axis=0) / 2.0
    form = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name, "pos": -middle, "rgba": item.rgba}
    body.add_geom(mass=0.0, contype=0, conaffinity=0, **form)
