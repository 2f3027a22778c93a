"""Perception that sees the simulated state exactly: for tests, and as the measure of the others."""

from __future__ import annotations

from dataclasses import replace

from robosandbox.drivers import require
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.perception.colour import colour_name
from robosandbox.protocols import Driver, Simulated
from robosandbox.types import ObservedScene


class GroundTruthPerception:
    """Reports every object where it is."""

    def view(self, sim: Driver) -> Driver:
        """Return the sim as it is."""
        return sim

    def planning(self, sim: Driver, seen: ObservedScene) -> PlanningScene:
        """Return the robot among what was seen, in the model that is simulated: what is seen exactly is the same there."""
        return PlanningScene(_simulated(sim).world, seen)

    def perceive(self, sim: Driver) -> ObservedScene:
        """Return all objects of the simulated state."""
        truth, base = _simulated(sim).truth(), sim.robot.base_position
        return ObservedScene(
            time=truth.time,
            objects=tuple(replace(item.detected(), colour=colour_name(item.rgba)) for item in truth.objects.values()),
            table_height=truth.table_height,
            base_xy=(float(base[0]), float(base[1])),
            held=truth.held,
            reach=sim.robot.reach,
        )


def _simulated(sim: Driver) -> Simulated:
    require(sim, "truth", "ground-truth perception reads it (--perception rgbd looks through cameras)")
    assert isinstance(sim, Simulated)
    return sim
