"""LIBERO's environment as a driver: its model and state, seen and moved as any simulated cell is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

import mujoco
import numpy as np

from robosandbox.driver import ARM, Capabilities
from robosandbox.errors import InputError
from robosandbox.robots.robot import Robot
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.populated import populated
from robosandbox.sim.world import ROBOT_PREFIX, World, build_world_of, world_around
from robosandbox.types import Array, Scene, frozen_array
from robosandbox_libero.environment import FINGER_JOINTS, FINGER_SERVOS, LiberoEnvironment
from robosandbox_libero.servo import LAG

_WRIST = "robot0_eye_in_hand"


class LiberoDriver(MuJoCoBackend):
    """LIBERO's Panda in LIBERO's world, commanded in joints.

    Args:
        scene: The environment's.
        environment: What is driven.
        felt: Objects of which the truth is to tell how hard they were pressed.
        wait_hook: Called while things settle; they have.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        environment: LiberoEnvironment,
        felt: Iterable[str] = (),
        wait_hook: Callable[[], None] | None = None,
    ) -> None:
        super().__init__()
        del wait_hook
        self._environment = environment
        self.feel(felt)
        self.adopt(_world_of(environment, populated(scene)))
        self._start: Array = self.snapshot()

    def adopt(self, world: World) -> None:
        """Drive the environment's own state."""
        with np.errstate(divide="ignore"):  # of the lags of servos that torque motors are not
            super().adopt(world)
        self._data = data = self._environment.data
        self._servo_lags = {ARM: np.full(world.robot.n, LAG)}
        data.ctrl[world.robot.actuator_ids] = data.qpos[world.robot.qpos_indices]
        data.time = 0.0
        self._jumped()

    @property
    def capabilities(self) -> Capabilities:
        """All of a simulation but copies."""
        return replace(super().capabilities, fork=False)

    def reset(self, scene: Scene | None = None, q: Array | Mapping[str, Array] | None = None) -> None:
        """Start over at the initial state, settled.

        Raises:
            InputError: Another scene or configuration is asked for.
        """
        if (scene is not None and populated(scene) != self.scene) or q is not None:
            raise InputError(
                "a LIBERO environment starts over as its initial state has it; open another for another state"
            )
        self.restore(self._start)
        self.physics_steps = 0

    def servo_force(self, arm: str, joint: int) -> tuple[float, float]:
        """Return what a joint's motor gives now and the most that it can, N m."""
        motor = int(self.robots[arm].actuator_ids[joint])
        return abs(float(self._live.actuator_force[motor])), float(self.model.actuator_ctrlrange[motor, 1])

    def _advance(self, steps: int) -> None:
        """Let physics steps pass; between ticks the controls of the motors are where the joints are sent."""
        data, motors = self._live, self._environment.servo.actuators
        goal: Array = data.ctrl[motors].copy()
        self._environment.servo.advance(data, goal, steps)
        data.ctrl[motors] = goal


def _world_of(environment: LiberoEnvironment, scene: Scene) -> World:
    """Return the environment's model as the world of its scene."""
    model, planned = environment.model, build_world_of(scene)
    robot = _rebound(planned.robot, planned.model, environment)
    names = [str(model.camera(number).name) for number in range(model.ncam)]
    cameras = {"wrist" if name == _WRIST else name: name for name in names}
    return world_around(model, scene, {ARM: robot}, planned.sidecars, cameras)


def _rebound(robot: Robot, planned: mujoco.MjModel, environment: LiberoEnvironment) -> Robot:
    """Return a robot of a planning model with the indices of its like in the environment's model."""
    model, servo, gripper = environment.model, environment.servo, robot.gripper
    assert gripper is not None

    def there(bodies: Iterable[int]) -> frozenset[int]:
        names = [str(planned.body(body).name).removeprefix(ROBOT_PREFIX) for body in bodies]
        return frozenset(model.body(name).id for name in names)

    joints = np.array([model.joint(name).qposadr[0] for name in FINGER_JOINTS])
    left, right = gripper.finger_bodies
    bodies = there(robot.bodies)
    return replace(
        robot,
        qpos_indices=servo.qpos,
        dof_indices=servo.dofs,
        actuator_ids=servo.actuators,
        control_scale=frozen_array(np.ones(robot.n)),
        control_offset=frozen_array(np.zeros(robot.n)),
        tcp_site=model.site(str(planned.site(robot.tcp_site).name).removeprefix(ROBOT_PREFIX)).id,
        bodies=bodies,
        base_position=frozen_array(model.body_pos[min(bodies)]),
        gripper=replace(
            gripper,
            qpos_index=int(joints[0]),
            joint_indices=joints,
            actuator_ids=np.array([model.actuator(name).id for name in FINGER_SERVOS]),
            bodies=there(gripper.bodies),
            finger_bodies=(there(left), there(right)),
        ),
    )
