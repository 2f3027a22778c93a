"""The one owner of a running workcell: its thread, its queue, its pace, its stop, its pictures and its recording."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar

from robosandbox.agent.episode import Episode
from robosandbox.driver import come_to_rest
from robosandbox.errors import BusyError, CancelledError, InternalError, RoboSandboxError, SkillError, UnsupportedError
from robosandbox.evidence import BusyEvidence
from robosandbox.skills.events import EventStream, SkillStarted
from robosandbox.tasks.task import Task
from robosandbox.types import SkillResult
from robosandbox.workcell.embedded import EmbeddedWorkcell, OpenedTask
from robosandbox.workcell.orders import BoundOrder, OrderResult
from robosandbox.workcell.recording.settings import RecordSettings, check_settings, open_recorder
from robosandbox.workcell.studio import Shot, Studio
from robosandbox.workcell.workcell import Workcell
from robosandbox.workcell.world_thread import Job, Pace, WorldThread
from robosandbox.workcell.zenoh.messages import Picture
from robosandbox.world.operators import BoundCall

_log = logging.getLogger(__name__)
# Activities that may wait behind the one that runs; above the steps of any plan that a person follows.
MAX_WAITING = 16
# How long a motion, or a look through cameras, may take to stop, seconds; a motion stops within 0.15 s (docs/measured.md).
STOP_SECONDS = 10.0
# How often coming to rest is begun anew: a cancel or a limit may end each trial.
_REST_TRIALS = 5

ValueT = TypeVar("ValueT")


@dataclass(slots=True, eq=False)
class Activity(Generic[ValueT]):
    """One thing that the robot is busy with, or will be.

    Attributes:
        what: In words.
        is_goal: Whether it is carried out as a goal of the cell's context, which a cancel or a timeout ends; else it changes
            the world, and calls `WorkcellHost.check` on the way.
        goal_id: Of a goal that others know by an id.
        owner: Whose loss ends it.
        timeout: Simulated seconds that it may take.
        work: Does it; None until it may begin.
        closing: Called with what came of it when the arm has come to rest, before anybody is told.
        done: What came of it.
        running: Whether it has begun.
        stopped: Whether somebody asked for its end.
        abandoned: Whether that was because its owner was lost.
    """

    what: str
    is_goal: bool
    goal_id: str | None = None
    owner: str | None = None
    timeout: float | None = None
    work: Callable[[], ValueT] | None = None
    closing: Callable[[ValueT | RoboSandboxError], None] | None = None
    done: Future[ValueT] = field(default_factory=lambda: _promised())
    running: bool = False
    stopped: bool = False
    abandoned: bool = False


class WorkcellHost:
    """Owns a running cell: one thing is done at a time, whoever asks for it, and what is asked meanwhile is told.

    From `start` on a thread of its own touches the driver; without it, an activity is carried out in the thread that begins it.

    Args:
        cell: The workcell; it is the host's to close.
        pace: How simulated time passes.
        record: Where and how episodes are recorded, those of tasks that are loaded later as well.
        boot_id: For pictures: the process that takes them.

    Raises:
        InputError: The cell cannot be recorded so.

    Attributes:
        cell: The workcell.
        thread: Touches the driver.
        events: All that its agent and its skills tell, also after another task was loaded.
    """

    def __init__(
        self,
        cell: Workcell,
        *,
        pace: Pace = "fast",
        record: RecordSettings | None = None,
        boot_id: str = "",
    ) -> None:
        self.events: EventStream = EventStream()
        self._record = record
        self._activities: deque[Activity[Any]] = deque()
        self._moved = False
        self._leave: list[Job] = []
        driver = cell.driver if isinstance(cell, EmbeddedWorkcell) else None
        self.thread: WorldThread = WorldThread(driver, pace, self._next_job)
        self._changed = self.thread.changed
        self._studio = Studio(driver, self.read, boot_id) if driver is not None else None
        self.cell: Workcell = cell
        self._follow()

    # Life cycle.

    def start(self) -> None:
        """Begin: from here on the driver is the host's thread's."""
        self.thread.start()
        if self._studio is not None:
            self._studio.start()

    def wait_idle(self, seconds: float) -> bool:
        """Wait until nothing is done and nothing waits; return whether that was so within `seconds`."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._activities, seconds)

    def stop_all(self) -> None:
        """Stop what runs and what waits."""
        for activity in tuple(self._activities):
            self.stop(activity)

    def end(self, seconds: float = STOP_SECONDS) -> bool:
        """End the threads after what runs, dropping what waits; return whether they ended within `seconds`."""
        if self._studio is not None:
            self._studio.stop()
        ended = self.thread.end(seconds)
        if ended:
            self._let_go()
        return ended

    def close(self) -> None:
        """Stop what runs, end the threads, and free the cell."""
        self.stop_all()
        self.wait_idle(STOP_SECONDS)
        if self.end():
            self.cell.close()

    # What is done.

    @property
    def running(self) -> Activity[Any] | None:
        """The activity that runs."""
        first = self._first()
        return first if first is not None and first.running else None

    @property
    def doing(self) -> str | None:
        """What the robot is busy with, in words; None when it is free."""
        first = self._first()
        return first.what if first is not None else None

    def claim(self, activity: Activity[Any], *, queue: bool | None = None) -> None:
        """Take an activity in, so that no other can be; `begin` lets it go.

        Args:
            activity: Which.
            queue: Whether it waits behind others; None where that is not to be had.

        Raises:
            BusyError: Another runs or waits, or too many wait.
        """
        with self._changed:
            first, waiting = self._first(), max(0, len(self._activities) - 1)
            if first is not None and not (queue and waiting < MAX_WAITING):
                if queue:
                    what = f"{waiting} goals wait already"
                elif first.stopped:
                    what = "it is being stopped; wait for its end"
                    if queue is not None:
                        what = "it was cancelled and is being stopped; wait for its end (`wait`, or its status), or send with queue"
                else:
                    what = "cancel it or wait for it" if queue is None else "cancel it, wait for it, or send with queue"
                raise BusyError(
                    f"the robot is busy with {first.what}; {what}",
                    evidence=BusyEvidence(doing=first.what, goal_id=first.goal_id, waiting=waiting),
                )
            self._activities.append(activity)

    def drop(self, activity: Activity[Any]) -> None:
        """Forget an activity that was claimed and is not to begin."""
        with self._changed:
            if activity in self._activities:
                self._activities.remove(activity)
            self._changed.notify_all()

    def begin(self, activity: Activity[ValueT], work: Callable[[], ValueT]) -> Activity[ValueT]:
        """Have a claimed activity carried out when those before it have ended; return it."""
        with self._changed:
            activity.work = work
        self.thread.wake()
        if not self.thread.started:
            self._carry_out(activity)
        return activity

    def goal(self, what: str, work: Callable[[], ValueT], *, timeout: float | None = None) -> Activity[ValueT]:
        """Do something as one goal of the cell's context.

        Args:
            what: In words.
            work: Does it, in the host's thread.
            timeout: Simulated seconds that it may take.

        Raises:
            BusyError: Something else is under way.
        """
        activity = Activity[ValueT](what, is_goal=True, timeout=timeout)
        self.claim(activity)
        return self.begin(activity, work)

    def carry_out(
        self, call: BoundCall | BoundOrder, *, timeout: float | None = None
    ) -> Activity[SkillResult | OrderResult]:
        """Carry out a call or an order as one goal.

        Raises:
            BusyError: Something else is under way.
        """
        what = str(call.call) if isinstance(call, BoundCall) else call.name
        return self.goal(what, lambda: self.perform(call), timeout=timeout)

    def perform(self, call: BoundCall | BoundOrder, *, confirmed: bool = False) -> SkillResult | OrderResult:
        """Carry out a call or an order; for the work of goals.

        Args:
            call: Which.
            confirmed: Whether a person has seen what would come of a call, and confirmed it.
        """
        if isinstance(call, BoundOrder):
            return self.perform_order(call)
        return self.cell.agent.perform_bound(call, confirmed=confirmed)

    def perform_order(self, order: BoundOrder) -> OrderResult:
        """Carry out an order; for the work of goals."""
        if order.kind.undoes:
            return self.start_over(lambda: order.carry_out(self.cell))
        return order.carry_out(self.cell)

    def change(self, what: str, job: Callable[[], ValueT], *, owner: str | None = None) -> Activity[ValueT]:
        """Change the world otherwise than by a goal.

        Args:
            what: In words.
            job: Does it, in the host's thread, and calls `check` often.
            owner: Whose loss ends it.

        Raises:
            BusyError: Something else is under way.
        """
        activity = Activity[ValueT](what, is_goal=False, owner=owner)
        self.claim(activity)
        return self.begin(activity, job)

    def reset(self, seed: int) -> Activity[None]:
        """Start over with a seed's layout, with a way back.

        Raises:
            BusyError: Something else is under way.
        """
        return self.change(f"reset to seed {seed}", lambda: self.start_over(lambda: self.cell.reset(seed)))

    def start_over(self, reset: Callable[[], ValueT]) -> ValueT:
        """Put the cell into an earlier state, or a new one; for jobs. One that is given up on the way changes nothing."""
        cell = self.cell
        if self._studio is None:
            return reset()
        with self._studio.lock:
            try:
                before = cell.checkpoint()
            except UnsupportedError:
                return reset()
            try:
                return reset()
            except CancelledError:
                # Half a reset is no layout of any seed.
                cell.restore(before)
                raise

    def load(self, task: Task | str, robot: Path | str | None = None) -> Activity[None]:
        """Put another task in the place of this one.

        Args:
            task: A task, a bundled one's name, or a YAML file.
            robot: In place of the task's.

        Raises:
            BusyError: Something else is under way.
        """
        name = task.name if isinstance(task, Task) else task
        what = f"load {name}" + (f" with {robot}" if robot else "")
        return self.change(what, lambda: self.exchange(task, robot))

    def exchange(self, task: Task | str, robot: Path | str | None = None) -> None:
        """Load another task; for jobs. Where that cannot be done, this one stays.

        Raises:
            InputError: Task or robot is wrong, or cannot be recorded as this one is.
        """
        cell = self.cell
        self.check()
        if not isinstance(cell, EmbeddedWorkcell) or self._studio is None:
            cell.load(task, robot)
        else:
            with self._studio.lock:
                cell.load(task, robot, wait_hook=self.check, accept=self._check_recording)
                self._studio.exchange(cell.driver)
        self._follow()

    def adopt(self) -> None:
        """Listen to what the cell has in another process, where another client has loaded that; for jobs."""
        self._follow()

    # How it is stopped.

    def stop(self, activity: Activity[Any] | None = None, *, abandoned: bool = False) -> str | None:
        """Stop an activity, from any thread: it ends in a CancelledError, the arm holding.

        Args:
            activity: Which; what is done now if left out.
            abandoned: Whether nobody asked for it, but its owner was lost.

        Returns:
            What was stopped; None where nothing was.
        """
        with self._changed:
            found = activity if activity is not None else self._first()
            if found is None or found not in self._activities:
                return None
            found.stopped = True
            found.abandoned = found.abandoned or abandoned
            if found.running and found.is_goal:
                self.cell.ctx.cancel()
            return found.what

    def give_up(self) -> None:
        """Stop what changes the world; nothing where a goal is carried out, or nothing is done."""
        first = self._first()
        if first is not None and not first.is_goal:
            self.stop(first)

    def lose(self, owner: str) -> tuple[str, ...]:
        """Stop what somebody wanted who is gone; return what that was."""
        lost = [activity for activity in tuple(self._activities) if activity.owner == owner]
        return tuple(what for one in lost if (what := self.stop(one, abandoned=True)))

    def check(self) -> None:
        """Go on with a change, or give it up; for jobs.

        Raises:
            CancelledError: Somebody stopped it.
        """
        running = self.running
        if running is not None and running.stopped and not running.is_goal:
            raise CancelledError(f"{running.what} was given up; look how the world is now")

    # What is looked at.

    def read(self, job: Job) -> None:
        """Run a short job that changes nothing, between two control ticks or at once."""
        self.thread.read(job)

    def reading(self, look: Callable[[], ValueT]) -> Future[ValueT]:
        """Return what a short look returns that changes nothing."""
        seen: Future[ValueT] = _promised()

        def read() -> None:
            try:
                seen.set_result(look())
            except Exception as error:
                seen.set_exception(error)

        self.read(read)
        return seen

    def picture(self, camera: str, format: Literal["png", "jpeg"] = "png") -> Future[tuple[bytes, Picture]]:
        """Return what a camera sees, as a file's bytes, and what there is to know of it."""
        if self._studio is None:
            return self.reading(lambda: self.cell.photograph(camera, format))
        taken: Future[tuple[bytes, Picture]] = _promised()
        self._studio.request(
            Shot(camera, "rgb", format), lambda *picture: taken.set_result(picture), taken.set_exception
        )
        return taken

    @property
    def embedded(self) -> EmbeddedWorkcell:
        """The cell, where it is of this process."""
        assert isinstance(self.cell, EmbeddedWorkcell), "the cell is another process's"
        return self.cell

    @property
    def studio(self) -> Studio:
        """What draws the cameras of a cell in this process."""
        assert self._studio is not None, "the cameras of another process's cell are drawn there"
        return self._studio

    # The cell.

    def _first(self) -> Activity[Any] | None:
        with self._changed:
            return self._activities[0] if self._activities else None

    def _check_recording(self, opened: OpenedTask) -> None:
        if self._record is not None:
            check_settings(self._record, opened.driver)

    def _follow(self) -> None:
        """Listen to the cell's events and ticks, and record it."""
        self._let_go()
        cell = self.cell
        if self._record is not None and isinstance(cell, EmbeddedWorkcell):
            recorder = open_recorder(self._record, cell)
            recorder.follow()
            self._leave.append(recorder.close)
        self._leave.append(cell.ctx.events.subscribe(self._hear))
        if isinstance(cell, EmbeddedWorkcell):
            self._leave.append(self.thread.own(cell.driver))
            if (world := cell.driver.simulation) is not None:
                world.wait_hooks.append(self.check)

    def _let_go(self) -> None:
        while self._leave:
            self._leave.pop()()

    def _hear(self, event: object) -> None:
        self._moved = self._moved or isinstance(event, SkillStarted)
        self.events.emit(event)

    # In the thread.

    def _next_job(self) -> Job | None:
        """Return what carries out the activity that may begin."""
        first = self._first()
        may = first is not None and first.work is not None and not first.running
        return partial(self._carry_out, first) if first is not None and may else None

    def _carry_out(self, activity: Activity[Any]) -> None:
        """Carry out an activity, have the arm come to rest where it failed, and tell what came of it."""
        came: Any
        self._moved = False
        try:
            try:
                came = self._in_goal(activity) if activity.is_goal else self._worked(activity)
            except RoboSandboxError as error:
                came = error
            except Exception as fault:
                came = InternalError.log(activity.what, fault, _log)
            if self._moved and _is_failure(came):
                self._come_to_rest()
            if closing := activity.closing:
                self.thread.run(partial(closing, came))
        finally:
            # Before anybody is told: who hears of it may go on.
            self.drop(activity)
        if isinstance(came, RoboSandboxError):
            activity.done.set_exception(came)
        else:
            activity.done.set_result(came)

    def _in_goal(self, activity: Activity[Any]) -> Any:
        with self.cell.ctx.goal(activity.timeout):
            return self._worked(activity)

    def _worked(self, activity: Activity[Any]) -> Any:
        with self._changed:
            # From here on a cancel reaches the context; a goal forgets one that came before it began.
            if activity.stopped:
                raise CancelledError("cancelled before it began")
            activity.running = True
        assert activity.work is not None
        return activity.work()

    def _come_to_rest(self) -> None:
        cell = self.cell
        if not isinstance(cell, EmbeddedWorkcell):
            # Its own host does that.
            return
        for _ in range(_REST_TRIALS):
            try:
                # A new goal of the context, in which no deadline and no earlier cancel counts.
                with cell.ctx.goal():
                    come_to_rest(cell.driver)
                return
            except SkillError as error:
                # Another cancel, or a limit that the braking arm still passes.
                _log.debug("on the way to rest: %s", error)


def _promised() -> Future[Any]:
    """Return a future that nobody who waits for it can cancel."""
    future: Future[Any] = Future()
    future.set_running_or_notify_cancel()
    return future


def _is_failure(came: object) -> bool:
    match came:
        case RoboSandboxError() | Episode(success=False):
            return True
        case OrderResult(failure=failure):
            return failure is not None
        case _:
            return False
