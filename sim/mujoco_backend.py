"""The MuJoCo world as a process-local sim: load, reset, move, observe."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Self

import mujoco
import numpy as np

from robosandbox.drivers import Capabilities, ControlLoop
from robosandbox.errors import InputError
from robosandbox.protocols import Guard
from robosandbox.robots.loader import load_robot
from robosandbox.robots.robot import Robot
from robosandbox.robots.sidecar import Sidecar
from robosandbox.shapes.mesh_file import mesh_bounds
from robosandbox.sim.calibration_board import CalibrationBoard
from robosandbox.sim.contacts import Contacts
from robosandbox.sim.objects import can_rewrite, place, rewrite
from robosandbox.sim.objects.weight import weighed
from robosandbox.sim.rendering import OffscreenRenderer
from robosandbox.sim.sensors import FRAME_SIZE, SENSORS, Sensor, find_sensor, perfect_intrinsics
from robosandbox.sim.state_check import check_state
from robosandbox.sim.states import object_truth
from robosandbox.sim.step_recorder import StepRecorder
from robosandbox.sim.world import World, build_world, check_start
from robosandbox.types import Array, Observation, Pose, RgbdFrame, Scene, Trajectory, Truth, frozen_array

_SETTLE_SECONDS = 3.0
_SETTLE_CHUNK_SECONDS = 0.02
_CALM_CHUNKS = 5
_REST_SPEED = 0.005
_TRIM_SHARE = 0.08
_LARGEST_TRIM = 0.3
# MuJoCo's cameras look along -z with y up.
_OPTICAL = np.diag([1.0, -1.0, -1.0])
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class MuJoCoBackend:
    """A robot and its objects in MuJoCo.

    Args:
        render_size: (height, width) of camera pictures, pixels.
        control_timestep: Seconds between commands to the servos; a whole multiple of the physics time step.
        sensor: What `capture` sees through.
        board: Laid on the table of what is loaded, to calibrate cameras with.

    Attributes:
        guards: Asked after every control tick.
        wait_hooks: Called again and again while a scene is loaded and settles. One that raises ends that.
        jump_hooks: Called after the state was set in another way than by letting time pass.
        physics_steps: Physics steps since the last reset.
        episode: Counts how often the world was put into another state than time alone brings.
        compilations: How often a model was compiled.
    """

    def __init__(
        self,
        render_size: tuple[int, int] = (240, 320),
        control_timestep: float = 0.01,
        *,
        sensor: Sensor = SENSORS["ideal"],
        board: CalibrationBoard | None = None,
    ) -> None:
        self.render_size = render_size
        self.control_timestep = control_timestep
        self.sensor = sensor
        self._board = board
        self._loop = ControlLoop()
        self.guards: list[Guard] = self._loop.guards
        self.wait_hooks: list[Callable[[], None]] = []
        self.jump_hooks: list[Callable[[], None]] = []
        self.physics_steps: int = 0
        self.compilations: int = 0
        self.episode: int = 0
        self._as_written = Scene()
        self._world: World | None = None
        self._data: mujoco.MjData | None = None
        # An OpenGL context belongs to the thread that draws with it.
        self._renderers: dict[tuple[int, tuple[int, int]], OffscreenRenderer] = {}
        self._past: deque[tuple[float, Array]] = deque()
        self._servo_lag: Array = np.zeros(0)
        self._trim: Array = np.zeros(0)
        self._substeps = 1
        self._mesh_sizes: dict[str, tuple[float, ...]] = {}
        self._felt: dict[str, float] = {}

    # Life cycle.

    def load(self, scene: Scene) -> None:
        """Build the scene, put the robot at home, and let the objects settle.

        Raises:
            InputError: A file, name or number of the robot or scene is wrong.
        """
        scene = weighed(scene)
        self.close()
        self._as_written = scene
        self._compile(scene)
        self.reset()

    def reset(self, scene: Scene | None = None, q: Array | None = None) -> None:
        """Start over, without a new model where numbers alone differ.

        Args:
            scene: A scene with the loaded one's robot, ids and kinds, other poses, sizes, masses or colours.
            q: Start configuration of the arm, shape (n,); home when left out.

        Raises:
            InputError: Objects start inside something.
        """
        world = self._loaded
        scene = weighed(scene) if scene is not None else None
        if scene is not None and scene != world.scene:
            self._adopt(scene)
            world = self._loaded
        data, robot = self._live, world.robot
        mujoco.mj_resetData(world.model, data)
        start = robot.home_q if q is None else np.asarray(q, dtype=float)
        self._trim = np.zeros(robot.n)
        data.qpos[robot.qpos_indices] = start
        data.ctrl[robot.actuator_ids] = robot.control(start)
        if robot.gripper:
            geometry = robot.gripper.geometry
            data.qpos[robot.gripper.joint_indices] = robot.gripper.joints_at(geometry.open_joint)
            data.ctrl[robot.gripper.actuator_ids] = geometry.control(0.0)
        for item in world.scene.objects:
            place(world.scene, item, data)
        check_start(world, data)
        self._settle()
        self._felt = dict.fromkeys(self._felt, 0.0)
        data.time = 0.0
        self.episode += 1
        self._past.clear()
        self.physics_steps = 0
        self._jumped()

    def close(self) -> None:
        """Free what was loaded; the backend can load again."""
        for renderer in self._renderers.values():
            renderer.close()
        self._renderers = {}
        self._world = None
        self._data = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # What it is.

    @property
    def capabilities(self) -> Capabilities:
        """All of them: a simulation knows everything."""
        return Capabilities(
            gripper_force=True,
            joint_torque=True,
            wrist_wrench=True,
            contact="named",
            cameras=self.cameras if self._world else (),
            fork=True,
            reset=True,
            truth=True,
            clock="simulated",
        )

    @property
    def world(self) -> World:
        """The compiled scene."""
        return self._loaded

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model."""
        return self._loaded.model

    @property
    def robot(self) -> Robot:
        """The robot's indices and measured figures."""
        return self._loaded.robot

    @property
    def scene(self) -> Scene:
        """The scene as loaded or last reset to."""
        return self._loaded.scene

    @property
    def sidecar(self) -> Sidecar:
        """The robot's roles, as written or inferred."""
        return self._loaded.sidecar

    @property
    def object_bodies(self) -> Mapping[str, int]:
        """Body ids of the objects."""
        return self._loaded.object_bodies

    @property
    def body_names(self) -> Sequence[str]:
        """What people call each body."""
        return self._loaded.names

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

    @property
    def servo_lag(self) -> Array:
        """By how many seconds each arm servo trails a moving target, shape (n,)."""
        return self._servo_lag

    @property
    def time(self) -> float:
        """Simulated seconds since reset."""
        return float(self._live.time)

    @property
    def controls(self) -> Array:
        """What is commanded to the actuators now, shape (actuators,)."""
        return frozen_array(self._live.ctrl)

    # Acting.

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Have `listener` called after every control tick, before the guards; return what ends that."""
        return self._loop.subscribe(listener)

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory, commands interpolated to the control ticks; return when the last row is commanded."""
        robot, data = self.robot, self._live
        ticks = max(1, int(np.ceil(trajectory.duration / self.control_timestep - 1e-9)))
        times = np.minimum(np.arange(1, ticks + 1) * self.control_timestep, trajectory.duration)
        rows = np.arange(len(trajectory.q)) * trajectory.dt
        q = np.column_stack([np.interp(times, rows, column) for column in trajectory.q.T])
        # A damped servo lags a moving target by lag * velocity; commanding ahead by that keeps the arm on its path.
        velocity = np.diff(q, axis=0, append=q[-1:]) / self.control_timestep
        commands = robot.control(q + self._servo_lag * velocity + self._trim)
        commands[-1] = robot.control(trajectory.q[-1] + self._trim)
        try:
            for command in commands:
                data.ctrl[robot.actuator_ids] = command
                self._tick(guards)
        except BaseException:
            self.stop()
            raise

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,).

        That is integral action: a servo of finite stiffness sags under a load and stops short of a joint's friction.
        What it takes is kept for the motions that follow.
        """
        robot, data = self.robot, self._live
        off = goal - data.qpos[robot.qpos_indices]
        self._trim = np.clip(self._trim + _TRIM_SHARE * off, -_LARGEST_TRIM, _LARGEST_TRIM)
        data.ctrl[robot.actuator_ids] = robot.control(goal + self._trim)
        self._tick(guards)

    def wait(self, seconds: float | None = None, guards: Sequence[Guard] = ()) -> None:
        """Let time pass with the last commands held; one control tick when `seconds` is left out."""
        ticks = 1 if seconds is None else max(1, round(seconds / self.control_timestep))
        for _ in range(ticks):
            self._tick(guards)

    def stop(self) -> None:
        """Command the arm to stay where it is."""
        robot = self.robot
        q = self._live.qpos[robot.qpos_indices]
        self._live.ctrl[robot.actuator_ids] = robot.control(np.clip(q, robot.lower, robot.upper))

    def set_gripper(self, closed: float) -> None:
        """Command the gripper: 0 is the sidecar's open, 1 its closed. Returns at once.

        Raises:
            ValueError: `closed` is outside 0..1, or the robot has no gripper.
        """
        if not 0.0 <= closed <= 1.0:
            raise ValueError(f"closed is {closed}; it takes 0 (open) to 1 (closed)")
        gripper = self.robot.gripper
        if gripper is None:
            raise ValueError(f"{self.robot.name} has no gripper")
        self._live.ctrl[gripper.actuator_ids] = gripper.geometry.control(closed)

    def replay(self, controls: Array, push: Array | None = None) -> None:
        """Let one control tick pass with recorded commands.

        Args:
            controls: To the actuators, shape (actuators,).
            push: Forces and torques on the bodies from outside, N and N m, shape (bodies, 6); none when left out.
        """
        data = self._live
        data.ctrl[:] = controls
        data.xfrc_applied[:] = 0.0 if push is None else push
        self._tick()

    # Looking.

    def log(self, capacity: int) -> StepRecorder:
        """Return a log that can take down this world's state; it ends with the model."""
        return StepRecorder(self._loaded, self._live, capacity)

    def state(self, cameras: Sequence[str] = ()) -> Observation:
        """Return proprioception, and a picture per named camera.

        Raises:
            InputError: No such camera.
            RenderingError: No OpenGL on this machine.
        """
        world, data = self._loaded, self._live
        robot = world.robot
        mujoco.mj_kinematics(world.model, data)
        images = {name: self._render(name) for name in cameras}
        return Observation(
            time=float(data.time),
            q=frozen_array(data.qpos[robot.qpos_indices]),
            qd=frozen_array(data.qvel[robot.dof_indices]),
            tcp_pose=Pose.from_matrix(*robot.tcp(data)),
            gripper=robot.gripper.state(data) if robot.gripper else None,
            images=images,
        )

    def capture(self, camera: str) -> RgbdFrame:
        """Return what the sensor delivers of a camera now: colour, depth, and how robot and camera stood.

        Raises:
            InputError: No such camera.
            RenderingError: No OpenGL on this machine.
        """
        name = self.camera_in_model(camera)
        model, robot, data = self.model, self.robot, self._exposed()
        rgb, depth = self._renderer(FRAME_SIZE).rgbd(data, name)
        number = model.camera(name).id
        pose = Pose.from_matrix(data.cam_xpos[number], data.cam_xmat[number].reshape(3, 3) @ _OPTICAL)
        fingers = data.qpos[robot.gripper.joint_indices] if robot.gripper else np.zeros(0)
        frame = RgbdFrame(
            camera=camera,
            time=float(data.time),
            rgb=rgb,
            depth=depth,
            intrinsics=perfect_intrinsics(FRAME_SIZE, float(np.radians(model.cam_fovy[number]))),
            pose_camera_in_world=pose,
            q=frozen_array(data.qpos[robot.qpos_indices]),
            gripper_q=frozen_array(fingers),
        )
        return self.sensor.sense(frame)

    def truth(self) -> Truth:
        """Return the simulated state; for judging and ground-truth perception."""
        world, data = self._loaded, self._live
        mujoco.mj_kinematics(world.model, data)
        touching, held = Contacts(world, data).by_object()
        objects = {
            item.id: object_truth(
                world,
                data,
                item,
                size=self._mesh_sizes.get(item.id, item.size),
                contacts=tuple(sorted(touching.get(item.id, ()))),
                felt=self._felt.get(item.id, 0.0),
            )
            for item in world.scene.objects
        }
        return Truth(
            time=float(data.time),
            q=frozen_array(data.qpos[world.robot.qpos_indices]),
            home_q=world.robot.home_q,
            table_height=world.scene.table_height,
            objects=objects,
            held=held,
        )

    def held(self) -> str | None:
        """Return the object that both sides of the gripper touch."""
        return Contacts(self._loaded, self._live).by_object()[1]

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Return what an arm joint's servo gives now and the most that it can, N m or N; infinite without a limit."""
        actuator = int(self.robot.actuator_ids[joint])
        limited = bool(self.model.actuator_forcelimited[actuator])
        limit = float(np.abs(self.model.actuator_forcerange[actuator]).max()) if limited else np.inf
        return abs(float(self._live.actuator_force[actuator])), limit

    def contact_forces(self) -> list[tuple[float, int, int]]:
        """Return normal force, N, and body ids of every contact of the robot, those with itself included."""
        return Contacts(self._loaded, self._live).of_robot()

    def strongest_contact(self) -> tuple[float, str, str]:
        """Return the largest normal force between the robot and anything else, N, and the two bodies; 0 without one."""
        return Contacts(self._loaded, self._live).strongest()

    def force_on(self, object_id: str | None) -> Array:
        """Return the sum of what the robot presses and pulls an object with, N in the world, shape (3,); None is all of them."""
        return Contacts(self._loaded, self._live).force_on(object_id)

    def grip_on(self, object_id: str | None) -> float:
        """Return with how much force each side of the gripper presses on an object, N; None is whatever is there."""
        return Contacts(self._loaded, self._live).grip_on(object_id)

    def arm_contacts(self) -> tuple[tuple[str, str], ...]:
        """Return the pairs (robot body, other body) that touch now, without the robot's own."""
        return Contacts(self._loaded, self._live).of_arm()

    def feel(self, names: Iterable[str]) -> None:
        """Keep for `truth` the most that the robot presses or pulls these objects with, from now on."""
        self._felt = dict.fromkeys(names, 0.0)

    def contacts_around(self, carried: Iterable[str] = ()) -> list[tuple[str, str, float]]:
        """Return (link or carried object, what it touches, N) of the robot and of these objects, its grip on them left out."""
        return Contacts(self._loaded, self._live).around(carried)

    # Saving, restoring, forking.

    def snapshot(self) -> Array:
        """Return the whole simulated state as one vector."""
        state = np.empty(mujoco.mj_stateSize(self.model, _STATE))
        mujoco.mj_getState(self.model, self._live, state, _STATE)
        return state

    def restore(self, state: Array) -> None:
        """Go back to a snapshot of this model."""
        mujoco.mj_setState(self.model, self._live, state, _STATE)
        mujoco.mj_forward(self.model, self._live)
        self.episode += 1
        self._past.clear()
        self._jumped()

    def resume(self, scene: Scene, state: Array, physics_steps: int) -> None:
        """Go back to a snapshot that was taken in this scene.

        Args:
            scene: With the loaded one's robot.
            state: What `snapshot` returned there.
            physics_steps: As counted there.

        Raises:
            InputError: The snapshot is of another model, or of no world.
        """
        if scene != self.scene:
            self._adopt(scene)
        check_state(self.model, state, robot=self.robot.name)
        self.restore(state)
        self.physics_steps = physics_steps

    def fork(self) -> MuJoCoBackend:
        """Return a copy of the world that shares the model and nothing else: for trying things out."""
        other = MuJoCoBackend(self.render_size, self.control_timestep, sensor=self.sensor)
        other._take(self._loaded)
        other._trim = self._trim.copy()
        other.restore(self.snapshot())
        return other

    @classmethod
    def over(cls, world: World, state: Array) -> MuJoCoBackend:
        """Return a backend over a world that is compiled already, in a state as `snapshot` returns it."""
        sim = cls()
        sim._take(world)
        sim.restore(state)
        return sim

    # Inside.

    @property
    def _loaded(self) -> World:
        if self._world is None:
            raise RuntimeError("no scene is loaded; call load(scene) first")
        return self._world

    @property
    def _live(self) -> mujoco.MjData:
        if self._data is None:
            raise RuntimeError("no scene is loaded; call load(scene) first")
        return self._data

    def ask_wait_hooks(self) -> None:
        """Ask the wait hooks whether to go on; they raise where not."""
        for hook in self.wait_hooks:
            hook()

    def _compile(self, scene: Scene) -> None:
        self.ask_wait_hooks()
        config = Path(scene.robot_config) if scene.robot_config else None
        robot = load_robot(scene.robot_urdf, config, table_height=scene.table_height)
        self._take(build_world(scene, robot, board=self._board))
        self.compilations += 1

    def _take(self, world: World) -> None:
        """Simulate a compiled world, everything where the model has it."""
        self._world = world
        self._data = mujoco.MjData(world.model)
        self._trim = np.zeros(world.robot.n)
        self._mesh_sizes = {}
        for item in world.scene.objects:
            if item.mesh is not None:
                low, high = mesh_bounds(item.mesh, item.scale, of=item.id)
                self._mesh_sizes[item.id] = tuple(float(c) for c in (high - low) / 2.0)
        substeps = self.control_timestep / world.model.opt.timestep
        if abs(substeps - round(substeps)) > 1e-6 or round(substeps) < 1:
            raise InputError(
                f"control_timestep {self.control_timestep} is no whole multiple of the physics time step "
                f"{world.model.opt.timestep}"
            )
        self._substeps = round(substeps)
        self._servo_lag = _servo_lag(world.model, world.robot)

    def _as_loaded(self, scene: Scene) -> Scene:
        """Return a scene with its objects as the loaded scene has them; the scene itself where that has others."""
        loaded = {item.id: item for item in self._as_written.objects}
        if any(item.id not in loaded for item in scene.objects):
            return scene
        written = scene.model_copy(update={"objects": tuple(loaded[item.id] for item in scene.objects)})
        return written if _rewritable(written, scene) else scene

    def _adopt(self, scene: Scene) -> None:
        """Take another scene: numbers are written into the model, anything else compiles a new one.

        What is compiled are the same objects as the scene that was loaded has them, whatever lay there last: a model, to
        its last digit, must not depend on the scenes before it.
        """
        if not _rewritable(self._loaded.scene, scene):
            as_loaded = self._as_loaded(scene)
            self.close()
            self._compile(as_loaded)
        world = self._loaded
        stale = [
            rewrite(world.model, a, b, parts, world.mass_share[parts], world.inertia_per_mass[parts])
            for a, b in zip(world.scene.objects, scene.objects, strict=True)
            for parts in (world.parts[b.id],)
        ]
        if any(stale):
            mujoco.mj_setConst(world.model, mujoco.MjData(world.model))
        self._world = replace(world, scene=scene, revision=world.revision + any(stale))

    def _settle(self) -> None:
        """Step until no object has moved for a while; a ball that rolls on is left rolling after a few seconds."""
        model, data = self.model, self._live
        dofs = [int(model.body_dofadr[b]) + i for b in self._loaded.owners for i in range(int(model.body_dofnum[b]))]
        chunk = round(_SETTLE_CHUNK_SECONDS / model.opt.timestep)
        calm = 0
        for _ in range(round(_SETTLE_SECONDS / _SETTLE_CHUNK_SECONDS)):
            self.ask_wait_hooks()
            mujoco.mj_step(model, data, chunk)
            calm = calm + 1 if not dofs or np.abs(data.qvel[dofs]).max() < _REST_SPEED else 0
            if calm >= _CALM_CHUNKS:
                return

    def _tick(self, guards: Sequence[Guard] = ()) -> None:
        if self.sensor.latency > 0.0:
            self._remember()
        mujoco.mj_step(self._loaded.model, self._live, self._substeps)
        self.physics_steps += self._substeps
        for name, most in self._felt.items():
            self._felt[name] = max(most, float(np.linalg.norm(self.force_on(name))))
        self._loop.ticked(self.stop, guards)

    def _jumped(self) -> None:
        for hook in self.jump_hooks:
            hook()

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
            data = mujoco.MjData(self.model)
            time, qpos = next((past for past in reversed(self._past) if past[0] <= moment), self._past[0])
            data.qpos, data.time = qpos, time
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_camlight(self.model, data)
        return data


def open_mujoco(
    scene: Scene,
    *,
    control_timestep: float = 0.01,
    sensor: str = "ideal",
    render_size: tuple[int, int] = (240, 320),
    felt: Iterable[str] = (),
    wait_hook: Callable[[], None] | None = None,
) -> MuJoCoBackend:
    """Return a scene as a world in MuJoCo: the entry point `mujoco` of `robosandbox.drivers`.

    Args:
        scene: Robot, table and objects.
        control_timestep: Seconds between commands to the servos.
        sensor: What its cameras are like: ideal, realsense or rough.
        render_size: (height, width) of camera pictures, pixels.
        felt: Objects of which the truth is to tell how hard they were pressed.
        wait_hook: Called again and again while the world settles; what it raises ends that.

    Raises:
        InputError: A file, name or number of the robot or scene is wrong.
    """
    sim = MuJoCoBackend(render_size, control_timestep, sensor=find_sensor(sensor))
    if wait_hook is not None:
        sim.wait_hooks.append(wait_hook)
    sim.feel(felt)
    try:
        sim.load(scene)
    except BaseException:
        sim.close()
        raise
    return sim


def _rewritable(old: Scene, new: Scene) -> bool:
    """Return whether a model of one scene becomes one of the other by numbers alone."""
    if (old.robot_urdf, old.robot_config, old.table_height) != (new.robot_urdf, new.robot_config, new.table_height):
        return False
    return len(old.objects) == len(new.objects) and all(map(can_rewrite, old.objects, new.objects))


def _servo_lag(model: mujoco.MjModel, robot: Robot) -> Array:
    """Return by how many seconds each arm servo trails a moving target: total damping over stiffness, shape (n,)."""
    gear = model.actuator_gear[robot.actuator_ids, 0]
    stiffness = -model.actuator_biasprm[robot.actuator_ids, 1] * gear**2
    servo = -model.actuator_biasprm[robot.actuator_ids, 2] * gear**2
    lag: Array = (servo + model.dof_damping[robot.dof_indices].reshape(-1)) / stiffness
    return lag
