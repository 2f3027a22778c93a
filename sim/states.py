"""The simulated state of each object, read from MuJoCo."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.sim.objects.standing import speed
from robosandbox.sim.world import World
from robosandbox.types import Convex, ObjectTruth, Pose, SceneObject, Touch, Vec3, frozen_array


def object_truth(
    world: World,
    data: mujoco.MjData,
    item: SceneObject,
    *,
    size: tuple[float, ...],
    contacts: tuple[str, ...],
    felt: float,
    solids: tuple[Convex, ...],
    touches: tuple[Touch, ...] | None,
    weighed: bool,
) -> ObjectTruth:
    """Return an object's state.

    Args:
        world: Where it is.
        data: With up-to-date positions.
        item: The object.
        size: As `ObjectTruth` has it.
        contacts: As `ObjectTruth` has them.
        felt: As `ObjectTruth` has it.
        solids: As `ObjectTruth` has them.
        touches: As `ObjectTruth` has them.
        weighed: Whether to say its weight and where the middle of its mass is.
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
        linear = angular = np.zeros(3)
        if not item.is_fixed:
            linear, angular = speed(model, data, int(parts[0]))
    joint = None if item.geometry is None else item.geometry.joint
    if joint is not None:
        opening, rate = float(data.qpos[model.jnt_qposadr[model.body_jntadr[parts[0]]]]), float(data.qvel[dofs[0]])
        axis = np.array(joint.axis)
        turns = joint.kind == "hinge"
        angular = rate * axis if turns else np.zeros(3)
        linear = np.cross(angular, pose.position - np.array(joint.anchor)) if turns else rate * axis
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
        solids=solids,
        touches=touches,
        weight=float(model.body_mass[parts].sum()) * float(np.linalg.norm(model.opt.gravity)) if weighed else None,
        mass_centre=_mass_centre(model, data, parts) if weighed else None,
        geometry=item.geometry,
    )


def _mass_centre(model: mujoco.MjModel, data: mujoco.MjData, parts: NDArray[np.intp]) -> Vec3:
    """Return where the mass of some bodies has its middle; body frames alone have to be up to date."""
    masses = model.body_mass[parts]
    turned = np.einsum("kij,kj->ki", data.xmat[parts].reshape(-1, 3, 3), model.body_ipos[parts])
    x, y, z = (masses @ (data.xpos[parts] + turned)) / max(float(masses.sum()), 1e-9)
    return float(x), float(y), float(z)
