"""The columns of an episode's steps, and their Arrow form."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from robosandbox.sim.step_recorder import Ragged, StepColumns, column_of

# What each column holds, per control tick. Row 0 is the state in which the episode begins; row i is the state after
# the i-th tick, and its action is what was commanded during that tick.
COLUMNS: dict[str, str] = {
    "time": "simulated seconds since the world's reset",
    "skill": "the running skill; empty between skills",
    "phase": "its phase",
    "q": "arm joints, radians or metres, in the order of robot.joints",
    "qd": "their rates",
    "tcp_pose": "tool centre point in the world: x, y, z in metres, quaternion x, y, z, w",
    "gripper": "primary joint, width in metres, closed fraction (0 open, 1 closed), actuator force",
    "action": "commanded actuator controls, as MuJoCo's ctrl",
    "action_q": "the arm's part of the action as joint positions",
    "action_gripper": "the gripper's part of the action as a closed fraction",
    "objects": "pose of each object of `objects`: x, y, z in metres, quaternion x, y, z, w",
    "actuator_force": "N or N m, per actuator",
    "qpos": "MuJoCo's generalized positions",
    "qvel": "MuJoCo's generalized velocities",
    "contact_bodies": "two body numbers per contact, into `bodies`",
    "contact_force": "normal force of each contact, N",
    "push": "forces and torques from outside on each body, N and N m; empty where there are none",
}
# Those that each arm has; of several arms each column is named "<arm>/<column>".
ARM_COLUMNS = ("q", "qd", "tcp_pose", "gripper", "action_q", "action_gripper")
_SCALARS = ("time", "action_gripper")
_TEXTS = ("skill", "phase")


def columns_of(arms: Iterable[str]) -> dict[str, str]:
    """Return the columns of a recording of these arms, in their order, and what each holds."""
    arms = tuple(arms)
    return {
        name: said
        for column, said in COLUMNS.items()
        for name in ([column_of(arm, column) for arm in arms] if column in ARM_COLUMNS else [column])
    }


def to_batch(columns: StepColumns) -> pa.RecordBatch:
    """Return rows of a log as an Arrow record batch, without copying numbers."""
    arrays: dict[str, Any] = {}
    order = {column: place for place, column in enumerate(COLUMNS)}
    # Of one column the arms come in their order, which is that in which they were taken down.
    for name in sorted([*_TEXTS, *columns.fixed, *columns.ragged], key=lambda name: order[_column(name)]):
        if name in _TEXTS:
            arrays[name] = pa.array(columns.skill if name == "skill" else columns.phase, pa.string())
        elif name in columns.fixed:
            values = columns.fixed[name]
            flat = pa.array(values.reshape(-1))
            arrays[name] = (
                flat if _column(name) in _SCALARS else pa.FixedSizeListArray.from_arrays(flat, values.shape[1])
            )
        elif name in columns.ragged:
            ragged: Ragged = columns.ragged[name]
            arrays[name] = pa.ListArray.from_arrays(pa.array(ragged.offsets), pa.array(ragged.values))
    return pa.RecordBatch.from_arrays(list(arrays.values()), names=list(arrays))


def _column(name: str) -> str:
    return name.rpartition("/")[2]


def to_numpy(table: pa.Table, name: str) -> NDArray[Any]:
    """Return a column as an array: (rows,) for numbers, (rows, width) for lists of one length."""
    column = table.column(name)
    kind = column.type
    if pa.types.is_fixed_size_list(kind):
        flat: NDArray[Any] = column.combine_chunks().flatten().to_numpy(zero_copy_only=False)
        return flat.reshape(len(column), kind.list_size)
    if pa.types.is_list(kind):
        raise ValueError(f"{name}: its rows differ in length; use to_ragged")
    found: NDArray[Any] = column.to_numpy()
    return found


def to_ragged(table: pa.Table, name: str) -> Ragged:
    """Return a column whose rows differ in length."""
    column = table.column(name).combine_chunks()
    if isinstance(column, pa.ChunkedArray):
        column = pa.concat_arrays(column.chunks) if column.num_chunks else pa.array([], column.type)
    offsets = column.offsets.to_numpy()
    values = column.values.to_numpy(zero_copy_only=False)
    return Ragged((offsets - offsets[0]).astype(np.int32), values[offsets[0] : offsets[-1]])
