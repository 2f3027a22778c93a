"""Force limit on things that are to stay where they are: less than makes them slide, by weight and friction."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping

from robosandbox.driver import Driver
from robosandbox.errors import LimitError, Phase
from robosandbox.evidence import LimitEvidence
from robosandbox.grasp.hand import FRICTION
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.skills.primitives.gripping import GRAVITY
from robosandbox.types import ObservedScene

# Control ticks in a row that make a shove out of a knock; chosen as those of limits of force.
_TICKS = 2
# N that are never taken for a shove; chosen above the noise of a force sensor at a wrist, and the weight of an empty cup.
_LEAST = 2.0
# Share of the limit below which a shove that has been told of is over; chosen.
_OVER = 0.8


def slides_under(
    planning: Callable[[ObservedScene], PlanningScene], scene: ObservedScene, named: Iterable[str]
) -> Mapping[str, float]:
    """Return the level force, N, under which each thing slides that stays where it is unless somebody names it.

    Coulomb's law: friction times weight, as both are believed; what is in it and adds to its weight is left out.

    Args:
        planning: Returns what is believed of what is seen; not asked where nothing is to stay.
        scene: What is seen.
        named: Ids of what a call is about, which may have to be touched.
    """
    about = {*named}
    left = [item.id for item in scene.objects if item.shape.stays_put and item.id not in about]
    believed = planning(scene) if left else None
    masses = {name: believed.loose_mass(name) for name in left} if believed else {}
    return {name: max(_LEAST, FRICTION * GRAVITY * mass) for name, mass in masses.items() if mass is not None}


class SlideGuard:
    """A guard that stops the arm before what is to stay slides; what presses a thing down holds it, what raises it frees it.

    Args:
        sim: Whose arm; it tells contact by name.
    """

    def __init__(self, sim: Driver) -> None:
        self._sim = sim
        self._limits: Mapping[str, float] = {}
        self._over: dict[str, int] = {}

    def keep(self, limits: Mapping[str, float]) -> None:
        """Take note of under how many newtons each thing slides, by its id."""
        self._limits, self._over = limits, {}

    def __call__(self) -> LimitError | None:
        """Return what is wrong with a shove that lasts longer than a knock; once, until it is over."""
        if not self._limits:
            return None
        forces = self._sim.forces()
        for name, limit in self._limits.items():
            force = forces.get(name)
            x, y, z = (0.0, 0.0, 0.0) if force is None else force.tolist()
            shove = math.hypot(x, y) + FRICTION * z
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
