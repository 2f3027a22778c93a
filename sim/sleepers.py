"""The contacts of sleeping bodies with one another and with what never moves: MuJoCo leaves them out of its data."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.sim.saved_state import put_state, take_state
from robosandbox.types import Vec3


@dataclass(frozen=True, slots=True, eq=False)
class RestingContact:
    """A contact in which nothing moves.

    Attributes:
        bodies: Both bodies, by number.
        point: Where they touch, metres in the world.
        force: What presses on the second, N in the world.
    """

    bodies: tuple[int, int]
    point: Vec3
    force: Vec3


@dataclass(frozen=True, slots=True, eq=False)
class RestingContacts:
    """The contacts in which nothing moves, for as long as the same bodies sleep.

    Attributes:
        pairs: The bodies that touch.
        pressing: Those contacts that carry force.
        geoms: The geoms that touch, shape (k, 2).
        normals: Their normal forces, N, shape (k,).
    """

    pairs: frozenset[tuple[int, int]]
    pressing: tuple[RestingContact, ...]
    geoms: NDArray[np.int32]
    normals: NDArray[np.float32]


ALL_AWAKE = RestingContacts(frozenset(), (), np.zeros((0, 2), np.int32), np.zeros(0, np.float32))


class Sleepers:
    """What touches what among the bodies of a world that sleep.

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
        self._tree_of_qpos = _tree_of_qpos(model)
        self._scratch: mujoco.MjData | None = None
        self._key = b""
        self._found = ALL_AWAKE

    def forget(self) -> None:
        """Compute the contacts anew: the world was put into another state, or the model rewritten."""
        self._key = b""

    def contacts(self) -> RestingContacts:
        """Return the contacts of what sleeps now."""
        if self._data.ntree_awake == self._model.ntree:
            return ALL_AWAKE
        asleep = self._awake[self._tree_of_qpos] == 0
        key = self._awake.tobytes() + self._qpos[asleep].tobytes()
        if key != self._key:
            self._key, self._found = key, self._computed()
        return self._found

    def _computed(self) -> RestingContacts:
        model = self._model
        if self._scratch is None:
            self._scratch = mujoco.MjData(model)
        data = self._scratch
        put_state(model, data, take_state(model, self._data))
        mujoco.mj_forward(model, data)
        bodies = model.geom_bodyid[data.contact.geom].reshape(-1, 2)
        moves = self._data.body_awake[bodies] == mujoco.mjtSleepState.mjS_AWAKE.value
        (resting,) = (~moves.any(axis=1)).nonzero()
        pressing, normals, local = [], [], np.zeros(6)
        for index in resting.tolist():
            mujoco.mj_contactForce(model, data, index, local)
            normals.append(local[0])
            if local[0] > 0.0:
                contact = data.contact[index]
                # The contact frame's first axis points from its first geom to its second, and so does the force on the second.
                fx, fy, fz = (contact.frame.reshape(3, 3).T @ local[:3]).tolist()
                x, y, z = contact.pos.tolist()
                first, second = bodies[index].tolist()
                pressing.append(RestingContact((first, second), (x, y, z), (fx, fy, fz)))
        touching = resting[data.contact.dist[resting] < 0.0]
        return RestingContacts(
            pairs=frozenset((first, second) for first, second in bodies[touching].tolist()),
            pressing=tuple(pressing),
            geoms=data.contact.geom[resting],
            normals=np.array(normals, dtype=np.float32),
        )


def _tree_of_qpos(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Return to which tree each position belongs, shape (nq,)."""
    ends = np.append(model.jnt_qposadr[1:], model.nq)
    tree: NDArray[np.intp] = model.body_treeid[np.repeat(model.jnt_bodyid, ends - model.jnt_qposadr)].astype(np.intp)
    return tree
