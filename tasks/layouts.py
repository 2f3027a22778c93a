"""Layouts of a task: the scene and the arms' configurations for each seed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from robosandbox.errors import InputError
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.robots.kinematics import Kinematics
from robosandbox.robots.robot import Robot
from robosandbox.shapes.mesh_file import mesh_bounds
from robosandbox.sim.world import World
from robosandbox.tasks.randomize import draw_layout
from robosandbox.tasks.task import Task
from robosandbox.types import Array, DetectedObject, ObservedScene, Scene
from robosandbox.types.robot import ARM, RobotSpec
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
# Where arms start: of the only one its configuration (n,), of several each by name.
Start = Array | Mapping[str, Array]


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

    def lay_out(self, seed: int, put: Callable[[Scene, Start], Result]) -> Result:
        """Return what `put` makes of this seed's layout; where it refuses one, another is drawn.

        Args:
            seed: 0 or more.
            put: Called with the scene and the arm's start configuration (n,), of several arms each by name; raises
                InputError where things start inside one another.

        Raises:
            InputError: The seed is negative or has no layout, or the task's `start_q` is none of this robot.
        """
        task = self._task
        self._check_start_q()
        home = np.concatenate([robot.home_q for robot in self._robots.values()])
        for attempt in range(_START_DRAWS):
            layout = draw_layout(
                task,
                seed,
                joints=len(home),
                extents=self._extents,
                accept=_ReachCheck(self._reaches(), task.scene),
                attempt=attempt,
            )
            try:
                return put(layout.scene, self._start(np.array(task.start_q or home) + layout.q_offset))
            except InputError as error:
                # Seed 0 is the scene as written, so there is nothing to draw again.
                if seed == 0 or attempt == _START_DRAWS - 1:
                    raise InputError(f"{task.name}: seed {seed}: {error}") from None
        raise AssertionError("the last draw returns or raises")

    def _start(self, q: Array) -> Start:
        """Return the joints of all arms, one behind the other, within their limits: by arm where there are several."""
        ends = np.cumsum([robot.n for robot in self._robots.values()])
        parts = np.split(q, ends[:-1])
        starts = {
            name: np.clip(part, robot.lower, robot.upper)
            for (name, robot), part in zip(self._robots.items(), parts, strict=True)
        }
        return starts[ARM] if [*starts] == [ARM] else starts

    def _reaches(self) -> list[_Reach]:
        return [_Reach(Kinematics.of(self._world.model, robot), robot, self._wait) for robot in self._robots.values()]

    @cached_property
    def _world(self) -> World:
        return PlanningScenes(self._task.scene).world_of(_nothing(self._task.scene))

    @property
    def _robots(self) -> Mapping[str, Robot]:
        return self._world.robots

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
        q, robots = self._task.start_q, tuple(self._robots.values())
        if q is None:
            return
        joints = [one for robot in robots for one in zip(robot.joints, robot.lower, robot.upper, strict=True)]
        if len(q) != len(joints):
            names = " and ".join(robot.name for robot in robots)
            raise InputError(f"{self._task.name}: start_q: has {len(q)} values; {names} has {len(joints)} arm joints")
        for value, (name, low, high) in zip(q, joints, strict=True):
            if not low <= value <= high:
                raise InputError(
                    f"{self._task.name}: start_q: {value:g} is outside the limits of {name!r}, {low:.4g}..{high:.4g}"
                )


class _ReachCheck:
    """Says whether each arm that reaches an object where the task puts it reaches it where it is drawn.

    An arm that does not works in another way, or leaves the object to another arm; its draws are not checked.
    """

    def __init__(self, arms: list[_Reach], scene: Scene) -> None:
        self._arms = arms
        self._scene = scene
        self._able: dict[str, list[_Reach]] = {}

    def __call__(self, obj: DetectedObject) -> bool:
        if obj.id not in self._able:
            written = next(item for item in self._scene.objects if item.id == obj.id)
            self._able[obj.id] = [arm for arm in self._arms if arm.reaches(replace(obj, pose=written.pose))]
        return all(arm.reaches(obj) for arm in self._able[obj.id])


class _Reach:
    """Says whether a gripper can be over an object and at it, pointing down: a matter of the arm alone."""

    def __init__(self, solver: Kinematics, robot: RobotSpec, wait_hook: Callable[[], None] | None) -> None:
        self._solver, self._robot = solver, robot
        self._wait = wait_hook

    def reaches(self, obj: DetectedObject) -> bool:
        """Tell whether the tool gets there, in one of a few turns."""
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
