"""The convex hull of a meshed object, from the model that collision checks use."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.types import Array

_MESH = mujoco.mjtGeom.mjGEOM_MESH.value


def mesh_hull(model: mujoco.MjModel, body: int) -> Array | None:
    """Return points that span the hull of a body's colliding meshes, in its frame, shape (k, 3); None without a mesh."""
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    found = []
    for geom in range(first, first + count):
        solid = model.geom_contype[geom] or model.geom_conaffinity[geom]
        if model.geom_type[geom] != _MESH or not solid:
            continue
        mesh = int(model.geom_dataid[geom])
        start, number = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
        vertices = model.mesh_vert[start : start + number].astype(float)
        found.append(vertices @ rotation.reshape(3, 3).T + model.geom_pos[geom])
    if not found:
        return None
    points = np.concatenate(found)
    from scipy.spatial import ConvexHull, QhullError

    try:
        corners: Array = points[ConvexHull(points).vertices]
    except QhullError:
        return points
    return corners
