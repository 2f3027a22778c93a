"""A cell in a model and a state that another simulation owns and steps, its robot planned from a file of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import mujoco
import numpy as np

from robosandbox.driver import ARM, Capabilities
from robosandbox.errors import InputError
from robosandbox.robots.robot import Gripper, Robot
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.populated import populated
from robosandbox.sim.world import ROBOT_PREFIX, World, build_world_of, world_around
from robosandbox.types import Array, Scene, frozen_array


@dataclass(frozen=True, slots=True, kw_only=True)
class Motors:
    """Names of what moves a robot in the other simulation's model.

    Attributes:
        joints: The arm's, in the order of a configuration.
        arm: Their torque motors, likewise.
        fingers: Joints of the gripper; none where there is no gripper.
        finger_servos: Position servos of the gripper.
        wrist_camera: The camera on the hand, if any.
    """

    joints: tuple[str, ...]
    arm: tuple[str, ...]
    fingers: tuple[str, ...] = ()
    finger_servos: tuple[str, ...] = ()
    wrist_camera: str | None = None


class OtherSimulation(Protocol):
    """A simulation in MuJoCo that is not ours.

    Attributes:
        scene: The world as a file, with the robot as another: what the importer of scenes reads.
        model: Its model.
        data: Its live state.
        motors: What moves the robot in it.
        lag: Seconds by which a joint trails a moving target.
        name: What it is called in messages.
    """

    scene: Scene
    model: mujoco.MjModel
    data: mujoco.MjData
    motors: Motors
    lag: float
    name: str

    def advance(self, arm: Array, fingers: Array, steps: int) -> None:
        """Let physics steps pass with the arm's joints sent to `arm` (n,) and the finger servos to `fingers` (k,)."""


class BorrowedBackend(MuJoCoBackend):
    """A robot in a world that another simulation owns, commanded in joints.

    Args:
        scene: The other simulation's.
        environment: What is driven.
        control_timestep: Seconds between commands.
        felt: Objects of which the truth is to tell how hard they were pressed.
        wait_hook: Called while things settle; they have.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        environment: OtherSimulation,
        control_timestep: float = 0.01,
        felt: Iterable[str] = (),
        wait_hook: Callable[[], None] | None = None,
    ) -> None:
        super().__init__(control_timestep=control_timestep)
        del wait_hook
        self._environment = environment
        self.feel(felt)
        self.adopt(_world_of(environment, populated(scene)))
        self._start: Array = self.snapshot()

    def adopt(self, world: World) -> None:
        """Drive the other simulation's own state."""
        with np.errstate(divide="ignore"):  # of the lags of servos that torque motors are not
            super().adopt(world)
        self._data = data = self._environment.data
        self._servo_lags = {ARM: np.full(world.robot.n, self._environment.lag)}
        data.ctrl[world.robot.actuator_ids] = data.qpos[world.robot.qpos_indices]
        data.time = 0.0
        self._jumped()

    @property
    def capabilities(self) -> Capabilities:
        """All of a simulation but copies."""
        return replace(super().capabilities, fork=False)

    def reset(self, scene: Scene | None = None, q: Array | Mapping[str, Array] | None = None) -> None:
        """Start over where the other simulation was when it was borrowed.

        Raises:
            InputError: Another scene or configuration is asked for.
        """
        if (scene is not None and populated(scene) != self.scene) or q is not None:
            raise InputError(
                f"{self._environment.name} starts over as its initial state has it; open another for another state"
            )
        self.restore(self._start)
        self.physics_steps = 0

    def servo_force(self, arm: str, joint: int) -> tuple[float, float]:
        """Return what a joint's motor gives now and the most that it can, N m."""
        motor = int(self.robots[arm].actuator_ids[joint])
        return abs(float(self._live.actuator_force[motor])), float(self.model.actuator_ctrlrange[motor, 1])

    def _advance(self, steps: int) -> None:
        """Let physics steps pass; between ticks the controls of motors and servos are where joints and fingers are sent."""
        data, robot = self._live, self.robot
        servos = np.array([], dtype=int) if robot.gripper is None else robot.gripper.actuator_ids
        goal: Array = data.ctrl[robot.actuator_ids].copy()
        fingers: Array = data.ctrl[servos].copy()
        self._environment.advance(goal, fingers, steps)
        data.ctrl[robot.actuator_ids], data.ctrl[servos] = goal, fingers


def robot_alone(xml: str, body: str) -> str:
    """Return an arm of an MJCF text without the world around it, at the origin, as a text with whole paths.

    Args:
        xml: The world with the robot.
        body: Name of the body on which the robot hangs.
    """
    spec = mujoco.MjSpec.from_string(xml)
    world = spec.worldbody
    others = [one for one in world.bodies if one.name != body]
    for item in (*others, *world.geoms, *world.sites, *world.cameras, *world.lights, *spec.keys):
        spec.delete(item)
    spec.body(body).pos = [0.0, 0.0, 0.0]
    geoms = [geom for one in spec.bodies for geom in one.geoms]
    for mesh in list(spec.meshes):
        if mesh.name not in {geom.meshname for geom in geoms}:
            spec.delete(mesh)
    for material in list(spec.materials):
        if material.name not in {geom.material for geom in geoms}:
            spec.delete(material)
    for texture in list(spec.textures):
        if texture.name not in {name for material in spec.materials for name in material.textures}:
            spec.delete(texture)
    spec.meshdir = spec.texturedir = ""
    spec.compile()
    return str(spec.to_xml())


def _world_of(environment: OtherSimulation, scene: Scene) -> World:
    """Return the other simulation's model as the world of its scene."""
    model, planned = environment.model, build_world_of(scene)
    robot = _rebound(planned.robot, planned.model, environment)
    names = [str(model.camera(number).name) for number in range(model.ncam)]
    cameras = {"wrist" if name == environment.motors.wrist_camera else name: name for name in names}
    return world_around(model, scene, {ARM: robot}, planned.sidecars, cameras)


def _rebound(robot: Robot, planned: mujoco.MjModel, environment: OtherSimulation) -> Robot:
    """Return a robot of a planning model with the indices of its like in the other simulation's model."""
    model, motors = environment.model, environment.motors
    joints = [model.joint(name).id for name in motors.joints]

    def there(bodies: Iterable[int]) -> frozenset[int]:
        names = [str(planned.body(body).name).removeprefix(ROBOT_PREFIX) for body in bodies]
        return frozenset(model.body(name).id for name in names)

    def hand(gripper: Gripper) -> Gripper:
        fingers = np.array([model.joint(name).qposadr[0] for name in motors.fingers])
        left, right = gripper.finger_bodies
        return replace(
            gripper,
            qpos_index=int(fingers[0]),
            joint_indices=fingers,
            actuator_ids=np.array([model.actuator(name).id for name in motors.finger_servos]),
            bodies=there(gripper.bodies),
            finger_bodies=(there(left), there(right)),
        )

    bodies = there(robot.bodies)
    return replace(
        robot,
        qpos_indices=model.jnt_qposadr[joints].copy(),
        dof_indices=model.jnt_dofadr[joints].copy(),
        actuator_ids=np.array([model.actuator(name).id for name in motors.arm]),
        control_scale=frozen_array(np.ones(robot.n)),
        control_offset=frozen_array(np.zeros(robot.n)),
        tcp_site=model.site(str(planned.site(robot.tcp_site).name).removeprefix(ROBOT_PREFIX)).id,
        bodies=bodies,
        base_position=frozen_array(model.body_pos[min(bodies)]),
        gripper=None if robot.gripper is None else hand(robot.gripper),
    )
