"""The simulated state of all objects; of what sleeps it is worked out once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.sim.contacts import Contacts
from robosandbox.sim.sleepers import Sleepers
from robosandbox.sim.solids import Solids
from robosandbox.sim.states import object_truth
from robosandbox.sim.world import World
from robosandbox.types import Array, ObjectTruth, SceneObject, Touch


@dataclass(slots=True)
class _LastStates:
    """States of the objects as told at the last look.

    Attributes:
        qpos: The positions then, shape (nq,).
        asleep: Which trees slept then, shape (trees,).
        objects: What was told, by id.
    """

    qpos: Array
    asleep: NDArray[np.bool_]
    objects: dict[str, ObjectTruth] = field(default_factory=dict)


class ObjectStates:
    """Reads the objects of a world.

    Args:
        world: The scene; a model that is rewritten takes another reader.
        data: Its live state.
        sleepers: Of the same state.
        sizes: Of meshes, as `ObjectTruth` has them, by id.
    """

    def __init__(
        self, world: World, data: mujoco.MjData, sleepers: Sleepers, sizes: Mapping[str, tuple[float, ...]]
    ) -> None:
        self.world = world
        self._data = data
        self._sleepers = sleepers
        self._sizes = sizes
        self._solids: Solids | None = None
        trees = {name: world.model.body_treeid[parts] for name, parts in world.parts.items()}
        # What is fixed belongs to no tree, and what lies on it may move.
        self._trees = {name: found[found >= 0] for name, found in trees.items()}
        self._told: dict[bool, _LastStates] = {}

    def forget(self) -> None:
        """Read all anew: the world was put into another state."""
        self._told = {}

    def read(
        self, felt: Mapping[str, float], *, for_judging: bool
    ) -> tuple[dict[str, ObjectTruth], dict[str, str | None]]:
        """Return each object's state, and the object that each hand holds.

        Args:
            felt: As `ObjectTruth` has it, by id; 0 of those that are left out.
            for_judging: Say also what objects are made of and what presses on them.
        """
        contacts = Contacts(self.world, self._data)
        touching, held = contacts.by_object()
        kept = self._still_true(felt, for_judging=for_judging)
        items = [item for item in self.world.scene.objects if item.id not in kept]
        touches = contacts.on_objects() if for_judging else {}
        if any(self._sleeps(item) for item in items):
            self._add_resting(touching, touches, for_judging=for_judging)
        fresh = {
            item.id: self._state(item, touching, touches, felt.get(item.id, 0.0), for_judging=for_judging)
            for item in items
        }
        objects = {item.id: kept.get(item.id) or fresh[item.id] for item in self.world.scene.objects}
        asleep = self._data.tree_awake == 0
        self._told[for_judging] = _LastStates(self._data.qpos.copy(), asleep, objects)
        return objects, held

    def _still_true(self, felt: Mapping[str, float], *, for_judging: bool) -> dict[str, ObjectTruth]:
        """Return what was told of objects that have slept since."""
        told = self._told.get(for_judging)
        if told is None:
            return {}
        slept = told.asleep & (self._data.tree_awake == 0)
        slept[self._sleepers.tree_of_qpos[self._data.qpos != told.qpos]] = False
        return {
            name: one
            for name, one in told.objects.items()
            if len(self._trees[name]) and slept[self._trees[name]].all() and one.felt == felt.get(name, 0.0)
        }

    def _sleeps(self, item: SceneObject) -> bool:
        """Tell whether an object sleeps, or a part of it."""
        return not self._data.tree_awake[self._trees[item.id]].all()

    def _add_resting(
        self, touching: dict[str, set[str]], touches: dict[str, list[Touch]], *, for_judging: bool
    ) -> None:
        """Add the contacts of what sleeps."""
        rest = self._sleepers.contacts()
        if rest.data is None:
            return
        contacts = Contacts(self.world, rest.data, rest.indices)
        for name, others in contacts.touching().items():
            touching.setdefault(name, set()).update(others)
        if for_judging:
            for name, more in contacts.on_objects().items():
                touches[name] += more

    def _state(
        self,
        item: SceneObject,
        touching: Mapping[str, set[str]],
        touches: Mapping[str, list[Touch]],
        felt: float,
        *,
        for_judging: bool,
    ) -> ObjectTruth:
        if self._solids is None:
            self._solids = Solids(self.world)
        return object_truth(
            self.world,
            self._data,
            item,
            size=self._sizes.get(item.id, item.size),
            contacts=tuple(sorted(touching.get(item.id, ()))),
            felt=felt,
            solids=self._solids.of(self._data, item.id) if for_judging else (),
            touches=tuple(touches[item.id]) if for_judging else None,
            weighed=for_judging,
        )
