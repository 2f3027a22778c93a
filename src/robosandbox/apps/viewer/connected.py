"""The world of a sim process, followed over Zenoh and drawn from a model that is built here."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace

import zenoh

from robosandbox.apps.viewer.believed import BelievedWorld
from robosandbox.apps.viewer.source import Blueprint, Frame, OnElsewhere, OnFrame
from robosandbox.apps.viewer.stream import FRAME_HZ
from robosandbox.errors import InputError, RoboSandboxError
from robosandbox.motion.twin import standing
from robosandbox.sim.world import World, build_world_of
from robosandbox.types import Array, Observation, Scene, frozen_array
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.loop import Loop
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell
from robosandbox.workcell.zenoh.messages import State, decode

_log = logging.getLogger(__name__)
_IDLE_SECONDS = 1.0
_MOVING = 1e-3  # Speed of a joint, rad/s, from which the robot moves. Chosen.
_STILL = 1e-5  # Change of a joint, radians or metres, below which nothing is sent. Chosen.
# Between questions to a sim in which something else was loaded, while that cannot be taken over.
_AGAIN_SECONDS = 0.5


class ConnectedSource:
    """Makes frames of a cell whose world is another process's.

    Args:
        host: Has the connection.

    Raises:
        InputError: The sim's robot is in files that this machine does not have.
    """

    teleop = None

    def __init__(self, host: WorkcellHost) -> None:
        assert isinstance(host.cell, RemoteWorkcell), "the cell is of this process"
        self.host = host
        self._cell = host.cell
        self._robot = host.cell.robot
        self._on_frame: OnFrame = lambda frame: None
        self._on_elsewhere: OnElsewhere = lambda loaded: None
        self._state: State | None = None
        self._sent: Array | None = None
        # Set when the sim tells of a reset or another world, until it is known what became of it.
        self._doubted = False
        self._ask_again = 0.0
        self._building = threading.Lock()
        # Cleared while the sim has something else than what is built here.
        self._drawable = True
        self._drawn = _drawn(self._cell)
        self._loop = Loop("follower", self._follow, hz=FRAME_HZ)
        self._news: zenoh.Subscriber[None] | None = None

    @property
    def blueprint(self) -> Blueprint:
        """Blueprint of the world that is drawn."""
        world, arm = self._drawn.world, (self._state or self._robot.state()).arm
        # A state may be older than the world.
        return Blueprint.of(world, arm if arm in world.robots else next(iter(world.robots)))

    @property
    def title(self) -> str:
        """Title that says where the world is."""
        return f"the sim process of {self._robot.id!r}"

    def start(self, on_frame: OnFrame, on_elsewhere: OnElsewhere) -> None:
        """Begin."""
        self._on_frame, self._on_elsewhere = on_frame, on_elsewhere
        self._news = self._robot.watch("obs/state", self._hear)
        self._loop.start()

    def refresh(self) -> None:
        """Have a frame come."""
        self._loop.wake()

    @contextmanager
    def changing(self) -> Iterator[None]:
        """Draw nothing meanwhile, and build the model anew where the sim's objects have changed."""
        self._drawable = False
        try:
            yield
        except RoboSandboxError:
            self._drawable = True
            raise
        self._relook()

    def adopt(self) -> None:
        """Take over what somebody else has loaded; for jobs."""
        with self.changing():
            self._cell.adopt()
            self.host.adopt()

    def stop(self) -> None:
        """Send no more frames; the sim goes on."""
        if self._news is not None:
            self._news.undeclare()
        self._loop.stop()

    # Frames.

    def _relook(self) -> None:
        """Build the model anew where the sim's objects have changed; from any thread."""
        with self._building:
            if self._cell.judgeable is not self._drawn.told or self._drawn.scene != _scene(self._cell):
                self._drawable = False
                self._drawn = _drawn(self._cell)
                self._sent = None
            self._drawable = True

    def _hear(self, sample: zenoh.Sample) -> None:
        state = decode(sample.payload.to_bytes(), State)
        before, self._state = self._state, state
        if before is not None and (
            (state.boot_id, state.loads) != (before.boot_id, before.loads) or state.robot.time < before.robot.time
        ):
            self._doubted = True
        moved = self._doubted or before is None or state.goal_id is not None or state.robot.time < before.robot.time
        speeds = (abs(arm.qd).max(initial=0.0) for arm in state.robot.arms.values())
        if moved or max(speeds) > _MOVING:
            self._loop.wake()

    def _follow(self) -> float:
        try:
            if not self._doubted or self._settled():
                self._send()
        except RoboSandboxError as error:
            _log.info("no frame: %s", error)
        return _IDLE_SECONDS

    def _settled(self) -> bool:
        """Find out what somebody else did to the world; return whether what is drawn here still stands for it.

        What was done from here is found out where it was done.
        """
        if self.host.doing is not None:
            return True
        if time.monotonic() < self._ask_again:
            return False
        self._ask_again = time.monotonic() + _AGAIN_SECONDS
        if not self._cell.catch_up():
            self._on_elsewhere(True)
            return False
        self._doubted, self._ask_again = False, 0.0
        before = self._drawn
        self._relook()
        if self._drawn is not before:
            self._on_elsewhere(False)
        return True

    def _send(self) -> None:
        drawn, state = self._drawn, self._state or self._robot.state()
        if not self._drawable:
            return
        frame = drawn.frame(state)
        if (
            self._sent is not None
            and len(self._sent) == len(frame.qpos)
            and abs(self._sent - frame.qpos).max() < _STILL
        ):
            return
        self._sent = frame.qpos
        self._on_frame(frame)


class _Told:
    """Draws the sim's task as the sim says that it truly is."""

    told = True

    def __init__(self, session: RemoteWorkcell) -> None:
        self._robot = session.robot
        self.scene = _scene(session)
        self.world: World = build_world_of(self.scene)

    def frame(self, state: State) -> Frame:
        truth = self._robot.truth()
        # Robot and objects of one moment.
        arms = {name: replace(arm, q=truth.arms[name].q) for name, arm in state.robot.arms.items()}
        seen = _of_this_robot(replace(state.robot, arms=arms), self.world)
        qpos = frozen_array(standing(self.world, truth.objects.values(), arms))
        return Frame(model=self.world.model, seen=seen, hands=truth.hands, qpos=qpos)


class _Supposed:
    """Draws what the sim's perception sees, where nobody knows or tells the truth."""

    told = False

    def __init__(self, session: RemoteWorkcell) -> None:
        self._robot = session.robot
        self.scene = session.task.scene
        self._believed = BelievedWorld(self.scene, session.observe())

    @property
    def world(self) -> World:
        return self._believed.world

    def frame(self, state: State) -> Frame:
        return self._believed.frame(self._robot.observe(), _of_this_robot(state.robot, self.world))


def _drawn(session: RemoteWorkcell) -> _Told | _Supposed:
    """Return what draws a sim's world.

    Raises:
        InputError: The sim's robot is in files that this machine does not have.
    """
    try:
        return _Told(session) if session.judgeable else _Supposed(session)
    except InputError as error:
        raise InputError(f"the sim's robot cannot be drawn here: {error}") from None


def _of_this_robot(seen: Observation, world: World) -> Observation:
    """Return what was seen of the robots; raises InputError where the sim has loaded others meanwhile."""
    there = {name: len(arm.q) for name, arm in seen.arms.items()}
    drawn = {name: robot.n for name, robot in world.robots.items()}
    if there != drawn:
        raise InputError(f"the sim's arms have {_joints(there)} joints, and those drawn here {_joints(drawn)}")
    return seen


def _joints(counts: Mapping[str, int]) -> str:
    return " and ".join(map(str, counts.values()))


def _scene(session: RemoteWorkcell) -> Scene:
    """Return the task's scene, with sizes and colours as the sim has drawn them for its seed where it tells."""
    scene = session.task.scene
    if not session.judgeable:
        return scene
    there = session.robot.truth().objects
    objects = tuple(
        item.model_copy(update={"rgba": there[item.id].rgba, "size": item.size if item.mesh else there[item.id].size})
        if item.id in there
        else item
        for item in scene.objects
    )
    return scene.model_copy(update={"objects": objects})
