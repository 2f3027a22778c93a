"""Forbidden contacts of the arm and of what it carries, looked for at every control tick of an episode."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.skills.events import SkillStarted
from robosandbox.types import SkillCall
from robosandbox.world.operators import Operator, bind, meant_by
from robosandbox.world.relations import contents

_TABLE = "table"


class ContactMonitor:
    """Collects unintended contacts of all arms.

    A robot may touch what a call is to move, and nothing else, the table included. What it moves may touch the table,
    what it touched when the call began, and the call's destination with what is in it.

    Args:
        world: Where; the monitor hooks itself into its ticks.
        skills: What may be called, by name.

    Attributes:
        touched: The pairs that touched, as "link on object".
        worst_force: The largest normal force between such a pair, N.
        worst_intended_force: The most that the robot pressed or pulled what it was to move, N; the sides of a grip cancel.
    """

    def __init__(self, world: MuJoCoBackend, skills: Mapping[str, Operator]) -> None:
        self._world = world
        self._skills = skills
        self.touched: set[str] = set()
        self.worst_force: float = 0.0
        self.worst_intended_force: float = 0.0
        self._moved: frozenset[str] = frozenset()
        self._allowed: frozenset[str] = frozenset()
        world.subscribe(self._look)

    def hear(self, event: object) -> None:
        """Take note of the call that comes next, for an event stream."""
        if isinstance(event, SkillStarted):
            self.begin(event.call)

    def begin(self, call: SkillCall) -> None:
        """Take note of the call that comes next."""
        truth = self._world.truth(for_judging=False)
        named = {name: value for name, value in call.arguments.items() if value in truth.objects}
        bound, held = bind(call, self._skills), [None, *truth.in_hands]
        moved = frozenset().union(*(meant_by(bound, one) for one in held)) & set(truth.objects)
        destinations = set(named.values()) - moved
        beside = {other for name in moved for other in truth.objects[name].contacts}
        seen = [item.detected() for item in truth.objects.values()]
        vessels = [item for item in seen if item.id in destinations and item.shape.holds_things]
        held_in = {name for vessel in vessels for name, _ in contents(seen, vessel)}
        self._moved = frozenset(moved)
        self._allowed = frozenset(moved | beside | destinations | held_in | {_TABLE})

    def reset(self) -> None:
        """Forget what was seen: a new episode begins."""
        self.touched, self.worst_force, self.worst_intended_force = set(), 0.0, 0.0
        self._moved = self._allowed = frozenset()

    def _look(self) -> None:
        for name, pressed in self._world.forces().items():
            if name in self._moved:
                self.worst_intended_force = max(self.worst_intended_force, float(np.linalg.norm(pressed)))
        for body, other, force in self._world.contacts_around(self._moved):
            if body in self._moved and other in self._allowed:
                continue
            self.touched.add(f"{body} on {other}")
            self.worst_force = max(self.worst_force, force)
