"""Kinematic chains: the tool at the end, how far it reaches, and bodies over many configurations at once; quaternions are xyzw."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Self

import mujoco
import numpy as np

from robosandbox.types import Array
from robosandbox.values import frozen

_JOINT = mujoco.mjtJoint


@frozen
class Tool:
    """A TCP on a body: position (3,) and rotation (3, 3) (z approach, y closing) in the body's frame.

    Where the model has a site for it, `site` is its id and `R_site_tcp` (3, 3) the rotation from its frame.
    """

    body: int
    position: Array
    rotation: Array
    site: int | None = None
    R_site_tcp: Array | None = None

    @classmethod
    def at_site(cls, model: mujoco.MjModel, site: int, R_site_tcp: Array) -> Self:
        """Return the TCP at a site, turned by a rotation (3, 3) from the site's frame to its own."""
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, model.site_quat[site])
        return cls(
            int(model.site_bodyid[site]),
            model.site_pos[site].copy(),
            rotation.reshape(3, 3) @ R_site_tcp,
            site,
            R_site_tcp,
        )


class Chains:
    """The way from the world to some of a model's bodies, each step of it done for all configurations together.

    Args:
        model: Whose.
        bodies: Ids of those whose poses are asked for.
    """

    def __init__(self, model: mujoco.MjModel, bodies: Iterable[int]) -> None:
        self._model, self._bodies = model, tuple(bodies)
        way: set[int] = set()
        for body in self._bodies:
            while body > 0:
                way.add(body)
                body = int(model.body_parentid[body])
        # A parent's id is smaller than its children's.
        self._way = sorted(way)

    def poses(self, qpos: Array) -> tuple[Array, Array]:
        """Return the bodies' poses in the world, as `mj_kinematics` has them.

        Args:
            qpos: Shape (rows, nq).

        Returns:
            Positions (rows, bodies, 3), metres, and quaternions xyzw (rows, bodies, 4).
        """
        model, rows = self._model, len(qpos)
        found = {0: (np.zeros((rows, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (rows, 1)))}
        for body in self._way:
            position, quat = found[int(model.body_parentid[body])]
            position = position + turned(quat, model.body_pos[body])
            quat = product(quat, np.roll(model.body_quat[body], -1))
            first = int(model.body_jntadr[body])
            for joint in range(first, first + int(model.body_jntnum[body])):
                position, quat = self._beyond(joint, position, quat, qpos)
            found[body] = position, quat
        positions, quats = zip(*(found[body] for body in self._bodies), strict=True)
        return np.stack(positions, axis=1), np.stack(quats, axis=1)

    def _beyond(self, joint: int, position: Array, quat: Array, qpos: Array) -> tuple[Array, Array]:
        """Return positions and quaternions beyond a joint from those before it."""
        model, address = self._model, int(self._model.jnt_qposadr[joint])
        kind, axis, anchor = model.jnt_type[joint], model.jnt_axis[joint], model.jnt_pos[joint]
        if kind == _JOINT.mjJNT_FREE:
            return qpos[:, address : address + 3], _unit(qpos[:, address + 3 : address + 7])
        travel = (qpos[:, address] - model.qpos0[address])[:, None]
        if kind == _JOINT.mjJNT_SLIDE:
            return position + travel * turned(quat, axis), quat
        centre = position + turned(quat, anchor)
        if kind == _JOINT.mjJNT_BALL:
            quat = product(quat, _unit(qpos[:, address : address + 4]))
        else:
            quat = product(quat, np.hstack([np.sin(0.5 * travel) * axis, np.cos(0.5 * travel)]))
        return centre - turned(quat, anchor), quat


def length_bound(model: mujoco.MjModel, joints: Sequence[int], tool: Tool) -> float:
    """Return an upper bound on the TCP's distance from the first arm joint's anchor, metres."""
    chain, body = [], tool.body
    while body:
        chain.append(body)
        body = int(model.body_parentid[body])
    length = float(np.linalg.norm(tool.position))
    for body in chain[: chain.index(int(model.jnt_bodyid[joints[0]]))]:
        length += float(np.linalg.norm(model.body_pos[body]))
    for joint in joints:
        length += 2.0 * float(np.linalg.norm(model.jnt_pos[joint]))
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE.value:
            length += float(np.abs(model.jnt_range[joint]).max()) if model.jnt_limited[joint] else np.inf
    return length


def turned(quats: Array, vector: Array) -> Array:
    """Return `vector` (3,) turned by each of `quats` (rows, 4), shape (rows, 3)."""
    axes, scalars = quats[:, :3], quats[:, 3:]
    across = 2.0 * np.cross(axes, vector)
    result: Array = vector + scalars * across + np.cross(axes, across)
    return result


def product(first: Array, second: Array) -> Array:
    """Return the quaternions (rows, 4) of `first` (rows, 4) turned further by `second`, (rows, 4) or (4,)."""
    u, v, a, b = first[:, :3], second[..., :3], first[:, 3:], second[..., 3:]
    turns: Array = np.hstack([a * v + b * u + np.cross(u, v), a * b - (u * v).sum(axis=1, keepdims=True)])
    return turns


def _unit(wxyz: Array) -> Array:
    """Return quaternions as MuJoCo has them, (rows, 4) wxyz, of length one and as xyzw."""
    unit: Array = np.roll(wxyz, -1, axis=1) / np.linalg.norm(wxyz, axis=1, keepdims=True)
    return unit
