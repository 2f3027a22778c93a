"""Contact forces of the robot, read at every control tick of a motion in contact, and nearly free without one."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import groupby

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.sim.suction import pulls
from robosandbox.sim.world import World
from robosandbox.types import Array
from robosandbox.values import frozen

# Rows of a contact in MuJoCo's solver, by number: the normal, and the two tangents.
_NORMAL_AND_TANGENTS = np.arange(3)
_UNTOUCHED: Mapping[str, Array] = {}


@frozen(eq=False)
class _Layout:
    """Addresses of the forces of the robot's contacts; the same for as long as the same geoms touch.

    Attributes:
        geoms: Of all contacts, as bytes.
        addresses: Of all contacts in the solver's rows, as bytes.
        contacts: Indices of the robot's contacts, those with one thing in a row, shape (k,).
        rows: Their normal and tangents in the solver's rows, shape (3 k,); None where those are not the forces.
        signs: 1 where a row is the force on the thing, -1 where it is that on the robot, shape (3 k,).
        things: Each thing that is touched, with its part of the rows.
    """

    geoms: bytes
    addresses: bytes
    contacts: NDArray[np.intp]
    rows: NDArray[np.intp] | None
    signs: Array
    things: tuple[tuple[str, slice], ...]


class Pressing:
    """The forces of arms on what they touch.

    Args:
        world: The scene.
        data: Its state, as stepped.
        arm: Name of the arm; all of them where it is left out.
    """

    def __init__(self, world: World, data: mujoco.MjData, arm: str | None = None) -> None:
        self._world = world
        self._data = data
        self._ours = world.geoms_of(arm)
        robots = [robot for name, robot in world.robots.items() if arm in (None, name)]
        dofs = np.concatenate([robot.dof_indices for robot in robots])
        # A view, of more joints where others are numbered between the arm's: making it anew costs as much as looking at it.
        self._loads = data.qfrc_constraint[int(dofs.min()) : int(dofs.max()) + 1]
        self._unloaded = bytes(self._loads.nbytes)
        self._layout: _Layout | None = None
        self._sucks = any(robot.gripper is not None and robot.gripper.geometry.cup is not None for robot in robots)

    def forces(self) -> Mapping[str, Array]:
        """Return the sum of what the robot presses and pulls each thing with that it touches, N in the world, shape (3,).

        A thing is an object by its id, its parts included, or a body that belongs to none, by its name.
        """
        data = self._data
        # A force on a link loads the joints before it; mostly there is none.
        if self._loads.tobytes() == self._unloaded:
            return _UNTOUCHED
        contact = data.contact
        geoms, addresses = contact.geom.tobytes(), contact.efc_address.tobytes()
        layout = self._layout
        if layout is None or layout.geoms != geoms or layout.addresses != addresses:
            layout = self._layout = self._lay_out(geoms, addresses)
        if not layout.things:
            return _UNTOUCHED
        # The contact frame's first axis points from its first geom to its second, and so does the force.
        frames = contact.frame.take(layout.contacts, axis=0).reshape(-1, 3)
        local = self._asked(layout.contacts) if layout.rows is None else data.efc_force.take(layout.rows)
        if self._sucks and (pulled := pulls(self._world, data)) is not None:
            local[::3] -= pulled[layout.contacts]
        local *= layout.signs
        if len(layout.things) == 1:
            found = {layout.things[0][0]: local.dot(frames)}
        else:
            found = {name: local[part].dot(frames[part]) for name, part in layout.things}
        for force in found.values():
            force.setflags(write=False)
        return found

    def _lay_out(self, geoms: bytes, addresses: bytes) -> _Layout:
        world, contact = self._world, self._data.contact
        pairs = contact.geom
        ours = self._ours[pairs].reshape(-1, 2)
        bodies = world.model.geom_bodyid[pairs]
        touched: dict[int, str] = {}
        for index in np.flatnonzero(ours[:, 0] != ours[:, 1]).tolist():
            body = int(bodies[index, 1] if ours[index, 0] else bodies[index, 0])
            touched[index] = world.owners.get(body, world.names[body])
        order = sorted(touched, key=lambda index: (touched[index], index))
        things, done = [], 0
        for name, group in groupby(order, key=touched.__getitem__):
            first, done = done, done + 3 * len(list(group))
            things.append((name, slice(first, done)))
        contacts = np.array(order, dtype=np.intp)
        return _Layout(
            geoms=geoms,
            addresses=addresses,
            contacts=contacts,
            rows=self._rows(contacts),
            signs=np.repeat(np.where(ours[contacts, 0], 1.0, -1.0), 3),
            things=tuple(things),
        )

    def _rows(self, contacts: NDArray[np.intp]) -> NDArray[np.intp] | None:
        """Return the solver's rows (3 k,) that are the forces of these contacts in their frames; None where none are.

        With elliptic cones they are; asking MuJoCo for each contact takes five times as long.
        """
        contact = self._data.contact
        addresses = contact.efc_address[contacts]
        elliptic = self._world.model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
        if not elliptic or addresses.min(initial=0) < 0 or contact.dim[contacts].min(initial=3) < 3:
            return None
        rows: NDArray[np.intp] = (addresses[:, None] + _NORMAL_AND_TANGENTS).astype(np.intp).ravel()
        return rows

    def _asked(self, contacts: NDArray[np.intp]) -> Array:
        """Return the forces of contacts in their own frames, normal first, N, shape (3 k,), as MuJoCo decodes them."""
        forces = np.zeros((len(contacts), 6))
        for row, index in zip(forces, contacts.tolist(), strict=True):
            mujoco.mj_contactForce(self._world.model, self._data, index, row)
        return forces[:, :3].ravel()
