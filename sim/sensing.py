"""Sensing of the simulated robot and its cameras, and the contacts and true state that only a simulation knows."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import mujoco
import numpy as np

from robosandbox.driver import CameraSpec, Guard
from robosandbox.errors import InputError
from robosandbox.robots.robot import Robot
from robosandbox.sim.contacts import Contacts
from robosandbox.sim.control import ControlledSimulation
from robosandbox.sim.lookahead import Lookahead
from robosandbox.sim.object_states import ObjectStates
from robosandbox.sim.rendering import OffscreenRenderer
from robosandbox.sim.sensors import FRAME_SIZE, Sensor, perfect_intrinsics
from robosandbox.sim.step_recorder import StepRecorder
from robosandbox.sim.suction import seal
from robosandbox.sim.world import World
from robosandbox.types import (
    ArmState,
    ArmTruth,
    Array,
    Observation,
    PictureWindow,
    Pose,
    Posture,
    RgbdFrame,
    Truth,
    frozen_array,
)

# MuJoCo's cameras look along -z with y up.
_OPTICAL = np.diag([1.0, -1.0, -1.0])


class SensedSimulation(ControlledSimulation):
    """A simulation whose arms and hands take commands, with all that they and the cameras measure.

    Args:
        control_timestep: Seconds between commands to the servos.
        render_size: (height, width) of camera pictures, pixels.
        sensor: What `capture` sees through.

    Attributes:
        render_size: Likewise.
        sensor: Likewise.
    """

    def __init__(self, control_timestep: float, render_size: tuple[int, int], sensor: Sensor) -> None:
        super().__init__(control_timestep)
        self.render_size = render_size
        self.sensor = sensor
        # An OpenGL context belongs to the thread that draws with it.
        self._renderers: dict[tuple[int, tuple[int, int]], OffscreenRenderer] = {}
        self._past: deque[tuple[float, Array]] = deque()
        self._exposure: tuple[mujoco.MjModel, mujoco.MjData] | None = None
        self._specs: dict[str, CameraSpec] | None = None
        self._objects: ObjectStates | None = None
        self._seen_at = -1
        self._seen: dict[str, ArmState] = {}

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names that `observe(cameras=...)` takes."""
        return tuple(self._loaded.cameras)

    def camera_in_model(self, name: str) -> str:
        """Return what the model calls a camera.

        Raises:
            InputError: No such camera.
        """
        cameras = self._loaded.cameras
        if name not in cameras:
            raise InputError(f"camera {name!r} is not one of {', '.join(cameras)}")
        return cameras[name]

    def camera_specs(self) -> Mapping[str, CameraSpec]:
        """Return the cameras as they are built in."""
        if self._specs is None:
            world, data = self._loaded, mujoco.MjData(self.model)
            mujoco.mj_kinematics(world.model, data)
            mujoco.mj_camlight(world.model, data)
            self._specs = {name: _camera_spec(world, data, found) for name, found in world.cameras.items()}
        return self._specs

    def adopt(self, world: World) -> None:
        """Simulate a compiled world, everything where the model has it."""
        super().adopt(world)
        self._specs = None
        self._objects = None

    def state(self, cameras: Sequence[str] = ()) -> Observation:
        """Return proprioception, and a picture per named camera.

        Raises:
            InputError: No such camera.
            RenderingError: No OpenGL on this machine.
        """
        if cameras:
            mujoco.mj_kinematics(self.model, self._live)
        return Observation(
            time=self.time,
            arms={name: self.arm_state(name) for name in self.robots},
            images={name: self._render(name) for name in cameras},
        )

    def arm_state(self, name: str) -> ArmState:
        """Return an arm's proprioception, and its gripper's; what is asked twice in one moment is worked out once."""
        world, data = self._loaded, self._live
        if self._seen_at != self._moment:
            mujoco.mj_kinematics(world.model, data)
            self._seen_at, self._seen = self._moment, {}
        if name not in self._seen:
            robot = world.robots[name]
            gripper = robot.gripper.state(data) if robot.gripper else None
            if gripper is not None and (sealed := seal(world, robot, data)) is not None:
                gripper = replace(gripper, seal=sealed)
            self._seen[name] = ArmState(
                time=float(data.time),
                q=frozen_array(data.qpos[robot.qpos_indices]),
                qd=frozen_array(data.qvel[robot.dof_indices]),
                tcp_pose=Pose.from_matrix(*robot.tcp(data)),
                gripper=gripper,
            )
        return self._seen[name]

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return what the sensor delivers of a camera now: colour, depth, and how robot and camera stood.

        Args:
            camera: Its name.
            window: The part that is asked for; it is as in the whole frame, and the rest is black and without depth.

        Raises:
            InputError: No such camera.
            RenderingError: No OpenGL on this machine.
        """
        name = self.camera_in_model(camera)
        model, data = self.model, self._exposed()
        lens = self.camera_specs()[camera].intrinsics
        drawn = None if window is None else self.sensor.needs(lens, window)
        rgb, depth = self._renderer(FRAME_SIZE).rgbd(data, name, drawn)
        number = model.camera(name).id
        pose = Pose.from_matrix(data.cam_xpos[number], data.cam_xmat[number].reshape(3, 3) @ _OPTICAL)
        frame = RgbdFrame(
            camera=camera,
            time=float(data.time),
            rgb=rgb,
            depth=depth,
            intrinsics=lens,
            pose_camera_in_world=pose,
            arms={name: _posture(robot, data) for name, robot in self.robots.items()},
        )
        return self.sensor.sense(frame, window)

    def truth(self, *, for_judging: bool = True) -> Truth:
        """Return the simulated state.

        Args:
            for_judging: Say also what objects are made of and what presses on them; ground-truth perception, which looks all
                the time, needs neither.
        """
        world, data = self._loaded, self._live
        mujoco.mj_kinematics(world.model, data)
        if self._objects is None or self._objects.world is not world:
            self._objects = ObjectStates(world, data, self.sleepers, self._mesh_sizes)
        objects, hands = self._objects.read(self._felt, for_judging=for_judging)
        return Truth(
            time=float(data.time),
            arms={
                name: ArmTruth(q=frozen_array(data.qpos[robot.qpos_indices]), home_q=robot.home_q)
                for name, robot in world.robots.items()
            },
            table_height=world.scene.table_height,
            table_area=world.scene.table_area,
            objects=objects,
            hands=hands,
        )

    def in_hands(self) -> dict[str, str | None]:
        """Return by hand the object that both its sides touch, or its cup has sucked on to."""
        return Contacts(self._loaded, self._live).by_object()[1]

    def servo_force(self, arm: str, joint: int) -> tuple[float, float]:
        """Return what an arm joint's servo gives now and the most that it can, N m or N; infinite without a limit."""
        actuator = int(self.robots[arm].actuator_ids[joint])
        limited = bool(self.model.actuator_forcelimited[actuator])
        limit = float(np.abs(self.model.actuator_forcerange[actuator]).max()) if limited else np.inf
        return abs(float(self._live.actuator_force[actuator])), limit

    def contact_forces(self) -> list[tuple[float, int, int]]:
        """Return normal force, N, and body ids of every contact of the robot, those with itself included."""
        return Contacts(self._loaded, self._live).of_robot()

    def strongest_contact(self, arm: str | None = None) -> tuple[float, str, str]:
        """Return the largest normal force between an arm, or any, and anything else, N, and the two bodies; 0 without one."""
        # Asked at every tick of a guarded motion, and mostly nothing is touched.
        alone = len(self.robots) == 1
        if alone and not self.forces():
            return 0.0, "", ""
        return Contacts(self._loaded, self._live).strongest(None if alone else arm)

    def grip_on(self, hand: str, object_id: str | None) -> float:
        """Return with how much force each side of a hand presses on an object, N; None is whatever is there."""
        return Contacts(self._loaded, self._live).grip_on(self._loaded.grippers[hand], object_id)

    def contacts(self, arm: str | None = None) -> tuple[tuple[str, str], ...]:
        """Return the pairs (body of an arm, other body) that touch now, without the arm's own; of all where none is named."""
        return Contacts(self._loaded, self._live).of_arm(arm)

    def contacts_around(self, carried: Iterable[str] = ()) -> list[tuple[str, str, float]]:
        """Return (link or carried object, what it touches, N) of the robot and of these objects, its grip on them left out."""
        return Contacts(self._loaded, self._live).around(carried)

    def lookahead(self, arm: str) -> Lookahead:
        """Return what tells what an arm would press into where it is sent; it ends with the model."""
        return Lookahead(self._loaded, self._live, arm)

    def log(self, capacity: int) -> StepRecorder:
        """Return a log that can take down this world's state; it ends with the model."""
        return StepRecorder(self._loaded, self._live, self.sleepers, capacity)

    def _jumped(self) -> None:
        self._past.clear()
        if self._objects is not None:
            self._objects.forget()
        super()._jumped()

    def _tick(self, guards: Sequence[Guard] = ()) -> None:
        if self.sensor.latency > 0.0:
            self._remember()
        super()._tick(guards)

    def _unload(self) -> None:
        for renderer in self._renderers.values():
            renderer.close()
        self._renderers = {}
        self._past.clear()
        self._exposure = None
        self._specs = None
        self._objects = None
        self._seen_at, self._seen = -1, {}
        super()._unload()

    def _render(self, camera: str) -> np.ndarray:
        name = self.camera_in_model(camera)
        mujoco.mj_camlight(self.model, self._live)
        return self._renderer(self.render_size).render(self._live, name)

    def _renderer(self, size: tuple[int, int]) -> OffscreenRenderer:
        key = (threading.get_ident(), size)
        if key not in self._renderers:
            self._renderers[key] = OffscreenRenderer(self.model, size)
        return self._renderers[key]

    def _remember(self) -> None:
        now = float(self._live.time)
        self._past.append((now, self._live.qpos.copy()))
        while len(self._past) > 1 and self._past[1][0] <= now - self.sensor.latency:
            self._past.popleft()

    def _exposed(self) -> mujoco.MjData:
        """Return the world as it was when the picture that is delivered now was exposed."""
        data = self._live
        moment = float(data.time) - self.sensor.latency
        if self.sensor.latency > 0.0 and self._past and self._past[-1][0] > 0.0:
            if self._exposure is None or self._exposure[0] is not self.model:
                self._exposure = self.model, mujoco.MjData(self.model)
            data = self._exposure[1]
            time, qpos = next((past for past in reversed(self._past) if past[0] <= moment), self._past[0])
            data.qpos, data.time = qpos, time
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_camlight(self.model, data)
        return data


def _posture(robot: Robot, data: mujoco.MjData) -> Posture:
    fingers = data.qpos[robot.gripper.joint_indices] if robot.gripper else np.zeros(0)
    return Posture(q=frozen_array(data.qpos[robot.qpos_indices]), gripper_q=frozen_array(fingers))


def _camera_spec(world: World, data: mujoco.MjData, name: str) -> CameraSpec:
    """Return a camera as it is built in, of a model whose kinematics are computed."""
    model = world.model
    number = model.camera(name).id
    pose = Pose.from_matrix(data.cam_xpos[number], data.cam_xmat[number].reshape(3, 3) @ _OPTICAL)
    arm = world.arm_of_body(int(model.cam_bodyid[number]))
    return CameraSpec(
        intrinsics=perfect_intrinsics(FRAME_SIZE, float(np.radians(model.cam_fovy[number]))),
        pose=pose if arm is None else Pose.from_matrix(*world.robots[arm].tcp(data)).inverse() @ pose,
        arm=arm,
        windows=True,
    )
