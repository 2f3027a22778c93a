"""The state of a simulated world as one vector: all that MuJoCo integrates, and behind it which bodies sleep."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.types import Array

_INTEGRATED = mujoco.mjtState.mjSTATE_INTEGRATION
_ASLEEP, _AWAKE = mujoco.mjtSleepState.mjS_ASLEEP.value, mujoco.mjtSleepState.mjS_AWAKE.value
_STATIC = mujoco.mjtSleepState.mjS_STATIC.value
# What MuJoCo writes for a tree that moves: it counts up to -1 while the tree lies still (mjMINAWAKE, ten steps).
MOVING = -11


def integrated_size(model: mujoco.MjModel) -> int:
    """Return how many numbers of a state are MuJoCo's; those behind them, one a tree, say who sleeps."""
    return int(mujoco.mj_stateSize(model, _INTEGRATED))


def take_state(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the whole state as one vector, shape (integrated + trees,)."""
    size = integrated_size(model)
    state = np.empty(size + model.ntree)
    mujoco.mj_getState(model, data, state[:size], _INTEGRATED)
    state[size:] = data.tree_asleep
    return state


def put_state(model: mujoco.MjModel, data: mujoco.MjData, state: Array) -> None:
    """Write a state into `data` with all bodies awake, so that `mj_forward` then finds the contacts of each.

    Args:
        model: The state's.
        data: To be written; positions of bodies are not computed yet.
        state: As `take_state` returned it; who sleeps may be left out.
    """
    mujoco.mj_setState(model, data, np.asarray(state[: integrated_size(model)], dtype=float), _INTEGRATED)
    _mark(model, data, np.full(model.ntree, MOVING, dtype=np.int32))


def continue_from(model: mujoco.MjModel, data: mujoco.MjData, state: Array) -> None:
    """Write a state into `data` from which time goes on, to the last bit, as it did where the state was taken.

    Args:
        model: The state's.
        data: To be written; positions, contacts and forces are computed.
        state: As `take_state` returned it; where who sleeps is left out, nobody does.
    """
    put_state(model, data, state)
    mujoco.mj_forward(model, data)
    asleep = np.asarray(state[integrated_size(model) :], dtype=np.int32)
    if not len(asleep):
        return
    sleeps = asleep[model.dof_treeid] >= 0
    _mark(model, data, asleep)
    if sleeps.any():
        # MuJoCo computes nothing for sleepers: they keep the accelerations with which they fell asleep.
        data.qacc[sleeps] = data.qacc_warmstart[sleeps]
        mujoco.mj_forward(model, data)


def _mark(model: mujoco.MjModel, data: mujoco.MjData, asleep: NDArray[np.int32]) -> None:
    """Say who sleeps, and all that MuJoCo derives of it; its own function for that (mj_updateSleep) is not public."""
    was_awake = data.ntree_awake == model.ntree
    data.tree_asleep[:] = asleep
    if was_awake and not (asleep >= 0).any():
        return
    awake = asleep < 0
    tree = model.body_treeid
    body = np.where(tree < 0, _STATIC, np.where(awake[tree], _AWAKE, _ASLEEP))
    body[(tree < 0) & (model.body_mocapid[model.body_rootid] >= 0)] = _AWAKE
    bodies = np.flatnonzero(body != _ASLEEP)
    parents = np.flatnonzero(body[model.body_parentid] != _ASLEEP)[1:]
    dofs = np.flatnonzero(awake[model.dof_treeid])
    data.tree_awake[:] = awake
    data.body_awake[:] = body
    data.body_awake_ind[: len(bodies)] = bodies
    data.parent_awake_ind[: len(parents)] = parents
    data.dof_awake_ind[: len(dofs)] = dofs
    data.ntree_awake = int(awake.sum())
    data.nbody_awake, data.nparent_awake, data.nv_awake = len(bodies), len(parents), len(dofs)
