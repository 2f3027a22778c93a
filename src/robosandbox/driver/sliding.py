"""Force limit on things that are to stay where they are: less than makes them slide, by weight and friction."""

from __future__ import annotations

import math
from collections.abc import Mapping

from robosandbox.driver.protocols import Driver
from robosandbox.errors import LimitError, Phase
from robosandbox.evidence import LimitEvidence

# Control ticks in a row that make a shove out of a knock; chosen as those of limits of force.
_TICKS = 2
# Share of the limit below which a shove that has been told of is over; chosen.
_OVER = 0.8


class SlideGuard:
    """A guard that stops the arm before what is to stay slides; what presses a thing down holds it, what raises it frees it.

    Args:
        driver: It tells contact by name; what its arms do together is what shoves.
    """

    def __init__(self, driver: Driver) -> None:
        self._senses = driver.senses
        self._limits: Mapping[str, float] = {}
        self._friction = 0.0
        self._over: dict[str, int] = {}

    def keep(self, limits: Mapping[str, float], friction: float) -> None:
        """Take note of under how many newtons each thing slides, by its id, and of the coefficient of friction."""
        self._limits, self._friction, self._over = limits, friction, {}

    def __call__(self) -> LimitError | None:
        """Return what is wrong with a shove that lasts longer than a knock; once, until it is over."""
        if not self._limits:
            return None
        forces = self._senses.forces()
        for name, limit in self._limits.items():
            force = forces.get(name)
            x, y, z = (0.0, 0.0, 0.0) if force is None else force.tolist()
            shove = math.hypot(x, y) + self._friction * z
            ticks = self._over.get(name, 0)
            if shove > limit:
                self._over[name] = ticks + 1
                if ticks + 1 == _TICKS:
                    return _error(name, shove, limit)
            elif ticks < _TICKS or shove < _OVER * limit:
                self._over[name] = 0
        return None


def _error(name: str, shove: float, limit: float) -> LimitError:
    return LimitError(
        f"the robot shoves {name} with {shove:.2g} N, and it slides under {limit:.2g}, going by its weight; nobody named it, so "
        "that it is to stay: the arm holds; make room beside it, or name it",
        phase=Phase.CHECK,
        evidence=LimitEvidence(
            quantity=f"level force of the robot on {name}, N", value=shove, low=0.0, high=limit, touching=(name,)
        ),
    )
