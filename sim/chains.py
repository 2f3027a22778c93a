"""Forward kinematics of a few bodies over many configurations at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np

from robosandbox.types import Array

_FREE, _BALL, _SLIDE = (
    mujoco.mjtJoint.mjJNT_FREE,
    mujoco.mjtJoint.mjJNT_BALL,
    mujoco.mjtJoint.mjJNT_SLIDE,
)


class Chains:
    """The way from the world to some of a model's bodies.

    Each step of the way is done for all configurations together: a turn by a fixed quaternion is a matrix that all of
    them are multiplied with. Inside, quaternions are wxyz as in MuJoCo, and arrays (components, rows).

    Args:
        model: Whose.
        bodies: Ids of those whose poses are asked for.
    """

    def __init__(self, model: mujoco.MjModel, bodies: Iterable[int]) -> None:
        self._bodies = tuple(bodies)
        wanted: set[int] = set()
        for body in self._bodies:
            while body > 0:
                wanted.add(body)
                body = int(model.body_parentid[body])
        # A parent's id is smaller than its children's.
        self._links = [_link(model, body) for body in sorted(wanted)]

    def poses(self, qpos: Array) -> tuple[Array, Array]:
        """Return the bodies' poses in the world, as `mj_kinematics` has them.

        Args:
            qpos: Shape (rows, nq).

        Returns:
            Positions (rows, bodies, 3), metres, and quaternions xyzw (rows, bodies, 4).
        """
        rows = len(qpos)
        columns = np.ascontiguousarray(qpos.T)
        found = {0: (np.zeros((3, rows)), np.repeat([[1.0], [0.0], [0.0], [0.0]], rows, axis=1))}
        for link in self._links:
            found[link.body] = link.beyond(*found[link.parent], columns)
        positions, quats = np.empty((rows, len(self._bodies), 3)), np.empty((rows, len(self._bodies), 4))
        for index, body in enumerate(self._bodies):
            position, quat = found[body]
            positions[:, index] = position.T
            quats[:, index, :3], quats[:, index, 3] = quat[1:].T, quat[0]
        return positions, quats


class _Vector:
    """A vector of a body's frame, turned by many quaternions."""

    def __init__(self, xyz: Array) -> None:
        x, y, z = xyz.tolist()
        self._zero = x == y == z == 0.0
        self._column = xyz[:, None].copy()
        self._cross = 2.0 * np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])

    def added(self, position: Array, quat: Array, sign: float = 1.0) -> Array:
        """Return positions moved by it, or against it, shape (3, rows)."""
        return position if self._zero else position + sign * self.turned(quat)

    def turned(self, quat: Array) -> Array:
        """Return it turned by each quaternion, shape (3, rows)."""
        a, b, c = across = self._cross @ quat[1:]
        w, x, y, z = quat
        turned: Array = w * across
        turned += self._column
        turned[0] += y * c - z * b
        turned[1] += z * a - x * c
        turned[2] += x * b - y * a
        return turned


@dataclass(frozen=True, slots=True, kw_only=True)
class _Joint:
    kind: mujoco.mjtJoint
    address: int
    rest: float
    axis: _Vector
    about: Array
    anchor: _Vector

    def moved(self, position: Array, quat: Array, qpos: Array) -> tuple[Array, Array]:
        """Return positions and quaternions beyond the joint from those before it."""
        first = self.address
        if self.kind == _FREE:
            return qpos[first : first + 3], _unit(qpos[first + 3 : first + 7])
        if self.kind == _SLIDE:
            return position + (qpos[first] - self.rest) * self.axis.turned(quat), quat
        centre = self.anchor.added(position, quat)
        if self.kind == _BALL:
            quat = _product(quat, _unit(qpos[first : first + 4]))
        else:
            half = 0.5 * (qpos[first] - self.rest)
            quat = np.cos(half) * quat + np.sin(half) * (self.about @ quat)
        return self.anchor.added(centre, quat, -1.0), quat


@dataclass(frozen=True, slots=True, kw_only=True)
class _Link:
    body: int
    parent: int
    offset: _Vector
    turn: Array | None
    joints: tuple[_Joint, ...]

    def beyond(self, position: Array, quat: Array, qpos: Array) -> tuple[Array, Array]:
        """Return the body's positions and quaternions from its parent's."""
        position = self.offset.added(position, quat)
        if self.turn is not None:
            quat = self.turn @ quat
        for joint in self.joints:
            position, quat = joint.moved(position, quat, qpos)
        return position, quat


def _link(model: mujoco.MjModel, body: int) -> _Link:
    first = int(model.body_jntadr[body])
    joints = []
    for joint in range(first, first + int(model.body_jntnum[body])):
        axis, address = model.jnt_axis[joint], int(model.jnt_qposadr[joint])
        joints.append(
            _Joint(
                kind=mujoco.mjtJoint(int(model.jnt_type[joint])),
                address=address,
                rest=float(model.qpos0[address]),
                axis=_Vector(axis),
                about=_times((0.0, *axis.tolist())),
                anchor=_Vector(model.jnt_pos[joint]),
            )
        )
    quat = tuple(model.body_quat[body].tolist())
    return _Link(
        body=body,
        parent=int(model.body_parentid[body]),
        offset=_Vector(model.body_pos[body]),
        turn=None if quat == (1.0, 0.0, 0.0, 0.0) else _times(quat),
        joints=tuple(joints),
    )


def _times(quat: tuple[float, ...]) -> Array:
    """Return the matrix that multiplies quaternions with `quat` from the right."""
    w, x, y, z = quat
    return np.array([[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]])


def _product(first: Array, second: Array) -> Array:
    """Return the products of pairs of quaternions."""
    w, x, y, z = second
    a, b, c, d = first
    return np.stack(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ]
    )


def _unit(quat: Array) -> Array:
    unit: Array = quat / np.sqrt((quat * quat).sum(axis=0))
    return unit
