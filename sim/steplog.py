"""What a world does, tick by tick, in arrays: the state, what was commanded, and what touched what."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.robots.robot import Gripper
from robosandbox.sim.world import World
from robosandbox.types import Array

_STATE = mujoco.mjtState.mjSTATE_TIME | mujoco.mjtState.mjSTATE_PHYSICS | mujoco.mjtState.mjSTATE_CTRL
_CONTACTS_PER_ROW = 16
_EXACT = frozenset({"time", "q", "action", "qpos", "qvel"})


@dataclass(frozen=True, slots=True)
class Ragged:
    """Rows of different lengths: row `i` is `values[offsets[i] : offsets[i + 1]]`."""

    offsets: NDArray[np.int32]
    values: NDArray[np.generic]


@dataclass(frozen=True, slots=True)
class StepColumns:
    """Rows of a log by column; what each is, `COLUMNS` in `recording/columns.py` says.

    Attributes:
        fixed: Arrays (rows, width), float64 for what a replay needs and float32 else; columns of width 0 are left out.
        ragged: Columns whose rows differ in length.
        skill: The running skill of each row, "" between skills.
        phase: Its phase.
    """

    fixed: Mapping[str, NDArray[np.floating[Any]]]
    ragged: Mapping[str, Ragged]
    skill: list[str]
    phase: list[str]


class StepLog:
    """Takes down the state of one world after each control tick.

    Taking a row copies numbers only; what can be worked out from them is left to `take`.

    Args:
        world: What is simulated.
        data: Its live state.
        capacity: Rows that it holds between two calls of `take`.

    Attributes:
        rows: How many it holds.
        skill: What rows that follow say of the running skill.
        phase: And of its phase.
    """

    def __init__(self, world: World, data: mujoco.MjData, capacity: int) -> None:
        model, robot = world.model, world.robot
        self.rows = 0
        self.skill = ""
        self.phase = ""
        self._world = world
        self._data = data
        self._model = model
        self._capacity = capacity
        # Views of the live data: making one costs as much as copying it.
        self._force, self._push = data.actuator_force, data.xfrc_applied
        self._no_push = bytes(data.xfrc_applied.nbytes)
        self._states = np.zeros((capacity, mujoco.mj_stateSize(model, _STATE)))
        self._bodies = np.array([model.site_bodyid[robot.tcp_site], *world.object_bodies.values()])
        self._posed = mujoco.MjData(model)
        self._forces = np.zeros((capacity, model.nu))
        self._skills: list[str] = []
        self._phases: list[str] = []
        self._contacts = 0
        self._contact_counts: list[int] = []
        self._contact_geoms = np.zeros((capacity * _CONTACTS_PER_ROW, 2), dtype=np.int32)
        self._addresses = np.zeros(capacity * _CONTACTS_PER_ROW, dtype=np.int32)
        self._normals = np.zeros(capacity * _CONTACTS_PER_ROW)
        self._pushes: list[tuple[int, Array]] = []
        self._tcp_offset = model.site_pos[robot.tcp_site].copy()
        self._tcp_quat = _site_to_tcp(world)

    @property
    def full(self) -> bool:
        """Whether `take` has to be called before another row."""
        return self.rows == self._capacity

    def add(self) -> None:
        """Take down the state as it is now."""
        row, data, model = self.rows, self._data, self._model
        mujoco.mj_getState(model, data, self._states[row], _STATE)
        self._forces[row] = self._force
        self._skills.append(self.skill)
        self._phases.append(self.phase)
        count = data.ncon
        self._contact_counts.append(count)
        if count:
            self._add_contacts(count)
        if self._push.tobytes() != self._no_push:
            self._pushes.append((row, self._push.flatten()))
        self.rows = row + 1

    def take(self) -> StepColumns:
        """Return the rows as columns and start over."""
        rows = self.rows
        columns = StepColumns(self._fixed(rows), self._ragged(rows), self._skills, self._phases)
        self.clear()
        return columns

    def clear(self) -> None:
        """Forget all rows."""
        self.rows = self._contacts = 0
        self._skills, self._phases = [], []
        self._contact_counts, self._pushes = [], []

    def _add_contacts(self, count: int) -> None:
        begin, end = self._contacts, self._contacts + count
        while end > len(self._addresses):
            self._contact_geoms = np.concatenate([self._contact_geoms, np.zeros_like(self._contact_geoms)])
            self._addresses = np.concatenate([self._addresses, np.zeros_like(self._addresses)])
            self._normals = np.concatenate([self._normals, np.zeros_like(self._normals)])
        contacts = self._data.contact
        self._contact_geoms[begin:end] = contacts.geom
        self._addresses[begin:end] = addresses = contacts.efc_address
        if self._data.nefc:
            # Told to clip, numpy writes into `out` without a copy in between; address -1 is dealt with later.
            self._data.efc_force.take(addresses, 0, self._normals[begin:end], "clip")
        self._contacts = end

    def _normal_forces(self) -> NDArray[np.float32]:
        """Return each contact's normal force, N.

        With elliptic cones, which every world has, a contact's first constraint row is its normal force. A contact
        without a row (address -1) presses on nothing.
        """
        pressing = self._addresses[: self._contacts] >= 0
        return np.where(pressing, self._normals[: self._contacts], 0.0).astype(np.float32)

    def _fixed(self, rows: int) -> dict[str, NDArray[np.floating[Any]]]:
        model, robot = self._world.model, self._world.robot
        state = self._states[:rows]
        qpos = state[:, 1 : 1 + model.nq]
        qvel = state[:, 1 + model.nq : 1 + model.nq + model.nv]
        action = state[:, state.shape[1] - model.nu :]
        positions, quats = self._poses(qpos)
        tcp_quat = quats[:, 0]
        tcp = positions[:, 0] + _turned(tcp_quat, self._tcp_offset)
        objects = np.concatenate([positions[:, 1:], quats[:, 1:]], axis=2)
        fixed = {
            "time": state[:, :1],
            "q": qpos[:, robot.qpos_indices],
            "qd": qvel[:, robot.dof_indices],
            "tcp_pose": np.concatenate([tcp, _product(tcp_quat, self._tcp_quat)], axis=1),
            "action": action,
            "action_q": (action[:, np.asarray(robot.actuator_ids, dtype=int)] - robot.control_offset)
            / robot.control_scale,
            "objects": objects.reshape(rows, 7 * (len(self._bodies) - 1)),
            "actuator_force": self._forces[:rows],
            "qpos": qpos,
            "qvel": qvel,
        }
        if robot.gripper is not None:
            fixed["gripper"] = _gripper(robot.gripper, qpos, self._forces[:rows])
            fixed["action_gripper"] = _commanded(robot.gripper, action)
        return {
            name: np.ascontiguousarray(values, dtype=np.float64 if name in _EXACT else np.float32)
            for name, values in fixed.items()
            if values.shape[1]
        }

    def _poses(self, qpos: Array) -> tuple[Array, Array]:
        """Return positions (rows, bodies, 3) and quaternions xyzw (rows, bodies, 4) of the TCP's body and the objects.

        Row after row in one go, and on data that nobody else uses, this takes half the time that it would tick by tick.
        """
        data = self._posed
        positions = np.empty((len(qpos), len(self._bodies), 3))
        quats = np.empty((len(qpos), len(self._bodies), 4))
        for row, values in enumerate(qpos):
            data.qpos[:] = values
            mujoco.mj_kinematics(self._model, data)
            # Told to clip, numpy writes into `out` without a copy in between.
            data.xpos.take(self._bodies, 0, positions[row], "clip")
            data.xquat.take(self._bodies, 0, quats[row], "clip")
        return positions, quats[..., [1, 2, 3, 0]]

    def _ragged(self, rows: int) -> dict[str, Ragged]:
        count = self._contacts
        ends = np.cumsum([0, *self._contact_counts], dtype=np.int32)
        bodies = self._model.geom_bodyid[self._contact_geoms[:count]].astype(np.int16)
        push_ends = np.zeros(rows + 1, dtype=np.int32)
        for row, values in self._pushes:
            push_ends[row + 1] = len(values)
        pushes = np.concatenate([values for _, values in self._pushes]) if self._pushes else np.zeros(0)
        return {
            "contact_bodies": Ragged(2 * ends, bodies.ravel()),
            "contact_force": Ragged(ends, self._normal_forces()),
            "push": Ragged(np.cumsum(push_ends, dtype=np.int32), pushes),
        }


def _gripper(gripper: Gripper, qpos: Array, force: Array) -> Array:
    """Return joint, width, closed fraction and force of each row, as `Gripper.state` does for one."""
    geometry = gripper.geometry
    joint = qpos[:, gripper.qpos_index]
    middle = joint
    if len(gripper.driven) >= 2:
        values = []
        for column in gripper.driven:
            samples = gripper.coupled_samples[:, column]
            order = np.argsort(samples, kind="stable")
            values.append(
                np.interp(qpos[:, gripper.joint_indices[column]], samples[order], geometry.joint_samples[order])
            )
        middle = np.mean(values, axis=0)
    width = np.maximum(0.0, np.interp(middle, geometry.joint_samples, geometry.aperture_samples))
    closed = (joint - geometry.open_joint) / (geometry.closed_joint - geometry.open_joint)
    return np.column_stack(
        [joint, width, closed, np.abs(force[:, np.asarray(gripper.actuator_ids, dtype=int)]).sum(axis=1)]
    )


def _commanded(gripper: Gripper, action: Array) -> Array:
    """Return the closed fraction that the controls command, shape (rows, 1)."""
    geometry = gripper.geometry
    spans = np.ptp(geometry.control_samples, axis=0)
    column = int(np.argmax(spans))
    samples = geometry.control_samples[:, column]
    order = np.argsort(samples, kind="stable")
    controls = action[:, int(np.asarray(gripper.actuator_ids)[column])]
    joint = np.interp(controls, samples[order], geometry.joint_samples[order])
    return ((joint - geometry.open_joint) / (geometry.closed_joint - geometry.open_joint))[:, None]


def _site_to_tcp(world: World) -> Array:
    """Return the rotation from the TCP's body to the TCP frame as a quaternion, xyzw."""
    quat = np.zeros(4)
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, world.model.site_quat[world.robot.tcp_site])
    mujoco.mju_mat2Quat(quat, (matrix.reshape(3, 3) @ world.robot.R_site_tcp).ravel())
    return quat[[1, 2, 3, 0]]


def _turned(quats: Array, vector: Array) -> Array:
    """Return `vector` (3,) turned by each of `quats` (rows, 4) xyzw, shape (rows, 3)."""
    axes, scalars = quats[:, :3], quats[:, 3:]
    across = 2.0 * np.cross(axes, vector)
    turned: Array = vector + scalars * across + np.cross(axes, across)
    return turned


def _product(first: Array, second: Array) -> Array:
    """Return the quaternions (rows, 4) xyzw of `first` (rows, 4) turned further by `second` (4,)."""
    vectors, scalars = first[:, :3], first[:, 3:]
    vector, scalar = second[:3], second[3]
    product = scalars * vector + scalar * vectors + np.cross(vectors, vector)
    return np.column_stack([product, scalars[:, 0] * scalar - vectors @ vector])
