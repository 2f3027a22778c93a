"""The sim process on Zenoh: answers questions, takes goals, runs them one at a time, publishes what happens."""

from __future__ import annotations

import logging
import uuid
from collections.abc import Callable
from typing import Any, Literal, Self

import zenoh

from robosandbox.driver import require, simulated
from robosandbox.errors import ForbiddenError, InvalidMessageError, ServiceUnavailableError
from robosandbox.evidence import MessageEvidence
from robosandbox.tasks.task import Task
from robosandbox.versions import versions
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.host import STOP_SECONDS, WorkcellHost
from robosandbox.workcell.recording.settings import RecordSettings
from robosandbox.workcell.world_thread import Pace
from robosandbox.workcell.zenoh.messages import Ask, Clock, Goal, Info, Load, Message, Reset, Saved, TrueState, key
from robosandbox.workcell.zenoh.server.autosave import Autosave
from robosandbox.workcell.zenoh.server.checkpoint import KeptCheckpoints, SavedWorld, StateFile
from robosandbox.workcell.zenoh.server.goal_requests import GoalRequests
from robosandbox.workcell.zenoh.server.goals import Ledger
from robosandbox.workcell.zenoh.server.liveliness import ConnectedClients
from robosandbox.workcell.zenoh.server.publishing import CameraStreams, GoalNews, ObjectStream, StateStream
from robosandbox.workcell.zenoh.server.readings import Readings, info_of
from robosandbox.workcell.zenoh.server.requests import Request, serve

_log = logging.getLogger(__name__)
# Returns the task that a client asks for, and a robot in place of its own; raises InputError.
Wanted = Callable[[Load], tuple[Task, str | None]]
# A hundred physics steps of the largest scene that a client may load take 0.2 s of CPU.
_GIVE_UP_SECONDS = 0.5


class SimServer:
    """Serves a loaded task under `robosandbox/<robot_id>/`.

    Zenoh's threads check and answer; the host's thread touches the world.

    Args:
        cell: The loaded task; it stays the caller's to close.
        session: A Zenoh session; it stays the caller's to close.
        robot_id: In keys.
        load: Finds other tasks.
        pace: How simulated time passes.
        truth: Whether `truth` answers.
        state_file: Where the world is saved at each goal's end and every few seconds.
        record: Where and how each goal is recorded.

    Raises:
        InputError: The cell cannot be recorded so.
        UnsupportedError: The world of this driver cannot be saved, and a state file is given.

    Attributes:
        boot_id: New with every server.
        host: Owns the running cell.
    """

    def __init__(
        self,
        cell: EmbeddedWorkcell,
        session: zenoh.Session,
        *,
        robot_id: str,
        load: Wanted,
        pace: Literal["realtime", "fast"] = "realtime",
        truth: bool = True,
        state_file: StateFile | None = None,
        record: RecordSettings | None = None,
    ) -> None:
        self.boot_id: str = str(uuid.uuid4())
        self._cell = cell
        self._session = session
        self._robot_id = robot_id
        self._wanted = load
        self._default_pace: Pace = pace
        self._truth = truth
        if state_file is not None:
            simulated(cell.driver, "--state-file keeps its world")
        self.host: WorkcellHost = WorkcellHost(cell, pace=pace, record=record, boot_id=self.boot_id)
        self._kept = KeptCheckpoints()
        self._pace_owner: str | None = None
        self._declared: list[Any] = []
        self._info = self._describe()
        self._autosave = Autosave(state_file, self.host.read, self._freeze)
        self._ledger = Ledger(self.boot_id, self._autosave.keep)
        self._readings = Readings(self.host, boot_id=self.boot_id, with_truth=truth)
        self._clients = ConnectedClients(session, robot_id, self._on_client_gone)
        self._goals = GoalRequests(
            self.host,
            self._ledger,
            GoalNews(session, robot_id),
            self._autosave,
            boot_id=self.boot_id,
            robot_id=robot_id,
            with_truth=truth,
            expect=self._clients.expect,
        )
        self._state = StateStream(session, robot_id, self.host.read, self._readings.state)
        self._objects = ObjectStream(session, robot_id, self.host.read, self._readings.objects)
        self._cameras = CameraStreams(session, robot_id, self.host.studio)

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
        self.host.start()
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
        running = self.host.running
        self.host.stop_all()
        if not self.host.wait_idle(STOP_SECONDS if running is not None and running.is_goal else _GIVE_UP_SECONDS):
            _log.error("%s does not stop and is left open", self.host.doing)
        self._state.stop()
        self._objects.stop()
        ended = self.host.end(_GIVE_UP_SECONDS)
        self._autosave.stop()
        if ended:
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
        request.answer(self._info.model_copy(update={"doing": self.host.doing, "pace": self.host.thread.pace}))

    def _on_picture(self, request: Request) -> None:
        require(self._cell.driver, "cameras", "a picture was asked for")
        self._cameras.on_request(request)

    def _reading(self, read: Callable[[], Message]) -> Callable[[Request], None]:
        """Return what answers with a reading of the world, taken between two control ticks."""

        def answer(request: Request) -> None:
            request.message(Ask)
            self.host.reading(read).add_done_callback(request.settle)

        return answer

    def _true_state(self) -> TrueState:
        if not self._truth:
            raise ForbiddenError("truth: this sim was started with --no-ground-truth; use obs/objects")
        require(self._cell.driver, "truth", "truth answers with it (obs/objects tells what perception believes)")
        return self._readings.truth()

    def _save_checkpoint(self) -> Saved:
        require(self._cell.driver, "fork", "a checkpoint is a copy of it")
        return Saved(checkpoint=self._kept.keep(self._cell.checkpoint()), time=self._cell.driver.time)

    # Changes of the world.

    def _on_reset(self, request: Request) -> None:
        message = request.message(Reset)
        if (message.seed is None) == (message.checkpoint is None):
            raise _wrong("seed", "give a seed or a checkpoint, one of the two")
        require(self._cell.driver, "reset", "reset does that")

        def put() -> None:
            if message.seed is not None:
                self._cell.reset(message.seed)
            else:
                self._cell.restore(self._kept.find(str(message.checkpoint)))

        def reset() -> TrueState:
            self.host.start_over(put)
            self._info = self._describe()
            self._autosave.save()
            return self._readings.truth()

        self._change("reset", request, reset, message.client_id)

    def _on_load(self, request: Request) -> None:
        message = request.message(Load)
        if (message.task is None) == (message.document is None):
            raise _wrong("task", "give a task's name or a document, one of the two")
        require(self._cell.driver, "reset", "loading another task does that")

        def load() -> TrueState:
            self.host.exchange(*self._wanted(message))
            self._readings.loads += 1
            self._kept = KeptCheckpoints()
            self._info = self._describe()
            self._cameras.follow(self._info.cameras)
            self._autosave.save()
            return self._readings.truth()

        self._change("load", request, load, message.client_id)

    def _on_clock(self, request: Request) -> None:
        message = request.message(Clock)
        if message.cancel:
            self.host.give_up()
        if message.pace is not None:
            self.host.thread.set_pace(message.pace)
            self._pace_owner = message.client_id
        seconds = message.step
        if seconds is None:
            self.host.reading(self._readings.truth).add_done_callback(request.settle)
            return

        def step() -> TrueState:
            driver = self._cell.driver
            for _ in range(max(1, round(seconds / driver.control_timestep))):
                self.host.check()
                driver.wait(driver.control_timestep)
            return self._readings.truth()

        self._change("clock", request, step, message.client_id)

    def _change(self, name: str, request: Request, job: Callable[[], TrueState], client_id: str | None) -> None:
        self.host.change(name, job, owner=client_id).done.add_done_callback(request.settle)
        if client_id is not None:
            self._clients.expect(client_id)

    def _describe(self) -> Info:
        return info_of(
            self._cell,
            robot_id=self._robot_id,
            boot_id=self.boot_id,
            truth=self._truth and self._cell.driver.capabilities.truth,
            pace="fast" if self.host.thread.pace == "fast" else "realtime",
            sizes=self.host.studio.sizes,
        )

    def _on_client_gone(self, client_id: str) -> None:
        for what in self.host.lose(client_id):
            _log.info("client %s is gone; its %s is stopped", client_id, what)
        if self._pace_owner == client_id:
            self._pace_owner = None
            self.host.thread.set_pace(self._default_pace)

    def _freeze(self, ended: Goal | None) -> SavedWorld:
        goals, accepted = self._ledger.dump(ended)
        return SavedWorld(
            boot_id=self.boot_id,
            mujoco=versions()["mujoco"],
            task=self._cell.task.model_dump(mode="json"),
            checkpoint=self._cell.checkpoint(),
            goals=goals,
            accepted=accepted,
        )


def _wrong(field: str, problem: str) -> InvalidMessageError:
    return InvalidMessageError(f"{field}: {problem}", evidence=MessageEvidence(field=field, problem=problem))
