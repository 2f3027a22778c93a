"""The contacts of sleeping bodies with one another and with what never moves: MuJoCo leaves them out of its data."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.sim.saved_state import put_state, take_state
from robosandbox.values import frozen


@frozen(eq=False)
class RestingContacts:
    """The contacts in which nothing moves, for as long as the same bodies sleep.

    Attributes:
        data: The world with all bodies awake, and all contacts.
        indices: Which contacts are of sleeping bodies, shape (k,).
        geoms: The geoms that touch there, shape (k, 2).
        normals: The normal forces, N, shape (k,).
    """

    data: mujoco.MjData | None
    indices: NDArray[np.intp]
    geoms: NDArray[np.int32]
    normals: NDArray[np.float32]


_ALL_AWAKE = RestingContacts(None, np.zeros(0, np.intp), np.zeros((0, 2), np.int32), np.zeros(0, np.float32))


class Sleepers:
    """The bodies of a world that sleep.

    Their contacts are computed when others sleep than at the last time, in data of its own, in which all are awake.

    Args:
        model: The world's.
        data: Its live state.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model = model
        self._data = data
        self._awake = data.tree_awake
        self._qpos = data.qpos
        self.tree_of_qpos: NDArray[np.intp] = _tree_of_qpos(model)
        self._key = b""
        self._found = _ALL_AWAKE

    def forget(self) -> None:
        """Compute the contacts anew: the world was put into another state, or the model rewritten."""
        self._key = b""

    def contacts(self) -> RestingContacts:
        """Return the contacts of what sleeps now."""
        if self._data.ntree_awake == self._model.ntree:
            return _ALL_AWAKE
        asleep = self._awake[self.tree_of_qpos] == 0
        key = self._awake.tobytes() + self._qpos[asleep].tobytes()
        if key != self._key:
            self._key, self._found = key, self._computed()
        return self._found

    def _computed(self) -> RestingContacts:
        model, data = self._model, self._found.data or mujoco.MjData(self._model)
        put_state(model, data, take_state(model, self._data))
        mujoco.mj_forward(model, data)
        geoms = data.contact.geom.reshape(-1, 2)
        moves = self._data.body_awake[model.geom_bodyid[geoms]] == mujoco.mjtSleepState.mjS_AWAKE.value
        (indices,) = (~moves.any(axis=1)).nonzero()
        normals, local = np.zeros(len(indices), dtype=np.float32), np.zeros(6)
        for k, index in enumerate(indices.tolist()):
            mujoco.mj_contactForce(model, data, index, local)
            normals[k] = local[0]
        return RestingContacts(data, indices, geoms[indices], normals)


def _tree_of_qpos(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Return to which tree each position belongs, shape (nq,)."""
    ends = np.append(model.jnt_qposadr[1:], model.nq)
    tree: NDArray[np.intp] = model.body_treeid[np.repeat(model.jnt_bodyid, ends - model.jnt_qposadr)].astype(np.intp)
    return tree
