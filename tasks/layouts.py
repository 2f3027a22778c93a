"""Layouts of a task: the scene and the arm's configuration for each seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from robosandbox.errors import InputError
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.robots.kinematics import Kinematics
from robosandbox.shapes.mesh_file import mesh_bounds
from robosandbox.tasks.randomize import draw_layout
from robosandbox.tasks.task import Task
from robosandbox.types import Array, DetectedObject, ObservedScene, Scene
from robosandbox.types.robot import RobotSpec
from robosandbox.world.relations import centre

# An object is within reach if the tool can point down at it, turned by one of these, radians, and this far above, metres.
_REACH_YAWS = (0.0, np.pi / 2.0)
# How far over an object, metres, the tool is to be able to point down; chosen as on it and above a hover and a lift of
# its own height.
_REACH_ABOVE = (0.0, 0.12)
_DOWN = np.array([0.0, 0.0, -1.0])
# Number of sampled starts for a configuration over an object; as in motion planning: with 60 benchmarks/ik.py solves
# every reachable pose.
_RESTARTS = 60
# Metres; chosen because nearer to the robot's base an object is behind its shoulder (the bundled Panda works from 0.15
# m on, docs/arms.md).
_BASE_RADIUS = 0.15
# How many layouts of a seed are tried, where the world refuses one because things start inside one another.
_START_DRAWS = 20

Result = TypeVar("Result")


class Layouts:
    """A task's layouts by seed.

    Args:
        task: Whose.
        wait_hook: Called again and again while one is drawn; what it raises ends that.
    """

    def __init__(self, task: Task, wait_hook: Callable[[], None] | None = None) -> None:
        self._task = task
        self._wait = wait_hook

    @property
    def begin_as_written(self) -> bool:
        """True where seed 0 is the scene as written with the arm at home."""
        return self._task.start_q is None

    def lay_out(self, seed: int, put: Callable[[Scene, Array], Result]) -> Result:
        """Return what `put` makes of this seed's layout; where it refuses one, another is drawn.

        Args:
            seed: 0 or more.
            put: Called with the scene and the arm's start configuration (n,); raises InputError where things start
                inside one another.

        Raises:
            InputError: The seed is negative or has no layout, or the task's `start_q` is none of this robot.
        """
        task, robot = self._task, self._robot
        self._check_start_q()
        for attempt in range(_START_DRAWS):
            layout = draw_layout(
                task,
                seed,
                joints=len(robot.home_q),
                extents=self._extents,
                accept=_ReachCheck(self._kinematics(), self._robot, task.scene, self._wait),
                attempt=attempt,
            )
            q = np.array(task.start_q or robot.home_q) + layout.q_offset
            try:
                return put(layout.scene, np.clip(q, robot.lower, robot.upper))
            except InputError as error:
                # Seed 0 is the scene as written, so there is nothing to draw again.
                if seed == 0 or attempt == _START_DRAWS - 1:
                    raise InputError(f"{task.name}: seed {seed}: {error}") from None
        raise AssertionError("the last draw returns or raises")

    def _kinematics(self) -> Kinematics:
        return self._scenes.of(_nothing(self._task.scene)).kinematics()

    @cached_property
    def _scenes(self) -> PlanningScenes:
        return PlanningScenes(self._task.scene)

    @cached_property
    def _robot(self) -> RobotSpec:
        return self._scenes.of(_nothing(self._task.scene)).robot

    @cached_property
    def _extents(self) -> dict[str, tuple[float, ...]]:
        """Half-extents (3) of each mesh at scale 1."""
        found = {}
        for item in self._task.scene.objects:
            if item.mesh is not None:
                low, high = mesh_bounds(item.mesh, item.scale, of=item.id)
                found[item.id] = tuple(float(half) / item.scale for half in (high - low) / 2.0)
        return found

    def _check_start_q(self) -> None:
        q, robot = self._task.start_q, self._robot
        if q is None:
            return
        if len(q) != len(robot.joints):
            raise InputError(
                f"{self._task.name}: start_q: has {len(q)} values; {robot.name} has {len(robot.joints)} arm joints"
            )
        for name, value, low, high in zip(robot.joints, q, robot.lower, robot.upper, strict=True):
            if not low <= value <= high:
                raise InputError(
                    f"{self._task.name}: start_q: {value:g} is outside the limits of {name!r}, {low:.4g}..{high:.4g}"
                )


class _ReachCheck:
    """Says whether the gripper can be over an object and at it, pointing down: a matter of the arm alone.

    An arm that cannot do so even where the task puts the object works in another way; its draws are not checked.
    """

    def __init__(
        self, solver: Kinematics, robot: RobotSpec, scene: Scene, wait_hook: Callable[[], None] | None
    ) -> None:
        self._solver, self._robot = solver, robot
        self._scene = scene
        self._wait = wait_hook
        self._exempt: dict[str, bool] = {}

    def __call__(self, obj: DetectedObject) -> bool:
        if obj.id not in self._exempt:
            written = next(item for item in self._scene.objects if item.id == obj.id)
            self._exempt[obj.id] = not self._reaches(replace(obj, pose=written.pose))
        return self._exempt[obj.id] or self._reaches(obj)

    def _reaches(self, obj: DetectedObject) -> bool:
        if self._wait is not None:
            self._wait()
        middle = centre(obj)
        if float(np.hypot(*(middle - self._robot.base_position)[:2])) < _BASE_RADIUS:
            return False
        return any(self._reaches_with(middle, yaw) for yaw in _REACH_YAWS)

    def _reaches_with(self, middle: Array, yaw: float) -> bool:
        closing = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        rotation = np.column_stack([np.cross(closing, _DOWN), closing, _DOWN])
        seed: Array = self._robot.home_q
        for above in _REACH_ABOVE:
            found = self._solver.solve(middle + [0.0, 0.0, above], rotation, seed, restarts=_RESTARTS)
            if not found.solved:
                return False
            seed = found.q
        return True


def _nothing(scene: Scene) -> ObservedScene:
    return ObservedScene(time=0.0, objects=(), table_height=scene.table_height, base_xy=(0.0, 0.0))
