"""Perception that sees the simulated state exactly: for tests, and as the measure of the others."""

from __future__ import annotations

from dataclasses import replace

from robosandbox.driver import Driver, Simulated, simulated
from robosandbox.motion.planning_scene import PlanningScene, PlanningScenes
from robosandbox.perception.colour import colour_name
from robosandbox.sim.opening import mujoco_behind
from robosandbox.sim.world import World
from robosandbox.types import DetectedObject, ObjectTruth, ObservedScene, Scene


class GroundTruthPerception:
    """Reports every object where it is."""

    def __init__(self) -> None:
        self._told: Scene | None = None
        self._scenes: PlanningScenes | None = None
        self._driver: Driver | None = None
        self._world: Simulated | None = None
        self._seen: tuple[int, ObservedScene] | None = None
        self._detected: dict[str, tuple[ObjectTruth, DetectedObject]] = {}

    def view(self, driver: Driver) -> Driver:
        """Return the driver as it is.

        Raises:
            UnsupportedError: It does not know the true state.
        """
        self._looked_at(driver)
        return driver

    def planning(self, driver: Driver, seen: ObservedScene) -> PlanningScene:
        """Return the robot among what was seen, in the model that is simulated: what is seen exactly is the same there."""
        told = self._looked_at(driver).scene
        mujoco = mujoco_behind(driver)
        if mujoco is not None:
            return PlanningScene(mujoco.world, seen, believed=lambda seen: self._believed(told, seen))
        return PlanningScene(self._believed(told, seen), seen, believed=lambda seen: self._believed(told, seen))

    def _believed(self, told: Scene, seen: ObservedScene) -> World:
        """Return a model of what is seen; of what is simulated, the objects' masses and meshes go into it."""
        if self._scenes is None or told != self._told:
            self._told, self._scenes = told, PlanningScenes.exact(told)
        return self._scenes.world_of(seen)

    def perceive(self, driver: Driver) -> ObservedScene:
        """Return all objects of the simulated state."""
        world = self._looked_at(driver)
        if self._seen is not None and self._seen[0] == driver.episode and self._seen[1].time == driver.time:
            # A second look at the same moment would show the same.
            return self._seen[1]
        truth, robot = world.truth(for_judging=False), next(iter(driver.arms.values())).spec
        seen = ObservedScene(
            time=truth.time,
            objects=tuple(self._detect(item) for item in truth.objects.values()),
            table_height=truth.table_height,
            table_area=truth.table_area,
            base_xy=(float(robot.base_position[0]), float(robot.base_position[1])),
            hands=truth.hands,
            reach=robot.reach,
            grips=robot.gripper is not None,
        )
        self._seen = driver.episode, seen
        return seen

    def _detect(self, item: ObjectTruth) -> DetectedObject:
        """Return what is seen of an object; of one that has not changed, as what sleeps, the same again."""
        told, seen = self._detected.get(item.id, (None, None))
        if told is item and seen is not None:
            return seen
        seen = replace(item.detected(), colour=colour_name(item.rgba))
        self._detected[item.id] = item, seen
        return seen

    def _looked_at(self, driver: Driver) -> Simulated:
        """Return the world that a driver simulates."""
        if self._world is None or driver is not self._driver:
            self._world = simulated(
                driver, "ground-truth perception reads it; the perception rgbd looks through cameras"
            )
            self._driver, self._seen = driver, None
        return self._world
