"""LIBERO's environment at one initial state, and the scene's and robot's files that are read from it."""

from __future__ import annotations

import tempfile
from collections.abc import Collection
from pathlib import Path
from typing import Self

import mujoco
import numpy as np
from libero.libero.envs.env_wrapper import ControlEnv

from robosandbox.types import Array, Scene
from robosandbox_libero.servo import JointServo
from robosandbox_libero.tasks import LiberoTask

SIDECAR = Path(__file__).with_name("panda.robosandbox.yaml")
ROBOT_BODY, ROBOT, GRIPPER = "robot0_base", "robot0_", "gripper0_"
ARM_JOINTS = tuple(f"{ROBOT}joint{k}" for k in range(1, 8))
ARM_MOTORS = tuple(f"{ROBOT}torq_j{k}" for k in range(1, 8))
FINGER_JOINTS = tuple(f"{GRIPPER}finger_joint{k}" for k in (1, 2))
FINGER_SERVOS = tuple(f"{GRIPPER}gripper_finger_joint{k}" for k in (1, 2))
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
    """

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
        self.servo = JointServo(self.model, ARM_JOINTS, ARM_MOTORS)
        self.judged_once = False
        self._settle()
        self._folder = tempfile.TemporaryDirectory(prefix="robosandbox-libero-")
        self.scene: Scene = self._written(Path(self._folder.name))

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
        for joint, servo in zip(FINGER_JOINTS, FINGER_SERVOS, strict=True):
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
        robot.write_text(_robot_alone(xml))
        return Scene(world=world, robot_urdf=robot, robot_config=SIDECAR)


def _robot_alone(xml: str) -> str:
    """Return LIBERO's robot without the world around it, as a file."""
    spec = mujoco.MjSpec.from_string(xml)
    world = spec.worldbody
    others = [body for body in world.bodies if body.name != ROBOT_BODY]
    for item in (*others, *world.geoms, *world.sites, *world.cameras, *world.lights, *spec.keys):
        spec.delete(item)
    spec.body(ROBOT_BODY).pos = [0.0, 0.0, 0.0]
    geoms = [geom for body in spec.bodies for geom in body.geoms]
    for mesh in list(spec.meshes):
        if mesh.name not in {geom.meshname for geom in geoms}:
            spec.delete(mesh)
    for material in list(spec.materials):
        if material.name not in {geom.material for geom in geoms}:
            spec.delete(material)
    for texture in list(spec.textures):
        if texture.name not in {name for material in spec.materials for name in material.textures}:
            spec.delete(texture)
    # All its files have whole paths.
    spec.meshdir = spec.texturedir = ""
    spec.compile()
    return str(spec.to_xml())
