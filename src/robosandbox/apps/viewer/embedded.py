"""A world in this process: physics in one thread, at the speed of the clock while something is done, and none otherwise."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from robosandbox.agent.pace import Pace
from robosandbox.apps.viewer.believed import BelievedWorld
from robosandbox.apps.viewer.source import Blueprint, Frame, Job, OnElsewhere, OnFrame, OnPicture, OnRefused, OnScene
from robosandbox.apps.viewer.stream import FRAME_HZ
from robosandbox.apps.viewer.teleop import EmbeddedTeleop
from robosandbox.driver import come_to_rest, require
from robosandbox.errors import RoboSandboxError, SkillError
from robosandbox.sim.modelled import Modelled
from robosandbox.sim.world import World
from robosandbox.tasks.task import Task
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.studio import Studio, View
from robosandbox.workcell.zenoh.server.worker import Worker

_log = logging.getLogger(__name__)
# Seconds to wait for what runs to stop. Chosen: a motion stops within 0.15 s (docs/measured.md), a plan may take longer.
_STOP_SECONDS = 10.0
_REST_TRIALS = 5  # Number of looks after which things are taken to lie still. Chosen.

# Returns the session of a task, its name or its file, with a robot in place of its own.
Open = Callable[[Task | str, str | None], EmbeddedWorkcell]


class EmbeddedSource:
    """Watches and steers a session of this process.

    Args:
        session: The loaded task.
        reopen: Loads others.
    """

    def __init__(self, session: EmbeddedWorkcell, reopen: Open) -> None:
        self._session = session
        self._open = reopen
        self._worker = Worker(session.sim, "fast")
        self._studio = Studio(session.sim, self._worker.read, "viewer")
        self._on_frame: OnFrame = lambda frame: None
        self._due = 0.0
        self._adopt(session)

    @property
    def workcell(self) -> EmbeddedWorkcell:
        """The loaded task with its agent."""
        return self._session

    @property
    def blueprint(self) -> Blueprint:
        """Blueprint of the world that is drawn."""
        return Blueprint.of(self._drawn.world)

    @property
    def title(self) -> str:
        """Title that says where the world is."""
        return "simulated in this process"

    @property
    def pictures(self) -> int:
        """Number of camera pictures rendered."""
        return self._studio.frames

    @property
    def teleop(self) -> EmbeddedTeleop:
        """Moves things by hand."""
        return EmbeddedTeleop(self._session, self._send)

    def start(self, on_frame: OnFrame, on_elsewhere: OnElsewhere) -> None:
        """Begin; nobody else changes a world of this process."""
        self._on_frame = on_frame
        self._worker.start()
        self._studio.start()
        self.refresh()

    def order(self, job: Job) -> None:
        """Run a job in the world's thread, then send a frame."""

        def run() -> None:
            try:
                job()
            finally:
                self._send()

        self._worker.order(run)

    def refresh(self) -> None:
        """Send a frame."""
        self._worker.read(self._send)

    def picture(self, camera: str, deliver: OnPicture, refuse: OnRefused) -> None:
        """Have a picture drawn in the studio's thread."""
        self._studio.request(View(camera, "rgb", "jpeg"), deliver, refuse)

    def look(self, deliver: OnScene, refuse: OnRefused) -> None:
        """Have perception look between two control ticks."""

        def ask() -> None:
            try:
                deliver(self._session.observe())
            except RoboSandboxError as error:
                refuse(error)

        self._worker.read(ask)

    def load(self, task: Task | str, robot: str | None) -> None:
        """Load another task; for jobs."""
        require(self._session.sim, "reset", "loading another task does that")
        session = self._open(task, robot)
        before = self._session
        with self._studio.lock:
            self._adopt(session)
            self._worker.exchange(session.sim)
            self._studio.exchange(session.sim)
        before.close()

    def adopt(self) -> None:
        """Nothing: nobody else loads anything."""

    def relook(self) -> None:
        """Nothing: `blueprint` is always the sim's own."""

    def settle(self) -> None:
        """Let the arm come to rest; for jobs."""
        for _ in range(_REST_TRIALS):
            try:
                # A new goal of the context, in which no earlier cancel counts.
                with self._session.ctx.goal():
                    come_to_rest(self._session.sim)
                return
            except SkillError as error:
                # Another cancel, or a limit that the braking arm still passes.
                _log.debug("on the way to rest: %s", error)

    def close(self) -> None:
        """Stop the arm, the threads and the world."""
        self._session.ctx.cancel()
        idle = threading.Event()
        self._worker.order(idle.set)
        idle.wait(_STOP_SECONDS)
        self._studio.stop()
        if self._worker.stop(_STOP_SECONDS):
            self._session.close()

    def _adopt(self, session: EmbeddedWorkcell) -> None:
        self._session = session
        sim = session.sim
        self._drawn: _Simulated | _Believed = _Simulated(sim) if isinstance(sim, Modelled) else _Believed(session)
        sim.subscribe(Pace(sim))
        sim.subscribe(self._between_ticks)

    def _between_ticks(self) -> None:
        now = time.monotonic()
        if now >= self._due:
            # Not from now on: ticks come every so often, and each frame would wait for the next one.
            self._due = max(self._due + 1.0 / FRAME_HZ, now)
            self._send()

    def _send(self) -> None:
        self._on_frame(self._drawn.frame())


class _Simulated:
    """Draws a world that is simulated with a model, as it truly is."""

    def __init__(self, sim: Modelled) -> None:
        self._sim = sim

    @property
    def world(self) -> World:
        return self._sim.world

    def frame(self) -> Frame:
        sim = self._sim
        state = sim.snapshot()
        # A state begins with the time, and positions come next.
        qpos = state[1 : 1 + sim.model.nq]
        return Frame(model=sim.model, seen=sim.state(), held=sim.held(), qpos=qpos, state=state)


class _Believed:
    """Draws what perception saw last, in a world of which nothing else is known."""

    def __init__(self, session: EmbeddedWorkcell) -> None:
        self._session = session
        self._believed = BelievedWorld(session.task.scene, session.observe())

    @property
    def world(self) -> World:
        return self._believed.world

    def frame(self) -> Frame:
        seen = self._session.ctx.seen
        return self._believed.frame(seen or self._session.observe(), self._session.sim.state())
