"""The state of a simulated world after each control tick, recorded in arrays: state, commands, contacts."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any, TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.robots.chains import Chains, product, turned
from robosandbox.robots.robot import Gripper, Robot
from robosandbox.sim.sleepers import RestingContacts, Sleepers
from robosandbox.sim.world import World
from robosandbox.types import Array
from robosandbox.types.robot import ARM
from robosandbox.values import frozen

_SPEC = mujoco.mjtState
_Number = TypeVar("_Number", bound=np.generic)
# In MuJoCo's order of a state: time, positions, velocities, activations, controls, pushes on bodies.
_STATE = _SPEC.mjSTATE_TIME | _SPEC.mjSTATE_PHYSICS | _SPEC.mjSTATE_CTRL | _SPEC.mjSTATE_XFRC_APPLIED
_EXACT = frozenset({"time", "q", "action", "qpos", "qvel"})


def column_of(arm: str, column: str) -> str:
    """Return the name of an arm's column: of the only arm the column's own, of several that with the arm's before it."""
    return column if arm == ARM else f"{arm}/{column}"


@frozen
class Ragged:
    """Rows of different lengths: row `i` is `values[offsets[i] : offsets[i + 1]]`."""

    offsets: NDArray[np.int32]
    values: NDArray[np.generic]


@frozen
class StepColumns:
    """Rows of a log by column; what each is, `COLUMNS` in `workcell/recording/columns.py` says.

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


class StepRecorder:
    """Takes down the state of one world after each control tick.

    Taking a row copies memory only, in pieces as they lie there; what can be worked out from it is left to `take`.

    Args:
        world: What is simulated.
        data: Its live state.
        sleepers: Of the same state: what touches what among the bodies that sleep.
        capacity: Rows that it can hold between two calls of `take`.

    Attributes:
        rows: How many it holds.
        capacity: How many it can hold.
    """

    def __init__(self, world: World, data: mujoco.MjData, sleepers: Sleepers, capacity: int) -> None:
        model, robots = world.model, world.robots.values()
        self.rows: int = 0
        self._world = world
        self._data = data
        self._model = model
        self._sleepers = sleepers
        self.capacity = capacity
        self._states = np.zeros((capacity, mujoco.mj_stateSize(model, _STATE)))
        # Views, of a row each and of the live data: making one costs as much as copying it.
        self._rows = list(self._states)
        self._owners = model.geom_bodyid.astype(np.int16)
        self._force, self._contact = data.actuator_force, data.contact
        hands = [int(model.site_bodyid[robot.tcp_site]) for robot in robots]
        self._chains = Chains(model, (*hands, *world.object_bodies.values()))
        self._tcps = [(model.site_pos[robot.tcp_site].copy(), _site_to_tcp(model, robot)) for robot in robots]
        self._said: list[tuple[int, str, str]] = [(0, "", "")]
        self.clear()

    def enter(self, skill: str, phase: str) -> None:
        """Have the rows that follow name a skill and its phase."""
        self._said.append((self.rows, skill, phase))

    def add(self) -> None:
        """Take down the state as it is now."""
        row, data = self.rows, self._data
        mujoco.mj_getState(self._model, data, self._rows[row], _STATE)
        self._forces.append(self._force.tobytes())
        count = data.ncon
        self._counts.append(count)
        if count:
            contact = self._contact
            self._geoms.append(contact.geom.tobytes())
            self._addresses.append(contact.efc_address.tobytes())
            self._normals.append(data.efc_force.tobytes())
        self._resting.append(self._sleepers.contacts())
        self.rows = row + 1

    def take(self) -> StepColumns:
        """Return the rows as columns and start over."""
        rows = self.rows
        skills: list[str] = []
        phases: list[str] = []
        for (begin, skill, phase), (end, *_) in itertools.pairwise([*self._said, (rows, "", "")]):
            skills += [skill] * (end - begin)
            phases += [phase] * (end - begin)
        columns = StepColumns(self._fixed(rows), self._ragged(rows), skills, phases)
        self.clear()
        return columns

    def clear(self) -> None:
        """Forget all rows."""
        self.rows = 0
        _, skill, phase = self._said[-1]
        self._said = [(0, skill, phase)]
        self._counts: list[int] = []
        self._resting: list[RestingContacts] = []
        self._forces: list[bytes] = []
        self._geoms: list[bytes] = []
        self._addresses: list[bytes] = []
        self._normals: list[bytes] = []

    def _fixed(self, rows: int) -> dict[str, NDArray[np.floating[Any]]]:
        model, robots = self._world.model, self._world.robots
        state = self._states[:rows]
        qpos = state[:, 1 : 1 + model.nq]
        qvel = state[:, 1 + model.nq : 1 + model.nq + model.nv]
        action = state[:, -model.nu - 6 * model.nbody : -6 * model.nbody]
        force = np.frombuffer(b"".join(self._forces)).reshape(rows, model.nu)
        positions, quats = self._chains.poses(qpos)
        count = len(robots)
        objects = np.concatenate([positions[:, count:], quats[:, count:]], axis=2)
        fixed = {
            "time": state[:, :1],
            "action": action,
            "objects": objects.reshape(rows, 7 * (positions.shape[1] - count)),
            "actuator_force": force,
            "qpos": qpos,
            "qvel": qvel,
        }
        for index, (name, robot) in enumerate(robots.items()):
            offset, turn = self._tcps[index]
            tcp_quat = quats[:, index]
            tcp = positions[:, index] + turned(tcp_quat, offset)
            commands = action[:, np.asarray(robot.actuator_ids, dtype=int)]
            own = {
                "q": qpos[:, robot.qpos_indices],
                "qd": qvel[:, robot.dof_indices],
                "tcp_pose": np.concatenate([tcp, product(tcp_quat, turn)], axis=1),
                "action_q": (commands - robot.control_offset) / robot.control_scale,
            }
            if robot.gripper is not None:
                own["gripper"] = _gripper(robot.gripper, qpos, force, action)
                own["action_gripper"] = _commanded(robot.gripper, action)
            fixed |= {column_of(name, column): values for column, values in own.items()}
        return {
            name: np.ascontiguousarray(values, dtype=np.float64 if name.rpartition("/")[2] in _EXACT else np.float32)
            for name, values in fixed.items()
            if values.shape[1]
        }

    def _ragged(self, rows: int) -> dict[str, Ragged]:
        resting = [len(rest.normals) for rest in self._resting]
        ends = np.cumsum([0, *(a + b for a, b in zip(self._counts, resting, strict=True))], dtype=np.int32)
        moving = np.frombuffer(b"".join(self._geoms), np.int32).reshape(-1, 2)
        geoms = _behind(self._counts, moving, [rest.geoms for rest in self._resting])
        forces = _behind(self._counts, self._normal_forces(), [rest.normals for rest in self._resting])
        pushed = self._states[:rows, -6 * self._model.nbody :]
        felt = pushed.any(axis=1)
        return {
            "contact_bodies": Ragged(2 * ends, self._owners.take(geoms.ravel())),
            "contact_force": Ragged(ends, forces),
            "push": Ragged(np.cumsum([0, *(pushed.shape[1] * felt)], dtype=np.int32), pushed[felt].ravel()),
        }

    def _normal_forces(self) -> NDArray[np.float32]:
        """Return the normal force of each contact in which something moves, N.

        With elliptic cones, which every world has, a contact's first constraint row is its normal force. A contact
        without a row (address -1) presses on nothing.
        """
        addresses = np.frombuffer(b"".join(self._addresses), np.int32)
        forces = np.frombuffer(b"".join(self._normals)).astype(np.float32)
        if not len(forces):
            return np.zeros(len(addresses), np.float32)
        lengths = [len(piece) // 8 for piece in self._normals]
        begins = np.repeat(np.cumsum([0, *lengths[:-1]]), [count for count in self._counts if count])
        normals = forces.take(begins + addresses, mode="clip")
        normals[addresses < 0] = 0.0
        return normals


def _behind(counts: list[int], moving: NDArray[_Number], resting: list[NDArray[_Number]]) -> NDArray[_Number]:
    """Return each row's contacts, those in which something moves first, then those at rest."""
    if not any(map(len, resting)):
        return moving
    pieces = np.split(moving, np.cumsum(counts)[:-1])
    return np.concatenate([piece for pair in zip(pieces, resting, strict=True) for piece in pair])


def _gripper(gripper: Gripper, qpos: Array, force: Array, action: Array) -> Array:
    """Return joint, width, closed fraction and force of each row, as `Gripper.state` does for one."""
    geometry = gripper.geometry
    joint = _commanded(gripper, action)[:, 0] if gripper.qpos_index is None else qpos[:, gripper.qpos_index]
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


def _site_to_tcp(model: mujoco.MjModel, robot: Robot) -> Array:
    """Return the rotation from the TCP's body to the TCP frame as a quaternion, xyzw."""
    quat = np.zeros(4)
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, model.site_quat[robot.tcp_site])
    mujoco.mju_mat2Quat(quat, (matrix.reshape(3, 3) @ robot.R_site_tcp).ravel())
    return quat[[1, 2, 3, 0]]
