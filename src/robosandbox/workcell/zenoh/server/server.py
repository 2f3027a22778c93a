"""The sim process on Zenoh: answers questions, takes goals, runs them one at a time, publishes what happens."""

from __future__ import annotations

import logging
import threading
import uuid
from collections.abc import Callable
from typing import Any, Self

import zenoh

from robosandbox.driver import require, simulated
from robosandbox.errors import CancelledError, ForbiddenError, InvalidMessageError, ServiceUnavailableError
from robosandbox.evidence import MessageEvidence
from robosandbox.versions import versions
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.zenoh.messages import Ask, Clock, Goal, Info, Load, Message, Reset, Saved, TrueState, key
from robosandbox.workcell.zenoh.server.autosave import Autosave
from robosandbox.workcell.zenoh.server.changes import WorldChanges
from robosandbox.workcell.zenoh.server.checkpoint import KeptCheckpoints, SavedWorld, StateFile
from robosandbox.workcell.zenoh.server.execution import Executor
from robosandbox.workcell.zenoh.server.goal_requests import GoalRequests
from robosandbox.workcell.zenoh.server.goals import Ledger
from robosandbox.workcell.zenoh.server.liveliness import ConnectedClients
from robosandbox.workcell.zenoh.server.publishing import CameraStreams, GoalNews, ObjectStream, StateStream
from robosandbox.workcell.zenoh.server.requests import Request, serve
from robosandbox.workcell.zenoh.server.snapshots import Readings, info_of
from robosandbox.workcell.zenoh.server.studio import Studio
from robosandbox.workcell.zenoh.server.worker import Pace, Worker

_log = logging.getLogger(__name__)
# Returns another loaded task, calling the second argument often on the way; raises InputError, and what that raises.
OpenTask = Callable[[Load, Callable[[], None]], EmbeddedWorkcell]
# How long a goal may take to stop, seconds; chosen because a planning skill hears of it between two samples or solutions.
_STOP_SECONDS = 10.0
# A hundred physics steps of the largest scene that a client may load take 0.2 s of CPU.
_GIVE_UP_SECONDS = 0.5


class SimServer:
    """Serves a loaded task under `robosandbox/<robot_id>/`.

    Zenoh's threads check, queue and answer; one worker thread touches the world.

    Args:
        served: The loaded task.
        session: A Zenoh session; it stays the caller's to close.
        robot_id: In keys.
        load: Loads other tasks.
        pace: How simulated time passes.
        truth: Whether `truth` answers.
        state_file: Where the world is saved at each goal's end and every few seconds.

    Raises:
        UnsupportedError: The world of this driver cannot be saved, and a state file is given.

    Attributes:
        boot_id: New with every server.
        studio: Draws the cameras.
    """

    def __init__(
        self,
        served: EmbeddedWorkcell,
        session: zenoh.Session,
        *,
        robot_id: str,
        load: OpenTask,
        pace: Pace = "realtime",
        truth: bool = True,
        state_file: StateFile | None = None,
    ) -> None:
        self.boot_id: str = str(uuid.uuid4())
        self._served = served
        self._session = session
        self._robot_id = robot_id
        self._load = load
        self._default_pace: Pace = pace
        self._truth = truth
        if state_file is not None:
            simulated(served.driver, "--state-file keeps its world")
        self._worker = Worker(served.driver, pace)
        self._kept = KeptCheckpoints()
        self._pace_owner: str | None = None
        self._declared: list[Any] = []
        self.studio = Studio(served.driver, self._worker.read, self.boot_id)
        self._info = self._describe()
        self._autosave = Autosave(state_file, self._worker.read, self._freeze)
        self._ledger = Ledger(self.boot_id, self._autosave.keep)
        self._changes = WorldChanges(self._ledger, self._worker.order)
        if served.driver.simulation is not None:
            served.driver.simulation.wait_hooks.append(self._changes.check)
        self._executor = Executor(self._ledger, GoalNews(session, robot_id), robot_id, self._autosave.save)
        self._readings = Readings(
            lambda: self._served, lambda: self._executor.running, boot_id=self.boot_id, with_truth=truth
        )
        self._clients = ConnectedClients(session, robot_id, self._on_client_gone)
        self._goals = GoalRequests(
            self._ledger,
            lambda: self._served,
            boot_id=self.boot_id,
            robot_id=robot_id,
            changes=self._changes,
            with_truth=truth,
            begin=self._begin_goal,
            expect=self._clients.expect,
        )
        self._state = StateStream(session, robot_id, self._worker.read, self._readings.state)
        self._objects = ObjectStream(session, robot_id, self._worker.read, self._readings.objects)
        self._cameras = CameraStreams(session, robot_id, self.studio)

    # Life cycle.

    def start(self) -> None:
        """Begin to serve.

        Raises:
            ServiceUnavailableError: Another sim serves this robot id already.
            InputError: The state file cannot be written.
        """
        alive = self._key("alive")
        if any(reply.ok is not None for reply in self._session.liveliness().get(alive, timeout=0.5)):
            raise ServiceUnavailableError(
                f"--robot-id: another sim serves {self._robot_id!r} already; give this one another id"
            )
        self._autosave.start()
        self._worker.start()
        self.studio.start()
        self._declare()
        self._state.start()
        self._objects.start()
        self._cameras.follow(self._info.cameras)
        # Last: whoever sees the token may ask anything.
        self._declared.append(self._session.liveliness().declare_token(alive))

    def stop(self) -> None:
        """Cancel what runs, save, and leave the arm holding."""
        for declared in reversed(self._declared):
            declared.undeclare()
        self._declared.clear()
        self._clients.stop()
        # A goal comes to rest first. A change is given up between two steps, or left where it compiles: what it builds
        # is not the world that is saved.
        patience = _STOP_SECONDS if self._ledger.live() else _GIVE_UP_SECONDS
        for goal_id in self._ledger.live():
            self._goals.cancel(goal_id)
        self._changes.cancel()
        idle = threading.Event()
        # Behind the goals that wait for the journal.
        self._autosave.when_flushed(lambda: self._worker.order(idle.set))
        if not idle.wait(patience):
            _log.error("%s does not stop and is left open", self._changes.occupation())
        self.studio.stop()
        self._state.stop()
        self._objects.stop()
        stopped = self._worker.stop(_GIVE_UP_SECONDS)
        self._autosave.stop()
        if stopped:
            self._autosave.save()
        self._cameras.close()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def adopt(self, world: SavedWorld) -> None:
        """Take over goals of the process before; call it before `start`."""
        self._ledger.adopt(world.goals, self._robot_id)

    @property
    def served(self) -> EmbeddedWorkcell:
        """World that is served now."""
        return self._served

    @property
    def looks(self) -> int:
        """Number of times that the world's thread looked at its queue; it hangs where that does not go up."""
        return self._worker.looks

    @property
    def doing(self) -> str | None:
        """Activity of the robot; None when it is free."""
        return self._changes.occupation()

    def _key(self, *parts: str) -> str:
        return key(self._robot_id, *parts)

    def _declare(self) -> None:
        handlers: dict[str, Callable[[Request], None]] = {
            "skill/*/send_goal": self._goals.send,
            "skill/*/cancel_goal": self._goals.stop,
            "skill/*/get_result": self._goals.result,
            "truth": self._reading(self._true_state),
            "reset": self._on_reset,
            "load": self._on_load,
            "clock": self._on_clock,
            "checkpoint": self._reading(self._save_checkpoint),
        }
        for suffix, handle in handlers.items():
            self._declared.append(serve(self._session, self._key(suffix), handle))
        observations: dict[str, Callable[[Request], None]] = {
            "info": self._on_info,
            "obs/state": self._reading(self._readings.state),
            "obs/objects": self._reading(self._readings.objects),
        }
        for suffix, handle in observations.items():
            self._declared.append(serve(self._session, self._key(suffix), handle, any_robot=True))
        for kind in ("rgb", "depth"):
            self._declared.append(serve(self._session, self._key("obs/camera/*", kind), self._on_picture))
        self._clients.start()

    # Questions.

    def _on_info(self, request: Request) -> None:
        request.message(Ask)
        request.answer(self._info.model_copy(update={"doing": self._changes.occupation(), "pace": self._worker.pace}))

    def _on_picture(self, request: Request) -> None:
        require(self._served.driver, "cameras", "a picture was asked for")
        self._cameras.on_request(request)

    def _reading(self, read: Callable[[], Message]) -> Callable[[Request], None]:
        """Return what answers with a reading of the world, taken between two control ticks."""

        def answer(request: Request) -> None:
            request.message(Ask)
            self._worker.read(lambda: request.run(read))

        return answer

    def _true_state(self) -> TrueState:
        if not self._truth:
            raise ForbiddenError("truth: this sim was started with --no-ground-truth; use obs/objects")
        require(self._served.driver, "truth", "truth answers with it (obs/objects tells what perception believes)")
        return self._readings.truth()

    def _save_checkpoint(self) -> Saved:
        require(self._served.driver, "fork", "a checkpoint is a copy of it")
        return Saved(checkpoint=self._kept.keep(self._served.checkpoint()), time=self._served.driver.time)

    # Changes of the world.

    def _on_reset(self, request: Request) -> None:
        message = request.message(Reset)
        if (message.seed is None) == (message.checkpoint is None):
            raise _wrong("seed", "give a seed or a checkpoint, one of the two")
        require(self._served.driver, "reset", "reset does that")

        def reset() -> TrueState:
            with self.studio.lock:
                before = self._served.checkpoint()
                try:
                    if message.seed is not None:
                        self._served.reset(message.seed)
                    else:
                        self._served.restore(self._kept.find(str(message.checkpoint)))
                except CancelledError:
                    # Half a reset is no layout of any seed.
                    self._served.restore(before)
                    raise
            self._info = self._describe()
            self._autosave.save()
            return self._readings.truth()

        self._change("reset", request, reset, message.client_id)

    def _on_load(self, request: Request) -> None:
        message = request.message(Load)
        if (message.task is None) == (message.document is None):
            raise _wrong("task", "give a task's name or a document, one of the two")
        require(self._served.driver, "reset", "loading another task does that")

        def load() -> TrueState:
            self._changes.check()
            served = self._load(message, self._changes.check)
            with self.studio.lock:
                before, self._served = self._served, served
                self._readings.loads += 1
                self._worker.exchange(served.driver)
                self.studio.exchange(served.driver)
            before.close()
            self._kept = KeptCheckpoints()
            self._info = self._describe()
            self._cameras.follow(self._info.cameras)
            self._autosave.save()
            return self._readings.truth()

        self._change("load", request, load, message.client_id)

    def _on_clock(self, request: Request) -> None:
        message = request.message(Clock)
        if message.cancel:
            self._changes.cancel()
        if message.pace is not None:
            self._worker.set_pace(message.pace)
            self._pace_owner = message.client_id
        seconds = message.step
        if seconds is None:
            self._worker.read(lambda: request.run(self._readings.truth))
            return

        def step() -> TrueState:
            for _ in range(max(1, round(seconds / self._served.driver.control_timestep))):
                self._changes.check()
                self._served.driver.wait(self._served.driver.control_timestep)
            return self._readings.truth()

        self._change("clock", request, step, message.client_id)

    def _change(self, name: str, request: Request, job: Callable[[], Message], client_id: str | None) -> None:
        self._changes.begin(name, request, job, client_id=client_id)
        if client_id is not None:
            self._clients.expect(client_id)

    def _describe(self) -> Info:
        return info_of(
            self._served,
            robot_id=self._robot_id,
            boot_id=self.boot_id,
            truth=self._truth and self._served.driver.capabilities.truth,
            pace=self._worker.pace,
            sizes=self.studio.sizes,
        )

    def _on_client_gone(self, client_id: str) -> None:
        for goal_id in self._ledger.of_client(client_id):
            _log.info("client %s is gone; its goal %s is cancelled", client_id, goal_id)
            self._goals.cancel(goal_id, abandoned=True)
        self._changes.lose(client_id)
        if self._pace_owner == client_id:
            self._pace_owner = None
            self._worker.set_pace(self._default_pace)

    def _begin_goal(self, goal_id: str) -> None:
        # It moves nothing before a power cut would leave it known.
        self._autosave.when_flushed(lambda: self._worker.order(lambda: self._executor.execute(goal_id, self._served)))

    def _freeze(self, ended: Goal | None) -> SavedWorld:
        goals, accepted = self._ledger.dump(ended)
        return SavedWorld(
            boot_id=self.boot_id,
            mujoco=versions()["mujoco"],
            task=self._served.task.model_dump(mode="json"),
            checkpoint=self._served.checkpoint(),
            goals=goals,
            accepted=accepted,
        )


def _wrong(field: str, problem: str) -> InvalidMessageError:
    return InvalidMessageError(f"{field}: {problem}", evidence=MessageEvidence(field=field, problem=problem))
