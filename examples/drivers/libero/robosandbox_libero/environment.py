"""LIBERO's environment at one initial state, and the scene's and robot's files that are read from it."""

from __future__ import annotations

import tempfile
from collections.abc import Collection
from pathlib import Path
from typing import Self

import mujoco
import numpy as np
from libero.libero.envs.env_wrapper import ControlEnv

from robosandbox.sim.borrowed import Motors, robot_alone
from robosandbox.types import Array, Scene
from robosandbox_libero.servo import LAG, JointServo
from robosandbox_libero.tasks import LiberoTask

SIDECAR = Path(__file__).with_name("panda.robosandbox.yaml")
ROBOT_BODY, ROBOT, GRIPPER = "robot0_base", "robot0_", "gripper0_"
MOTORS = Motors(
    joints=tuple(f"{ROBOT}joint{k}" for k in range(1, 8)),
    arm=tuple(f"{ROBOT}torq_j{k}" for k in range(1, 8)),
    fingers=tuple(f"{GRIPPER}finger_joint{k}" for k in (1, 2)),
    finger_servos=tuple(f"{GRIPPER}gripper_finger_joint{k}" for k in (1, 2)),
    wrist_camera=f"{ROBOT}eye_in_hand",
)
# Name of the keyframe of the settled start.
_START = "start"
# Initial states hang things some centimetres above what they come to lie on: seconds of falling at the most, and of two looks.
_SETTLE, _LOOK = 4.0, 0.1
# Speed of rest, m/s or rad/s.
_REST = 0.005


class LiberoEnvironment:
    """LIBERO's own environment, its things settled at an initial state.

    Physics, motors, states and judge are its own; nothing is rendered.

    Args:
        task: Which task.
        state: Number of the initial state.

    Attributes:
        task: Likewise.
        scene: The world as a file, with LIBERO's robot: what the importer of scenes and the driver read.
        model: MuJoCo's model, LIBERO's.
        data: Its live state.
        motors: What moves the robot.
        lag: Seconds by which a joint trails a moving target.
        name: "LIBERO".
    """

    name = "LIBERO"
    motors = MOTORS
    lag = LAG

    def __init__(self, task: LiberoTask, state: int) -> None:
        self.task = task
        self.env = ControlEnv(
            bddl_file_name=str(task.bddl), use_camera_obs=False, has_renderer=False, has_offscreen_renderer=False
        )
        # Fixtures are laid out by chance, things by the initial state.
        self.env.seed(0)
        self.env.reset()
        self.env.set_init_state(task.state(state))
        self.model: mujoco.MjModel = self.env.sim.model._model
        self.data: mujoco.MjData = self.env.sim.data._data
        self.servo = JointServo(self.model, MOTORS.joints, MOTORS.arm)
        self.judged_once = False
        self._settle()
        self._folder = tempfile.TemporaryDirectory(prefix="robosandbox-libero-")
        self.scene: Scene = self._written(Path(self._folder.name))

    def advance(self, arm: Array, fingers: Array, steps: int) -> None:
        """Let physics steps pass with the joints sent to `arm` (7,); the finger servos are where `fingers` (2,) says already."""
        del fingers
        self.servo.advance(self.data, arm, steps)

    def judge(self) -> bool:
        """Return LIBERO's own verdict on this moment."""
        holds = bool(self.env.check_success())
        self.judged_once = self.judged_once or holds
        return holds

    @property
    def regions(self) -> Collection[str]:
        """Names of the regions that goals speak of, which are sites."""
        return self.env.env.object_sites_dict

    def joints_of(self, name: str) -> tuple[str, ...]:
        """Return the joints of a thing, or of what a region is in."""
        inner = self.env.env
        return tuple((inner.object_sites_dict.get(name) or inner.get_object(name)).joints)

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
        goal: Array = data.qpos[self.servo.qpos].copy()
        for joint, servo in zip(MOTORS.fingers, MOTORS.finger_servos, strict=True):
            data.actuator(servo).ctrl = data.joint(joint).qpos
        look = round(_LOOK / model.opt.timestep)
        for _ in range(round(_SETTLE / _LOOK)):
            self.servo.advance(data, goal, look)
            if np.abs(data.qvel).max() < _REST:
                return

    def _written(self, folder: Path) -> Scene:
        world, robot = folder / "scene.xml", folder / "panda.xml"
        xml = self.env.sim.model.get_xml()
        spec = mujoco.MjSpec.from_string(xml)
        spec.add_key(name=_START, qpos=self.data.qpos)
        spec.compile()
        world.write_text(spec.to_xml())
        world.with_name("scene.robosandbox.yaml").write_text(f"keyframe: {_START}\n")
        robot.write_text(robot_alone(xml, ROBOT_BODY))
        return Scene(world=world, robot_urdf=robot, robot_config=SIDECAR)
