"""Carries out what people click, one thing at a time, and remembers the way back."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from robosandbox.agent.episode import AgentEvent
from robosandbox.apps.viewer.source import WorldSource
from robosandbox.errors import CancelledError, InternalError, RoboSandboxError
from robosandbox.tasks.task import Task
from robosandbox.types import Plan, Refusal, RefusalCode
from robosandbox.workcell.orders import ORDERS, Answer, BoundOrder, bind_order, says_stop
from robosandbox.workcell.workcell import Workcell

_log = logging.getLogger(__name__)


class Doing(StrEnum):
    """Activity that is under way."""

    NOTHING = "nothing"
    PLANNING = "planning"
    TRYING = "trying"
    RUNNING = "running"
    JUDGING = "judging"
    MOVING = "moving"
    LOADING = "loading"


@dataclass(frozen=True, slots=True)
class Began:
    """Something is under way now; `what` says it in words."""

    doing: Doing
    what: str


@dataclass(frozen=True, slots=True)
class Idle:
    """Nothing is under way any more; `ways_back` is how often Step back can be used."""

    ways_back: int


@dataclass(frozen=True, slots=True)
class Came:
    """What came of an order."""

    order: BoundOrder
    answer: Answer

    @property
    def refusal(self) -> Refusal | None:
        """The planner's no, if it said no."""
        refused = self.answer.data.get("refusal")
        return Refusal.model_validate(refused) if refused else None

    @property
    def question(self) -> Refusal | None:
        """The planner's no where it is a question, which the next sentence answers."""
        return self.refusal if self.refusal is not None and is_question(self.refusal) else None


@dataclass(frozen=True, slots=True)
class Stopped:
    """What was under way, and is no order, was stopped."""


@dataclass(frozen=True, slots=True)
class Went:
    """The world was put into another state: `how` says by what."""

    how: str


@dataclass(frozen=True, slots=True)
class Loaded:
    """There is another world."""


@dataclass(frozen=True, slots=True)
class Complaint:
    """Something could not be done, for the reason in `message`."""

    message: str


@dataclass(frozen=True, slots=True)
class Presence:
    """The process that has the world went away, which `away` says in words, or is back, and `away` is empty."""

    away: str


News = Began | Idle | Came | Stopped | Went | Loaded | Complaint | Presence | AgentEvent


def is_question(refusal: Refusal) -> bool:
    """Tell whether the planner asks something, which the next sentence answers."""
    return refusal.code is RefusalCode.AMBIGUOUS


class Operator:
    """Has orders, resets and loads carried out in a world.

    Args:
        source: The world.

    Attributes:
        listeners: Called with all news, in the thread where it happens.
    """

    def __init__(self, source: WorldSource) -> None:
        self.source = source
        self.listeners: list[Callable[[News], None]] = []
        self._lock = threading.Lock()
        self._doing = Doing.NOTHING
        self._stop = threading.Event()
        self._leave = source.workcell.ctx.events.subscribe(self.tell)

    @property
    def doing(self) -> Doing:
        """Activity that is under way."""
        return self._doing

    def tell(self, news: News) -> None:
        """Hand news to all listeners."""
        for listener in tuple(self.listeners):
            try:
                listener(news)
            except Exception:
                # A panel that fails must not end the episode that it shows.
                _log.exception("fault in a panel")

    # What people click.

    def run(self, prompt: str) -> None:
        """Carry out a prompt; "stop" stops what is under way."""
        if says_stop(prompt):
            self.stop()
        else:
            self._begin(Doing.RUNNING, prompt, lambda: self._run(prompt))

    def follow(self, plan: Plan) -> None:
        """Carry out a plan as it is."""
        words = ", ".join(map(str, plan.steps))
        self._begin(Doing.RUNNING, words, lambda: self._carry_out("follow", steps=plan.steps))

    def plan(self, prompt: str) -> None:
        """Ask the planner, and move nothing."""
        self._begin(Doing.PLANNING, prompt, lambda: self._carry_out("plan", prompt=prompt))

    def simulate(self, prompt: str) -> None:
        """Ask the planner, and try its plan on the twin; this world is left alone."""
        self._begin(Doing.TRYING, prompt, lambda: self._simulate(prompt))

    def judge(self) -> None:
        """Tell whether the task has succeeded."""
        self._begin(Doing.JUDGING, self._work.task.name, lambda: self._carry_out("judge"))

    def reset(self, seed: int) -> None:
        """Start over with a seed's layout."""

        def job() -> None:
            self._work.remember(f"reset to seed {seed}")
            self._work.reset(seed)
            self.source.relook()
            self.tell(Went(f"seed {seed}"))

        self._begin(Doing.LOADING, f"reset to seed {seed}", job)

    def back(self) -> None:
        """Go back to before the last thing that changed the world."""

        def job() -> None:
            what = self._work.undo()
            self.source.relook()
            self.tell(Went(f"back to before: {what}"))

        self._begin(Doing.LOADING, "step back", job)

    def load(self, task: Task | str, robot: str | None) -> None:
        """Load another task, robot or both."""
        self._begin(
            Doing.LOADING,
            f"load {task.name if isinstance(task, Task) else task}" + (f" with {robot}" if robot else ""),
            lambda: self._exchange(lambda: self.source.load(task, robot)),
        )

    def changed_elsewhere(self, loaded: bool) -> None:
        """Take note that somebody else has reset the world, or loaded another one, which is taken over when nothing runs."""
        if loaded:
            self._begin(
                Doing.LOADING, "what another client has loaded", lambda: self._exchange(self.source.adopt), quiet=True
            )
        else:
            self.tell(Went("reset by another client"))

    def by_hand(self, what: str, job: Callable[[], None]) -> bool:
        """Move something by hand; return whether it was begun, which it is not while something else is under way."""

        def moved() -> None:
            self._work.remember(what)
            job()

        return self._begin(Doing.MOVING, what, moved, quiet=True)

    def stop(self) -> None:
        """Stop what runs; the arm holds where it is."""
        if self._doing is Doing.NOTHING:
            return
        self._stop.set()
        self._work.ctx.cancel()

    # Inside.

    def _exchange(self, load: Callable[[], None]) -> None:
        """Have the source open another world, and listen to the agent of that one."""
        self._leave()
        try:
            load()
        finally:
            self._leave = self._work.ctx.events.subscribe(self.tell)
        self.tell(Loaded())

    @property
    def _work(self) -> Workcell:
        return self.source.workcell

    def _run(self, prompt: str) -> None:
        """Carry out a prompt, and judge what came of it where it is the task's own."""
        came, work = self._carry_out("run", prompt=prompt), self._work
        if came.failure is None and prompt == work.task.prompt and work.judgeable:
            self._carry_out("judge")

    def _simulate(self, prompt: str) -> None:
        plan = self._carry_out("plan", prompt=prompt).data["plan"]
        if plan:
            self._carry_out("simulate", steps=plan)

    def _carry_out(self, name: str, **arguments: Any) -> Answer:
        """Carry out an order as one goal, tell what came of it, and return that."""
        work, order = self._work, bind_order(name, arguments)
        with work.ctx.goal():
            if self._stop.is_set():
                # A goal forgets what was cancelled before it began.
                work.ctx.cancel()
            answer = order.carry_out(work)
        if answer.failure is not None and ORDERS[name].moves:
            self.source.settle()
        self.tell(Came(order, answer))
        return answer

    def _begin(self, doing: Doing, what: str, job: Callable[[], object], *, quiet: bool = False) -> bool:
        with self._lock:
            if self._doing is not Doing.NOTHING:
                if not quiet:
                    self.tell(Complaint(f"{self._doing} now; stop it first"))
                return False
            self._doing = doing
            self._stop.clear()
        self.tell(Began(doing, what))
        self.source.order(lambda: self._do(job))
        return True

    def _do(self, job: Callable[[], object]) -> None:
        try:
            job()
        except CancelledError:
            self.tell(Stopped())
        except RoboSandboxError as error:
            self.tell(Complaint(" ".join(str(error).split())))
        except Exception as fault:
            self.tell(Complaint(str(InternalError.log("the viewer", fault, _log))))
        finally:
            self._doing = Doing.NOTHING
            self.tell(Idle(self._work.ways_back))
