"""A task of robosuite at one start, and the scene's and robot's files that are read from it."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, Self

import mujoco
import numpy as np
import robosuite

import robosandbox_robosuite.mujoco_names  # noqa: F401  before any environment is made
from robosandbox.sim.borrowed import Motors, robot_alone
from robosandbox.types import Array, Scene

ROBOT_BODY = "robot0_base"
# Commands a second: one at each control tick of ours, five physics steps.
CONTROL_HZ = 100
# Natural frequency of the joints' controller, rad/s, critically damped: a fifth of what a physics step of 2 ms can follow.
_FREQUENCY = 100.0
# robosuite's own controllers of joints and gripper; torques are bounded by the motors.
_CONTROLLERS = {
    "type": "BASIC",
    "body_parts": {
        "right": {
            "type": "JOINT_POSITION",
            "input_type": "absolute",
            "kp": _FREQUENCY**2,
            "damping_ratio": 1,
            "interpolation": None,
            "gripper": {"type": "GRIP"},
        }
    },
}
# Seconds after which robosuite ends an episode by default: 1000 actions at 20 Hz. It is not ended here.
LIMIT = 50.0
# Name of the keyframe of the settled start.
_START = "start"
# Things are laid a little above what they come to lie on: seconds of falling at the most, and of two looks.
_SETTLE, _LOOK = 4.0, 0.1
# Speed of rest, m/s or rad/s.
_REST = 0.005


class RobosuiteEnvironment:
    """robosuite's own environment, its things settled at a start.

    Physics, motors, controllers, starts and judge are its own; nothing is rendered.

    Args:
        task: Name of the environment, as "PickPlaceCan".
        seed: Of its start.

    Attributes:
        env: The environment.
        scene: The world as a file, with robosuite's robot.
        model: MuJoCo's model, robosuite's.
        data: Its live state.
        motors: What moves the robot.
        lag: Seconds by which a joint trails a moving target: critically damped, twice the controller's time constant.
        name: "robosuite".
        judged: robosuite's verdict now.
        judged_once: At any moment.
        judged_in_time: At any moment within robosuite's limit.
    """

    name = "robosuite"

    def __init__(self, task: str, seed: int) -> None:
        self.env: Any = robosuite.make(
            task,
            robots="Panda",
            controller_configs=_CONTROLLERS,
            control_freq=CONTROL_HZ,
            has_renderer=False,
            has_offscreen_renderer=False,
            use_camera_obs=False,
            ignore_done=True,
            seed=seed,
        )
        self.env.reset()
        for observable in self.env.observation_names:
            self.env.modify_observable(observable, "enabled", False)
        self.model: mujoco.MjModel = self.env.sim.model._model
        self.data: mujoco.MjData = self.env.sim.data._data
        robot = self.env.robots[0]
        hand = robot.gripper["right"]
        self.motors = Motors(
            joints=tuple(robot.robot_joints),
            arm=tuple(robot.robot_model.actuators),
            fingers=tuple(hand.joints),
            finger_servos=tuple(hand.actuators),
            wrist_camera="robot0_eye_in_hand",
        )
        self.lag = 2.0 / _FREQUENCY
        self._hand = hand
        self._servos = np.array([self.model.actuator(name).id for name in hand.actuators], dtype=int)
        self.judged = self.judged_once = self.judged_in_time = False
        self._actions = 0
        self._settle()
        self._folder = tempfile.TemporaryDirectory(prefix="robosandbox-robosuite-")
        self.scene: Scene = self._written(Path(self._folder.name))

    def advance(self, arm: Array, fingers: Array, steps: int) -> None:
        """Let one command of robosuite pass.

        Args:
            arm: Where the joints are sent, rad, shape (n,).
            fingers: Where the finger servos are, metres, shape (k,).
            steps: Physics steps of a command.

        Raises:
            ValueError: A command takes another number of physics steps.
        """
        if steps != round(1.0 / (CONTROL_HZ * self.model.opt.timestep)):
            raise ValueError(f"{steps} physics steps: a command of robosuite at {CONTROL_HZ} Hz takes others")
        action = np.zeros(self.env.action_dim)
        action[: len(arm)] = arm
        if len(fingers):
            # An action moves the gripper's goal by a fixed step; no step keeps the goal, which is ours.
            low, high = self.model.actuator_ctrlrange[self._servos].T
            self._hand.current_action = (2.0 * fingers - low - high) / (high - low)
        self.env.step(action)
        self._actions += 1
        self.judged = bool(self.env._check_success())
        self.judged_once = self.judged_once or self.judged
        self.judged_in_time = self.judged_in_time or (self.judged and self._actions <= LIMIT * CONTROL_HZ)

    @property
    def chosen(self) -> str:
        """The thing that is to be moved where a task has one of several; "" elsewhere."""
        if not getattr(self.env, "single_object_mode", 0):
            return ""
        things = self.env.nuts if hasattr(self.env, "nuts") else self.env.objects
        number = self.env.nut_id if hasattr(self.env, "nuts") else self.env.object_id
        return str(self.env.obj_to_use if number is None else things[number].name)

    def close(self) -> None:
        """Free it."""
        self.env.close()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _settle(self) -> None:
        """Let things fall and come to rest, the arm holding where it is."""
        model, data = self.model, self.data
        arm = data.qpos[[model.joint(name).qposadr[0] for name in self.motors.joints]].copy()
        fingers = np.array([data.joint(name).qpos[0] for name in self.motors.fingers])
        steps = round(1.0 / (CONTROL_HZ * model.opt.timestep))
        for _ in range(round(_SETTLE / _LOOK)):
            for _ in range(round(_LOOK * CONTROL_HZ)):
                self.advance(arm, fingers, steps)
            if np.abs(data.qvel).max() < _REST:
                break
        self.judged = self.judged_once = self.judged_in_time = bool(self.env._check_success())
        self._actions = 0

    def _written(self, folder: Path) -> Scene:
        world, robot = folder / "scene.xml", folder / "panda.xml"
        xml = self.env.sim.model.get_xml()
        spec = mujoco.MjSpec.from_string(xml)
        spec.add_key(name=_START, qpos=self.data.qpos)
        spec.compile()
        world.write_text(spec.to_xml())
        world.with_name("scene.robosandbox.yaml").write_text(f"keyframe: {_START}\n")
        robot.write_text(robot_alone(xml, ROBOT_BODY))
        sidecar = "panda" if self.motors.fingers else "wiper"
        return Scene(
            world=world,
            robot_urdf=robot,
            robot_config=Path(__file__).with_name(f"{sidecar}.robosandbox.yaml"),
        )
