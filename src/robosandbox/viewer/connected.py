"""The world of a sim process, followed over Zenoh and drawn from a model that is built here from the sim's task."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import mujoco
import zenoh

from robosandbox.errors import ForbiddenError, InputError, RoboSandboxError, SkillError
from robosandbox.robots.loader import load_robot
from robosandbox.service.client.workcell import RemoteWorkcell
from robosandbox.service.messages import State, decode
from robosandbox.sim.world import build_world
from robosandbox.tasks.session import resolve_task
from robosandbox.tasks.task import Task
from robosandbox.types import Array, DetectedObject, ObjectTruth, Observation, Scene, frozen_array
from robosandbox.viewer.source import Blueprint, Frame, Job, OnElsewhere, OnFrame, OnPicture, OnRefused, OnScene
from robosandbox.viewer.stream import FRAME_HZ

_log = logging.getLogger(__name__)
_IDLE_SECONDS = 1.0
_MOVING = 1e-3  # Speed of a joint, rad/s, from which the robot moves. Chosen.
_STILL = 1e-5  # Change of a joint, radians or metres, below which nothing is sent. Chosen.
# Between questions to a sim in which something else was loaded, while that cannot be taken over.
_AGAIN_SECONDS = 0.5


class ConnectedSource:
    """Watches and steers a session whose world is another process's.

    Args:
        session: The connection.

    Raises:
        InputError: The sim's robot is in files that this machine does not have.
    """

    teleop = None

    def __init__(self, session: RemoteWorkcell) -> None:
        self._session = session
        self._robot = session.robot
        self._on_frame: OnFrame = lambda frame: None
        self._on_elsewhere: OnElsewhere = lambda loaded: None
        self._jobs = ThreadPoolExecutor(max_workers=1, thread_name_prefix="jobs")
        self._pictures = ThreadPoolExecutor(max_workers=1, thread_name_prefix="pictures")
        self._changed = threading.Condition()
        self._stopping = False
        self._wanted = True
        self._state: State | None = None
        self._sent: Array | None = None
        # Set when the sim tells of a reset or another world, until it is known what became of it.
        self._doubted = False
        self._ask_again = 0.0
        self._building = threading.Lock()
        self._working = threading.Event()
        # Cleared while the sim has something else than what is built here.
        self._drawable = True
        # The model and the bodies of each object in it: one value, since jobs and the follower are threads of their own.
        self._drawn = self._build()
        self._follower = threading.Thread(target=self._follow, name="follower", daemon=True)
        self._news: zenoh.Subscriber[None] | None = None

    @property
    def workcell(self) -> RemoteWorkcell:
        """The loaded task with its agent."""
        return self._session

    @property
    def blueprint(self) -> Blueprint:
        """What is to be drawn."""
        return self._drawn[0]

    @property
    def title(self) -> str:
        """Where the world is."""
        return f"the sim process of {self._robot.id!r}"

    def start(self, on_frame: OnFrame, on_elsewhere: OnElsewhere) -> None:
        """Begin."""
        self._on_frame, self._on_elsewhere = on_frame, on_elsewhere
        self._news = self._robot.watch("obs/state", self._hear)
        self._follower.start()

    def order(self, job: Job) -> None:
        """Run a job, then have a frame come."""

        def run() -> None:
            self._working.set()
            try:
                job()
            finally:
                self._working.clear()
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
        self._drawable = False
        try:
            self._session.load(chosen)
        except RoboSandboxError:
            self._drawable = True
            raise
        self.relook()

    def adopt(self) -> None:
        """Take over what somebody else has loaded; for jobs."""
        self._drawable = False
        self._session.adopt()
        self.relook()

    def relook(self) -> None:
        """Build the model anew where the sim's objects have changed; from any thread."""
        with self._building:
            scene = self._scene()
            if scene != self.blueprint.scene:
                self._drawable = False
                self._drawn = self._build()
                self._sent = None
            self._drawable = True

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
            there = self._robot.truth().objects
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

    def _build(self) -> tuple[Blueprint, Mapping[str, Sequence[int]]]:
        scene = self._scene()
        try:
            world = build_world(scene, load_robot(scene.robot_urdf, scene.robot_config))
        except InputError as error:
            raise InputError(f"the sim's robot cannot be drawn here: {error}") from None
        blueprint = Blueprint(
            model=world.model,
            robot=world.robot,
            names=world.names,
            object_bodies=world.object_bodies,
            scene=world.scene,
        )
        return blueprint, {name: tuple(bodies.tolist()) for name, bodies in world.parts.items()}

    # Frames.

    def _hear(self, sample: zenoh.Sample) -> None:
        state = decode(sample.payload.to_bytes(), State)
        with self._changed:
            before, self._state = self._state, state
            if before is not None and (
                (state.boot_id, state.loads) != (before.boot_id, before.loads) or state.robot.time < before.robot.time
            ):
                self._doubted = True
            moved = self._doubted or before is None or state.goal_id is not None or state.robot.time < before.robot.time
            if moved or max(map(abs, state.robot.qd), default=0.0) > _MOVING:
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
                if not self._doubted or self._settled():
                    self._send()
            except RoboSandboxError as error:
                _log.info("no frame: %s", error)
            with self._changed:
                self._changed.wait_for(lambda: self._stopping, max(0.0, due - time.monotonic()))

    def _settled(self) -> bool:
        """Find out what somebody else did to the world; return whether what is drawn here still stands for it.

        What was done by a job of one's own is found out by that job.
        """
        if self._working.is_set():
            return True
        if time.monotonic() < self._ask_again:
            return False
        self._ask_again = time.monotonic() + _AGAIN_SECONDS
        if not self._session.catch_up():
            self._on_elsewhere(True)
            return False
        self._doubted, self._ask_again = False, 0.0
        before = self._drawn
        self.relook()
        if self._drawn is not before:
            self._on_elsewhere(False)
        return True

    def _send(self) -> None:
        (blueprint, parts), state = self._drawn, self._state or self._robot.state()
        seen, objects, held = self._where(state)
        qpos = blueprint.model.qpos0.copy()
        if not self._drawable or len(seen.q) != len(blueprint.robot.qpos_indices):
            return
        qpos[blueprint.robot.qpos_indices] = seen.q
        gripper = blueprint.robot.gripper
        if gripper is not None and seen.gripper is not None:
            qpos[gripper.joint_indices] = gripper.joints_at(seen.gripper.joint)
        for item in objects:
            _put(item, qpos, blueprint.model, parts.get(item.id, ()))
        if self._sent is not None and len(self._sent) == len(qpos) and abs(self._sent - qpos).max() < _STILL:
            return
        self._sent = qpos
        self._on_frame(Frame(model=blueprint.model, seen=seen, held=held, qpos=frozen_array(qpos)))

    def _where(self, state: State) -> tuple[Observation, Iterable[ObjectTruth | DetectedObject], str | None]:
        """Return robot and objects of one moment where the sim tells the truth, else the robot and what is perceived."""
        try:
            truth = self._robot.truth()
        except ForbiddenError:
            scene = self._robot.observe()
            return state.robot, scene.objects, scene.held
        except SkillError as error:
            raise InputError(error.message) from None
        return replace(state.robot, q=truth.q), truth.objects.values(), truth.held


def _put(item: ObjectTruth | DetectedObject, qpos: Array, model: mujoco.MjModel, bodies: Sequence[int]) -> None:
    """Write where an object is into a model's positions."""
    addresses = [int(model.jnt_qposadr[model.body_jntadr[body]]) for body in bodies]
    if item.grains:
        for address, xyz in zip(addresses, item.grains, strict=False):
            qpos[address : address + 3] = xyz
        return
    if addresses:
        x, y, z, w = item.pose.quat_xyzw
        qpos[addresses[0] : addresses[0] + 7] = [*item.pose.xyz, w, x, y, z]
    if item.opening is not None and len(addresses) > 1:
        qpos[addresses[1]] = item.opening
