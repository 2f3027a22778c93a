"""Force limit of the robot, checked at every control tick whatever anybody plans."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from robosandbox.driver.protocols import Driver
from robosandbox.errors import LimitError, Phase
from robosandbox.evidence import LimitEvidence
from robosandbox.types import Array

# Control ticks in a row over the limit that make pressing out of a knock, and so many ticks ahead are looked; the knocks of
# the bundled tasks last one (measured: up to 43 N in close_drawer and put_in_drawer).
_TICKS = 2
# Factor by which a force that has been told of may pass its limit, and no more, while what cleans up moves away: the arm that
# stops still runs on for a tick or two (measured: by 5 % of the limit at the speed of a push).
_RUNNING_ON = 1.1
# Share of its limit below which a force that has been told of is over, so that the next one is told of; chosen.
_OVER = 0.8


class ForceGuard:
    """A guard that stops the arm before it presses on anything harder than allowed.

    A force is the sum over all contacts of the robot with one thing: the sides of a grip cancel, what it lifts or shoves
    does not. One that is about to pass its limit, going by how it grew in the last tick, has passed it. A knock of one tick
    is none: nothing that the arm does after it makes it less, and ISO/TS 15066 allows twice as much for as short a time.

    Args:
        driver: It tells contact or a wrench at the wrist; where it does not tell what is touched, that is what the call
            means to touch.
        arm: Name of the arm.
        intended: The most on what the running call means to touch, N.
        unintended: The most on anything else, N.
    """

    def __init__(self, driver: Driver, arm: str, intended: float, unintended: float) -> None:
        self._senses = driver.senses
        self._arm = arm
        self._contact = driver.capabilities.contact
        self._intended = intended
        self._unintended = unintended
        self._meant: frozenset[str] | None = frozenset()
        self._before: Mapping[str, float] = {}
        self._over: Mapping[str, int] = {}
        self._told: set[str] = set()

    def allow(self, intended: float, unintended: float) -> None:
        """Keep other limits from now on, N."""
        self._intended, self._unintended = intended, unintended

    def mean(self, names: Iterable[str] | None) -> None:
        """Take note of what the next call means to touch; None where nobody can tell things apart: whatever it touches."""
        self._meant = None if names is None else frozenset(names)

    def __call__(self) -> LimitError | None:
        """Return what is wrong with a force that is, or is about to be, over its limit for longer than a knock lasts.

        It is returned once, so that what cleans up may move; again where it grows all the same, or after it was over.
        """
        forces = self._forces()
        if not forces:
            if self._before:
                self._before, self._told, self._over = {}, set(), {}
            return None
        before, now = self._before, {name: math.hypot(*force.tolist()) for name, force in forces.items()}
        self._before = now
        if self._told:
            self._told = {name for name in self._told if now.get(name, 0.0) > _OVER * self._limit(name)}
        over = {}
        for name, force in now.items():
            # What was not touched a tick ago did not grow: how fast it grows is not known yet.
            growth = max(0.0, force - before.get(name, force))
            limit, coming = self._limit(name), force + _TICKS * growth
            most = limit if name not in self._told else _RUNNING_ON * limit if growth > 0.0 else math.inf
            if coming > most:
                over[name] = self._over.get(name, 0) + 1
                if over[name] >= _TICKS:
                    self._told.add(name)
                    return self._error(name, max(force, min(coming, _RUNNING_ON * limit)), limit)
        self._over = over
        return None

    def _forces(self) -> Mapping[str, Array]:
        if self._contact is not None:
            forces = self._senses.forces(self._arm)
            return {"something": np.sum(tuple(forces.values()), axis=0)} if forces and self._meant is None else forces
        force = self._senses.force_on(None, self._arm)
        return {"something": force} if force.any() else {}

    def _limit(self, name: str) -> float:
        told_apart = self._contact == "named" and self._meant is not None
        return self._unintended if told_apart and name not in (self._meant or ()) else self._intended

    def _error(self, name: str, force: float, limit: float) -> LimitError:
        field = "max_force_n" if limit == self._intended else "max_unintended_force_n"
        return LimitError(
            f"the robot presses on {name} with up to {force:.3g} N, and limits.{field} allows {limit:g}; the arm holds: "
            "clear what is in the way, or allow more",
            phase=Phase.CHECK,
            evidence=LimitEvidence(
                quantity=f"force of the robot on {name}, N", value=force, low=0.0, high=limit, touching=(name,)
            ),
        )
