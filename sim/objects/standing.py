"""The stand of a loose body in the joints that it has: six ways freely, or the slides on which it glides."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.spatial import matrix_from_quat_xyzw
from robosandbox.types import Array, Pose

_FREE, _SLIDE = mujoco.mjtJoint.mjJNT_FREE.value, mujoco.mjtJoint.mjJNT_SLIDE.value


def is_free(model: mujoco.MjModel, body: int) -> bool:
    """Tell whether a body moves freely."""
    first = int(model.body_jntadr[body])
    return first >= 0 and int(model.jnt_type[first]) == _FREE


def glides(model: mujoco.MjModel, body: int) -> bool:
    """Tell whether a body goes on two slides or more, and turns on nothing: it is pushed about and not lifted."""
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    return count > 1 and bool((model.jnt_type[first : first + count] == _SLIDE).all())


def stand(model: mujoco.MjModel, qpos: NDArray[np.float64], body: int, pose: Pose) -> None:
    """Put a free body at a pose, or one that glides as near to it as its slides go, into positions of shape (nq,)."""
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    if is_free(model, body):
        x, y, z, w = pose.quat_xyzw
        address = int(model.jnt_qposadr[first])
        qpos[address : address + 7] = [*pose.xyz, w, x, y, z]
    elif glides(model, body):
        joints = slice(first, first + count)
        addresses = model.jnt_qposadr[joints]
        position, rotation = _rest(model, body)
        axes = rotation @ model.jnt_axis[joints].T
        way = np.linalg.lstsq(axes, pose.position - position, rcond=None)[0]
        qpos[addresses] = model.qpos0[addresses] + way


def speed(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> tuple[Array, Array]:
    """Return the velocity of a loose body's origin, m/s, and its angular velocity, rad/s, in the world, each of shape (3,)."""
    rotation, first = data.xmat[body].reshape(3, 3), int(model.body_dofadr[body])
    if is_free(model, body):
        return data.qvel[first : first + 3], rotation @ data.qvel[first + 3 : first + 6]
    joints = slice(int(model.body_jntadr[body]), int(model.body_jntadr[body]) + int(model.body_jntnum[body]))
    return data.xaxis[joints].T @ data.qvel[model.jnt_dofadr[joints]], np.zeros(3)


def _rest(model: mujoco.MjModel, body: int) -> tuple[Array, Array]:
    """Return where a body is, position (3,) and rotation (3, 3), that hangs on nothing that moves, its own joints at their rest."""
    position, rotation = np.zeros(3), np.eye(3)
    while body:
        w, x, y, z = model.body_quat[body]
        turn = matrix_from_quat_xyzw((x, y, z, w))
        position, rotation = model.body_pos[body] + turn @ position, turn @ rotation
        body = int(model.body_parentid[body])
    return position, rotation
