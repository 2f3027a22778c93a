"""MetaWorld's environment at one start: the process that runs it, and the scene's and hand's files that are read from it."""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

import mujoco
import numpy as np
import yaml

from robosandbox.types import Array, Scene, frozen_array

PROCESS = Path(__file__).with_name("metaworld_process.py")
# MetaWorld's names of the robot's bodies: the last link, to which the hand is fixed, and the hand.
LAST_LINK, HAND = "right_l6", "hand"
FINGER_JOINTS = ("r_close", "l_close")
# Ours, of the three slides on which the hand is planned, and of the point between its fingertips.
SLIDES, TCP = ("hand_x", "hand_y", "hand_z"), "tcp"
# The name that MetaWorld's process gives the start.
_START = "start"
# Metres from the middle of the hand to the TCP, along the fingers, which end 45 mm from there.
TCP_DEPTH = 0.033
# Of the planned hand: m/s, of the 0.8 that actions allow, so that what lags can be made up for; m/s^2 at which the weld follows.
_SPEED, _ACCELERATION = 0.5, 3.0
# N that the hand may press with what it is told to move: some of MetaWorld's buttons count when they are pushed past their stop.
_MOST_FORCE = 200.0
# Metres by which the weld lets the hand stand off its target, so that where that ends is not where the hand does.
_GIVES = 0.005
# How actions hold the hand: its x points down.
_LEVEL = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
# N that a finger gives at the most: what the hand may press with; the motors would give 400.
GRIP = _MOST_FORCE


class MetaWorldProcess:
    """MetaWorld in a process and an environment of its own, which runs one of its tasks.

    Args:
        task: Its name, as drawer-open-v3.
        command: What starts the process, without its argument.
    """

    def __init__(self, task: str, command: Sequence[str] = ("uv", "run", "--quiet", "--script", str(PROCESS))) -> None:
        self._process = subprocess.Popen([*command, task], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, line: object) -> dict[str, Any]:
        """Send the number of a start, an action (4,), or None for the start once more; return the state that comes of it."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(line) + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise RuntimeError(f"MetaWorld's process has ended with {self._process.wait()}")
        state: dict[str, Any] = json.loads(answer)
        return state

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(timeout=10.0)


class MetaWorldEnvironment:
    """A task of MetaWorld at one of its starts.

    Args:
        process: Runs the task.
        number: Which of the 50 starts that MetaWorld draws of its seed 0.

    Attributes:
        scene: The world as MetaWorld's file, with the hand on slides for a robot.
        goal: Where MetaWorld says that the goal is, shape (3,).
        limit: Steps after which MetaWorld ends an episode; it is not ended here.
        steps: Steps made.
        judged: MetaWorld's verdict now.
        judged_once: At any moment.
        judged_in_time: At any moment within the limit.
    """

    def __init__(self, process: MetaWorldProcess, number: int) -> None:
        self._process = process
        self._folder = tempfile.TemporaryDirectory(prefix="robosandbox-metaworld-")
        about = process.ask(number)
        self.goal: Array = frozen_array(about["goal"])
        self.limit: int = about["limit"]
        self.timestep: float = about["timestep"]
        self._scale: float = about["scale"]
        self._low, self._high = np.array(about["low"]), np.array(about["high"])
        self.state: dict[str, Any] = about
        self.steps = 0
        self.judged = self.judged_once = self.judged_in_time = False
        self.scene: Scene = self._written(Path(self._folder.name), about["mjcf"])

    def step(self, hand: Array, effort: float) -> None:
        """Let one step pass, the hand's target sent to `hand` (3,), no faster than actions allow.

        Args:
            hand: Likewise, metres.
            effort: What closes the fingers, -1 to 1.
        """
        action = (hand - np.array(self.state["mocap_pos"])) / self._scale
        self.state = self._process.ask([*np.clip(action, -1.0, 1.0).tolist(), effort])
        self.steps += 1
        self.judged = self.state["success"]
        self.judged_once = self.judged_once or self.judged
        self.judged_in_time = self.judged_in_time or (self.judged and self.steps <= self.limit)

    def reset(self) -> None:
        """Start over."""
        self.state = self._process.ask(None)
        self.steps = 0
        self.judged = self.judged_once = self.judged_in_time = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()

    def _written(self, folder: Path, mjcf: str) -> Scene:
        world, robot, sidecar = folder / "scene.xml", folder / "hand.xml", folder / "hand.robosandbox.yaml"
        world.write_text(mjcf)
        world.with_name("scene.robosandbox.yaml").write_text(f"keyframe: {_START}\n")
        start = np.array(self.state["hand"])
        low, high = np.minimum(self._low, start) - _GIVES, np.maximum(self._high, start) + _GIVES
        robot.write_text(_hand_alone(mjcf, low, high))
        roles = {
            "arm": {
                "joints": list(SLIDES),
                "actuators": list(SLIDES),
                "home_qpos": start.tolist(),
                "velocity_limits": [_SPEED] * 3,
                "acceleration_limits": [_ACCELERATION] * 3,
            },
            "gripper": {
                "joints": list(FINGER_JOINTS),
                "primary_joint": FINGER_JOINTS[0],
                "actuators": list(FINGER_JOINTS),
                "open_qpos": 0.0,
                "closed_qpos": 0.04,
            },
            "ee_site": {"name": TCP},
            "limits": {"max_force_n": _MOST_FORCE},
        }
        sidecar.write_text(yaml.safe_dump(roles))
        return Scene(world=world, robot_urdf=robot, robot_config=sidecar)


def _hand_alone(mjcf: str, low: Array, high: Array) -> str:
    """Return MetaWorld's hand, and what of the arm is fixed to it, on three slides that end where its target does."""
    model = mujoco.MjModel.from_xml_string(mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    spec = mujoco.MjSpec()
    spec.compiler.autolimits = True
    at = spec.worldbody
    for axis, name in enumerate(SLIDES):
        at = at.add_body(name=name, mass=1.0, inertia=[0.01] * 3, explicitinertial=True)
        at.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=np.eye(3)[axis], range=[low[axis], high[axis]])
    link, hand = model.body(LAST_LINK).id, data.body(HAND)
    # Actions hold the hand level, its x down.
    turn = _LEVEL @ hand.xmat.reshape(3, 3).T
    made = {
        link: at.add_body(
            name=LAST_LINK,
            pos=turn @ (data.xpos[link] - hand.xpos),
            quat=_quat(turn @ data.xmat[link].reshape(3, 3)),
        )
    }
    for body in range(link + 1, model.nbody):
        parent = int(model.body_parentid[body])
        if parent in made:
            name = str(model.body(body).name)
            made[body] = made[parent].add_body(name=name, pos=model.body_pos[body], quat=model.body_quat[body])
    others = ~np.isin(model.geom_bodyid, [*made])
    gives, takes = model.geom_contype, model.geom_conaffinity
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        # What of the hand meets nothing there is none here.
        meets = (gives[geom] & takes[others]) | (gives[others] & takes[geom])
        if body in made and meets.any():
            _add_geom(spec, made[body], model, geom)
    for name in FINGER_JOINTS:
        joint = model.joint(name)
        made[int(joint.bodyid[0])].add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=joint.axis,
            range=joint.range,
            armature=0.1,
            damping=[10.0, 0.0, 0.0],
        )
    for name in SLIDES:
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=2000.0, dampratio=1.0)
    for name in FINGER_JOINTS:
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=2000.0)
        actuator.ctrlrange, actuator.forcerange = model.joint(name).range, [-GRIP, GRIP]
    # z out of the hand, y along the closing of the fingers.
    half = float(np.sqrt(0.5))
    spec.body(HAND).add_site(name=TCP, pos=[TCP_DEPTH, 0.0, 0.0], quat=[half, 0.0, half, 0.0])
    spec.compile()
    return str(spec.to_xml())


def _add_geom(spec: mujoco.MjSpec, body: mujoco.MjsBody, model: mujoco.MjModel, geom: int) -> None:
    """Give a body a geom of another model, by its numbers."""
    kind, pos, quat = int(model.geom_type[geom]), model.geom_pos[geom], model.geom_quat[geom]
    made = body.add_geom(type=mujoco.mjtGeom(kind), size=model.geom_size[geom], pos=pos, quat=quat)
    if kind == mujoco.mjtGeom.mjGEOM_MESH.value:
        mesh = int(model.geom_dataid[geom])
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        made.meshname = f"mesh_{geom}"
        corners = model.mesh_vert[first : first + count]
        # Convex, and about its own middle: a mesh of a compiled model is moved there.
        spec.add_mesh(name=made.meshname, uservert=corners.flatten().tolist())
    made.margin, made.gap = float(model.geom_margin[geom]), float(model.geom_gap[geom])
    made.friction, made.solref, made.solimp = (
        model.geom_friction[geom],
        model.geom_solref[geom],
        model.geom_solimp[geom],
    )


def _quat(rotation: Array) -> Array:
    """Return a rotation (3, 3) as MuJoCo's quaternion."""
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, rotation.flatten())
    return found
