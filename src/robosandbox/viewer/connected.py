"""The world of a sim process, followed over Zenoh and drawn from a model that is built here from the sim's task."""

from __future__ import annotations

import logging
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import zenoh

from robosandbox.errors import ForbiddenError, InputError, RoboSandboxError, SkillError
from robosandbox.robots.loader import load_robot
from robosandbox.sim.world import build_world
from robosandbox.tasks.remote import RemoteSession
from robosandbox.tasks.session import resolve_task
from robosandbox.tasks.task import Task
from robosandbox.types import Array, GripperState, Observation, Pose, Scene, frozen_array
from robosandbox.viewer.cell import Blueprint, Frame, Job, OnFrame, OnPicture, OnRefused, OnScene
from robosandbox.viewer.feed import FRAME_HZ
from robosandbox.wire import State, decode

_log = logging.getLogger(__name__)
_IDLE_SECONDS = 1.0
_MOVING = 1e-3
_STILL = 1e-5


class ConnectedCell:
    """Watches and steers a session whose world is another process's.

    Args:
        session: The connection.

    Raises:
        InputError: The sim's robot is in files that this machine does not have.
    """

    hands_on = None

    def __init__(self, session: RemoteSession) -> None:
        self._session = session
        self._robot = session.robot
        self._on_frame: OnFrame = lambda frame: None
        self._jobs = ThreadPoolExecutor(max_workers=1, thread_name_prefix="jobs")
        self._pictures = ThreadPoolExecutor(max_workers=1, thread_name_prefix="pictures")
        self._changed = threading.Condition()
        self._stopping = False
        self._wanted = True
        self._state: State | None = None
        self._sent: Array | None = None
        self._blueprint = self._build()
        self._follower = threading.Thread(target=self._follow, name="follower", daemon=True)
        self._news: zenoh.Subscriber[None] | None = None

    @property
    def workcell(self) -> RemoteSession:
        """The loaded task with its agent."""
        return self._session

    @property
    def blueprint(self) -> Blueprint:
        """What is to be drawn."""
        return self._blueprint

    @property
    def title(self) -> str:
        """Where the world is."""
        return f"the sim process of {self._robot.id!r}"

    def start(self, on_frame: OnFrame) -> None:
        """Begin."""
        self._on_frame = on_frame
        self._news = self._robot.watch("obs/state", self._hear)
        self._follower.start()

    def order(self, job: Job) -> None:
        """Run a job, then have a frame come."""

        def run() -> None:
            try:
                job()
            finally:
                self.refresh()

        self._jobs.submit(run)

    def refresh(self) -> None:
        """Have a frame come."""
        with self._changed:
            self._wanted = True
            self._changed.notify_all()

    def picture(self, camera: str, deliver: OnPicture, refuse: OnRefused) -> None:
        """Have the sim draw a picture."""

        def ask() -> None:
            try:
                deliver(*self._robot.picture(camera, format="jpeg"))
            except RoboSandboxError as error:
                refuse(error)

        self._pictures.submit(ask)

    def look(self, deliver: OnScene, refuse: OnRefused) -> None:
        """Have the sim's perception look."""

        def ask() -> None:
            try:
                deliver(self._robot.observe())
            except RoboSandboxError as error:
                refuse(error)

        self._pictures.submit(ask)

    def load(self, task: Task | str, robot: str | None) -> None:
        """Have the sim load another task; for jobs."""
        chosen = resolve_task(task)
        if robot is not None:
            scene = chosen.scene.model_copy(update={"robot_urdf": Path(robot), "robot_config": None})
            chosen = chosen.model_copy(update={"scene": scene})
        self._session.load(chosen)
        self.relook()

    def relook(self) -> None:
        """Build the model anew where the sim's objects have changed; for jobs."""
        scene = self._scene()
        if scene != self._blueprint.scene:
            self._blueprint = self._build()

    def settle(self) -> None:
        """Nothing: the sim itself brings the arm to rest."""

    def close(self) -> None:
        """Stop what runs here; the sim goes on."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        self._session.ctx.cancel()
        self._jobs.shutdown(wait=True, cancel_futures=True)
        self._pictures.shutdown(wait=True, cancel_futures=True)
        if self._news is not None:
            self._news.undeclare()
            self._follower.join()

    # The model.

    def _scene(self) -> Scene:
        """Return the task's scene with sizes and colours as the sim has drawn them for its seed."""
        scene = self._session.task.scene
        try:
            there = {item.id: item for item in self._robot.truth().objects}
        except ForbiddenError:
            return scene
        objects = tuple(
            item.model_copy(
                update={"rgba": there[item.id].rgba, "size": item.size if item.mesh else there[item.id].size}
            )
            if item.id in there
            else item
            for item in scene.objects
        )
        return scene.model_copy(update={"objects": objects})

    def _build(self) -> Blueprint:
        scene = self._scene()
        try:
            world = build_world(scene, load_robot(scene.robot_urdf, scene.robot_config))
        except InputError as error:
            raise InputError(f"the sim's robot cannot be drawn here: {error}") from None
        return Blueprint(
            model=world.model,
            robot=world.robot,
            names=world.names,
            object_bodies=world.object_bodies,
            scene=world.scene,
        )

    # Frames.

    def _hear(self, sample: zenoh.Sample) -> None:
        state = decode(sample.payload.to_bytes(), State)
        with self._changed:
            before, self._state = self._state, state
            moved = before is None or state.goal_id is not None or state.time < before.time
            if moved or max(map(abs, state.qd), default=0.0) > _MOVING:
                self._wanted = True
                self._changed.notify_all()

    def _follow(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._stopping or self._wanted, _IDLE_SECONDS)
                if self._stopping:
                    return
                self._wanted = False
            due = time.monotonic() + 1.0 / FRAME_HZ
            try:
                self._send()
            except RoboSandboxError as error:
                _log.info("no frame: %s", error)
            with self._changed:
                self._changed.wait_for(lambda: self._stopping, max(0.0, due - time.monotonic()))

    def _send(self) -> None:
        blueprint, state = self._blueprint, self._state or self._robot.state()
        q, objects, held = self._where(state)
        qpos = blueprint.model.qpos0.copy()
        qpos[blueprint.robot.qpos_indices] = q
        gripper = blueprint.robot.gripper
        if gripper is not None and state.gripper is not None:
            qpos[gripper.joint_indices] = gripper.joints_at(state.gripper.joint)
        for name, body in blueprint.object_bodies.items():
            if name in objects:
                address = int(blueprint.model.jnt_qposadr[blueprint.model.body_jntadr[body]])
                x, y, z, w = objects[name].quat_xyzw
                qpos[address : address + 7] = [*objects[name].xyz, w, x, y, z]
        if self._sent is not None and len(self._sent) == len(qpos) and abs(self._sent - qpos).max() < _STILL:
            return
        self._sent = qpos
        reading = state.gripper
        seen = Observation(
            time=state.time,
            q=frozen_array(q),
            qd=frozen_array(state.qd),
            tcp_pose=state.tcp_pose,
            gripper=None
            if reading is None
            else GripperState(joint=reading.joint, width=reading.width, closed=reading.closed, force=reading.force),
        )
        self._on_frame(Frame(model=blueprint.model, seen=seen, held=held, qpos=frozen_array(qpos)))

    def _where(self, state: State) -> tuple[tuple[float, ...], dict[str, Pose], str | None]:
        """Return joints and objects of one moment where the sim tells the truth, else the joints and what is perceived."""
        try:
            truth = self._robot.truth()
        except ForbiddenError:
            scene = self._robot.observe()
            return state.q, {item.id: item.pose for item in scene.objects}, scene.held
        except SkillError as error:
            raise InputError(error.message) from None
        return truth.q, {item.id: item.pose for item in truth.objects}, truth.held
