"""Parts that a hand pushes: two solid things are not in one place, so what the hand would reach into has given way."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from robosandbox.motion.scene_depths import SceneDepths
from robosandbox.motion.twin import stand
from robosandbox.perception.part_values import PartValues
from robosandbox.sim.world import World
from robosandbox.types import ArmState

# Metres by which solids are in one place in a simulation that is pressed on.
_SINKS = 0.0005
# Steps of a part's way at which it is asked whether it is free of the hand, and times that the last is halved: of 0.4 m, 0.25 mm.
_STEPS, _HALVED = 50, 5


class PushedParts:
    """Moves the parts that hands are in out of their way.

    Args:
        world: The compiled scene.
        depths: The same with its parts as they are believed to be.
    """

    def __init__(self, world: World, depths: SceneDepths) -> None:
        self._world = world
        self._depths = depths
        model = world.model
        solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
        hands = [body for robot in world.robots.values() if robot.gripper is not None for body in robot.gripper.bodies]
        self._hands: NDArray[np.intp] = np.flatnonzero(solid & np.isin(model.geom_bodyid, hands))
        self._solid = solid

    def give_way(self, parts: Mapping[str, PartValues], arms: Mapping[str, ArmState]) -> None:
        """Move each part along its joint, as far as it must, to where no hand is in it.

        Args:
            parts: By id.
            arms: How each arm stands, by name.
        """
        stand(self._world.robots, arms, self._depths.data.qpos)
        self._depths.place()
        for name, part in parts.items():
            geoms = np.flatnonzero(self._solid & np.isin(self._world.model.geom_bodyid, self._world.parts[name]))
            if self._depths.overlap(geoms, self._hands) > _SINKS:
                start = part.value
                # Pressed hard it may be beyond its stop, which gives a little.
                ends = (self._free_value(part, geoms, end) for end in (part.low, part.high))
                part.put(min(ends, key=lambda end: (end[0], abs(end[1] - start)))[1])

    def _free_value(self, part: PartValues, geoms: NDArray[np.intp], end: float) -> tuple[float, float]:
        """Return how deep a hand is still in a part, metres, and the value nearest to the one believed, towards a stop, at which it is so."""
        start = part.value
        touches = start
        for free in start + np.linspace(0.0, 1.0, _STEPS + 1)[1:] * (end - start):
            part.put(float(free))
            if self._depths.overlap(geoms, self._hands) > _SINKS:
                touches = float(free)
                continue
            for _ in range(_HALVED):
                middle = (free + touches) / 2.0
                part.put(middle)
                free, touches = (
                    (middle, touches) if self._depths.overlap(geoms, self._hands) <= _SINKS else (free, middle)
                )
            part.put(start)
            return 0.0, float(free)
        left = self._depths.overlap(geoms, self._hands)
        part.put(start)
        return left, end
