"""The world as skills may know it where cameras see: what was perceived stands in for the simulated objects."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import mujoco

from robosandbox.protocols import Sim
from robosandbox.robots.loader import load_robot
from robosandbox.robots.robot import Robot
from robosandbox.sim.truth import Truth
from robosandbox.sim.world import World, build_world
from robosandbox.types import (
    Array,
    DetectedObject,
    Observation,
    ObservedScene,
    Pose,
    RgbdFrame,
    Scene,
    SceneObject,
    Trajectory,
)

_SAME_SIZE = 0.0015
_LEAST_SIZE = 0.001


class SensedSim:
    """A sim without its truth: joints, cameras and commands are the sim's, the model to plan in is made of what was seen.

    Args:
        sim: The real one.
        scene: Names the robot and the table; its objects are not read.
    """

    def __init__(self, sim: Sim, scene: Scene) -> None:
        self._sim = sim
        self._frame = scene.model_copy(update={"objects": ()})
        self._robot_model = load_robot(scene.robot_urdf, scene.robot_config, table_height=scene.table_height)
        self._believed: dict[str, DetectedObject] = {}
        self._epoch = 0
        self._world: World = build_world(self._frame, self._robot_model)

    def believe(self, scene: ObservedScene) -> None:
        """Take what was seen as the objects of the world to plan in."""
        seen = {item.id: item for item in scene.objects}
        if seen.keys() == self._believed.keys() and all(_alike(self._believed[name], seen[name]) for name in seen):
            return
        self._believed = seen
        self._epoch += 1
        objects = tuple(_as_object(item) for item in seen.values())
        self._world = build_world(self._frame.model_copy(update={"objects": objects}), self._robot_model)

    # What was perceived.

    @property
    def model(self) -> mujoco.MjModel:
        """The robot, the table and what was seen."""
        return self._world.model

    @property
    def epoch(self) -> int:
        """Changes when something else was seen."""
        return self._epoch

    @property
    def object_bodies(self) -> Mapping[str, int]:
        """Body ids of what was seen."""
        return self._world.object_bodies

    @property
    def body_names(self) -> Sequence[str]:
        """What people call each body."""
        return self._world.names

    def truth(self) -> Truth:
        """Refuse: cameras do not tell it.

        Raises:
            RuntimeError: Always.
        """
        raise RuntimeError("the simulated state was asked for while cameras are to see; ask the perception")

    def arm_contacts(self) -> tuple[tuple[str, str], ...]:
        """Return nothing: the arm has no skin to feel with."""
        return ()

    def strongest_contact(self) -> tuple[float, str, str]:
        """Return the largest force that the robot feels, and on which link; not what it touches."""
        force, link, _ = self._sim.strongest_contact()
        return force, link, "something" if link else ""

    def force_on(self, object_id: str | None) -> Array:
        """Return what a force sensor at the wrist feels, N in the world, shape (3,); it cannot tell of which object."""
        del object_id
        return self._sim.force_on(None)

    def grip_on(self, object_id: str | None) -> float:
        """Return how hard pads that feel are pressed, N; they cannot tell by which object."""
        del object_id
        return self._sim.grip_on(None)

    # What the robot itself knows and does.

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self._sim.robot

    @property
    def time(self) -> float:
        """Simulated seconds since reset."""
        return self._sim.time

    @property
    def episode(self) -> int:
        """Changes with every reset."""
        return self._sim.episode

    @property
    def control_timestep(self) -> float:
        """Seconds between commands."""
        return self._sim.control_timestep

    @property
    def tick_hooks(self) -> list[Callable[[], None]]:
        """Called after every control tick."""
        return self._sim.tick_hooks

    def observe(self, cameras: Sequence[str] = ()) -> Observation:
        """Return proprioception and pictures."""
        return self._sim.observe(cameras)

    def capture(self, camera: str) -> RgbdFrame:
        """Return what a camera's sensor delivers."""
        return self._sim.capture(camera)

    def execute(self, trajectory: Trajectory) -> None:
        """Follow a trajectory."""
        self._sim.execute(trajectory)

    def trim(self, goal: Array) -> None:
        """Let a tick pass, shifted against what keeps the arm off its goal."""
        self._sim.trim(goal)

    def step(self, seconds: float) -> None:
        """Let time pass."""
        self._sim.step(seconds)

    def hold(self) -> None:
        """Command the arm to stay."""
        self._sim.hold()

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Return what an arm joint's servo presses with, and its limit, N m or N."""
        return self._sim.servo_force(joint)

    def set_gripper(self, closed: float) -> None:
        """Command the gripper."""
        self._sim.set_gripper(closed)


def _alike(a: DetectedObject, b: DetectedObject) -> bool:
    return a.kind == b.kind and all(abs(x - y) < _SAME_SIZE for x, y in zip(a.size, b.size, strict=True))


def _as_object(item: DetectedObject) -> SceneObject:
    # Of a mesh no file is known where it was only seen.
    kind = item.kind if item.shape.size_fields else "box"
    # What is badly seen may look like less than a world can be built of.
    size = tuple(max(measure, _LEAST_SIZE) for measure in item.size)
    apart = Pose(xyz=item.pose.xyz, quat_xyzw=item.pose.quat_xyzw)
    return SceneObject(id=item.id, kind=kind, size=size, pose=apart, mass=0.05, open=min(item.opening or 0.0, size[-1]))
