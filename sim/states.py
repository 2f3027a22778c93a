"""The simulated state of each object, read from MuJoCo."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.sim.world import World
from robosandbox.types import ObjectTruth, Pose, SceneObject, Vec3, frozen_array


def object_truth(
    world: World,
    data: mujoco.MjData,
    item: SceneObject,
    *,
    size: tuple[float, ...],
    contacts: tuple[str, ...],
    felt: float,
) -> ObjectTruth:
    """Return an object's state.

    Args:
        world: Where it is.
        data: With up-to-date positions.
        item: The object.
        size: As `ObjectTruth` has it.
        contacts: As `ObjectTruth` has them.
        felt: As `ObjectTruth` has it.
    """
    model, parts = world.model, world.parts[item.id]
    dofs = model.body_dofadr[parts]
    opening: float | None = None
    grains: tuple[Vec3, ...] = ()
    if item.shape.is_granular:
        grains = tuple((float(x), float(y), float(z)) for x, y, z in data.xpos[parts])
        pose = Pose.from_matrix(data.xpos[parts].mean(axis=0), np.eye(3))
        linear = data.qvel[dofs[:, None] + np.arange(3)].mean(axis=0)
        angular = np.zeros(3)
    else:
        rotation = data.xmat[parts[0]].reshape(3, 3)
        pose = Pose.from_matrix(data.xpos[parts[0]], rotation)
        linear, angular = data.qvel[dofs[0] : dofs[0] + 3], rotation @ data.qvel[dofs[0] + 3 : dofs[0] + 6]
    if item.shape.opens:
        opening = float(data.qpos[model.jnt_qposadr[model.body_jntadr[parts[1]]]])
    return ObjectTruth(
        id=item.id,
        kind=item.kind,
        size=size,
        rgba=item.rgba,
        pose=pose,
        linear_velocity=frozen_array(linear),
        angular_velocity=frozen_array(angular),
        contacts=contacts,
        opening=opening,
        grains=grains,
        felt=felt,
        tag=item.tag,
    )
