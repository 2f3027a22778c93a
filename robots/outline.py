"""Outline of an arm from its compiled model: extreme points of its links, and the axes that move them."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from robosandbox.robots.robot import Gripper
from robosandbox.types import Array, frozen_array
from robosandbox.types.outline import Outline

# Directions in which a mesh's extreme vertices are taken: to the corners, edges and faces of a cube.
_DIRECTIONS = np.array(
    [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)]
)
_CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
# Corners of the polygon that stands for a circle, on it.
_RING = np.column_stack([np.cos(np.arange(8) * np.pi / 4.0), np.sin(np.arange(8) * np.pi / 4.0), np.zeros(8)])


def outline_of(
    model: mujoco.MjModel, joints: Sequence[int], bodies: frozenset[int], gripper: Gripper | None, prefix: str
) -> Outline | None:
    """Return an arm's outline; None where its joints do not follow one another from base to tool.

    What another joint than the arm's moves, short of the last of them, is left out: where it is, the joints do not tell.

    Args:
        model: Compiled, with the robot in it.
        joints: Ids of the arm's joints, from base to tool.
        bodies: The robot's.
        gripper: It is taken opened.
        prefix: What the names of the robot's bodies begin with in the model.
    """
    data = mujoco.MjData(model)
    data.qpos[model.jnt_qposadr[list(joints)]] = 0.0
    if gripper is not None:
        data.qpos[gripper.joint_indices] = gripper.joints_at(gripper.geometry.open_joint)
    mujoco.mj_kinematics(model, data)
    before: dict[int, int | None] = {0: 0}
    for body in range(1, model.nbody):
        if body in bodies:
            first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
            before[body] = _moved(before.get(int(model.body_parentid[body]), 0), range(first, first + count), joints)
    if before[int(model.jnt_bodyid[joints[-1]])] != len(joints):
        return None
    links: list[str] = []
    points, radii, moved, link_of = [], [], [], []
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        count_before = before.get(body) if body in bodies else None
        # What never moves is no command's doing.
        if not count_before or not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
            continue
        local, radius = _extreme(model, geom)
        name = model.body(body).name.removeprefix(prefix)
        if name not in links:
            links.append(name)
        points.append(local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
        radii += [radius] * len(local)
        moved += [count_before] * len(local)
        link_of += [links.index(name)] * len(local)
    if not points:
        return None
    return Outline(
        axes=frozen_array(data.xaxis[list(joints)]),
        anchors=frozen_array(data.xanchor[list(joints)]),
        slides=np.asarray(model.jnt_type[list(joints)] == mujoco.mjtJoint.mjJNT_SLIDE),
        points=frozen_array(np.vstack(points)),
        radii=frozen_array(radii),
        joints_before=np.array(moved),
        link_of=np.array(link_of),
        links=tuple(links),
    )


def _moved(parent: int | None, own: range, joints: Sequence[int]) -> int | None:
    """Return by how many of the arm's joints a body is moved, from the base; None where another one moves it as well."""
    count = parent
    for joint in own:
        if count is None:
            return None
        if count < len(joints) and joint == joints[count]:
            count += 1
        elif count < len(joints):
            return None
    return count


def _extreme(model: mujoco.MjModel, geom: int) -> tuple[Array, float]:
    """Return points in a geom's frame, shape (k, 3), and the radius of the balls about them that have it within their hull."""
    size = model.geom_size[geom]
    match mujoco.mjtGeom(int(model.geom_type[geom])):
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return np.zeros((1, 3)), float(size[0])
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            return np.array([[0.0, 0.0, size[1]], [0.0, 0.0, -size[1]]]), float(size[0])
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            ring = _RING * size[0]
            return np.vstack([ring + [0.0, 0.0, size[1]], ring - [0.0, 0.0, size[1]]]), 0.0
        case mujoco.mjtGeom.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            vertices = model.mesh_vert[first : first + count].astype(float)
            return vertices[np.unique((vertices @ _DIRECTIONS.T).argmax(axis=0))], 0.0
        case _:
            box = model.geom_aabb[geom]
            corners: Array = box[:3] + _CORNERS * box[3:]
            return corners, 0.0
