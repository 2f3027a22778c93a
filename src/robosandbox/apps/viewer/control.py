"""Orders that people click, carried out by the host of the cell one at a time and told about to the panels."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from typing import Any, Literal, TypeVar

from robosandbox.apps.viewer.news import Began, Came, Complaint, Doing, Idle, Loaded, News, Stopped, Went
from robosandbox.apps.viewer.source import WorldSource
from robosandbox.errors import BusyError, CancelledError, RoboSandboxError
from robosandbox.tasks.task import Task
from robosandbox.types import Plan
from robosandbox.workcell.host import Activity
from robosandbox.workcell.orders import BoundOrder, OrderResult, bind_order, says_stop
from robosandbox.workcell.workcell import Workcell

_log = logging.getLogger(__name__)
ValueT = TypeVar("ValueT")


class Control:
    """Has the host carry out what people click, and tells of it.

    Args:
        source: Draws the host's cell.

    Attributes:
        listeners: Called with all news, in the thread where it happens.
        doing: Activity that is under way.
    """

    def __init__(self, source: WorldSource) -> None:
        self.source = source
        self.host = source.host
        self.listeners: list[Callable[[News], None]] = []
        self.doing: Doing = Doing.NOTHING
        self._activity: Activity[Any] | None = None
        self.host.events.subscribe(self.tell)

    @property
    def cell(self) -> Workcell:
        """The workcell."""
        return self.host.cell

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
        """Carry out a prompt, and judge what came of it where it is the task's own; "stop" stops what is under way."""
        if says_stop(prompt):
            self.stop()
            return

        def judged(came: Came) -> BoundOrder | None:
            own = came.result.failure is None and prompt == self.cell.task.prompt and self.cell.judgeable
            return bind_order("judge", {}) if own else None

        self._order(Doing.RUNNING, prompt, "run", {"prompt": prompt}, then=judged)

    def follow(self, plan: Plan) -> None:
        """Carry out a plan as it is."""
        self._order(Doing.RUNNING, ", ".join(map(str, plan.steps)), "follow", {"steps": plan.steps})

    def plan(self, prompt: str, then: Literal["check", "simulate"] | None = None) -> None:
        """Ask the planner, and move nothing.

        Args:
            prompt: The sentence.
            then: What is done with its plan: `check` it, or try it on the twin with `simulate`.
        """

        def tried(came: Came) -> BoundOrder | None:
            plan = came.result.data["plan"]
            return bind_order(then, {"steps": plan}) if then is not None and plan else None

        doing = Doing.TRYING if then == "simulate" else Doing.PLANNING
        self._order(doing, prompt, "plan", {"prompt": prompt}, then=tried)

    def judge(self) -> None:
        """Tell whether the task has succeeded."""
        self._order(Doing.JUDGING, self.cell.task.name, "judge", {})

    def recover(self) -> None:
        """End a fault that has stopped the arm."""
        self._order(Doing.RECOVERING, "recover", "recover", {})

    def back(self) -> None:
        """Go back to before the last thing that changed the world."""
        self._change(
            "step back",
            lambda: self.host.start_over(self.cell.undo),
            lambda what: Went(f"back to before: {what}"),
        )

    def reset(self, seed: int) -> None:
        """Start over with a seed's layout."""
        self._change(
            f"reset to seed {seed}",
            lambda: self.host.start_over(lambda: self.cell.reset(seed)),
            lambda _: Went(f"seed {seed}"),
        )

    def load(self, task: Task | str, robot: str | None) -> None:
        """Load another task, robot or both."""
        what = f"load {task.name if isinstance(task, Task) else task}" + (f" with {robot}" if robot else "")
        self._change(what, lambda: self.host.exchange(task, robot), lambda _: Loaded())

    def changed_elsewhere(self, loaded: bool) -> None:
        """Take note that somebody else has reset the world, or loaded another one, which is taken over when nothing runs."""
        if loaded:
            activity = Activity[None]("what another client has loaded", is_goal=False)
            self._begin(Doing.LOADING, activity, self.source.adopt, lambda _: Loaded(), quiet=True)
        else:
            self.tell(Went("reset by another client"))

    def by_hand(self, what: str, job: Callable[[], None]) -> bool:
        """Move something by hand; return whether it was begun, which it is not while something else is under way."""

        def moved() -> None:
            self.cell.remember(what)
            job()

        return self._begin(Doing.MOVING, Activity[None](what, is_goal=True), moved, lambda _: None, quiet=True)

    def stop(self) -> None:
        """Stop what runs; the arm holds where it is."""
        self.host.stop()

    # Inside.

    def _order(
        self,
        doing: Doing,
        what: str,
        name: str,
        arguments: Mapping[str, Any],
        then: Callable[[Came], BoundOrder | None] = lambda came: None,
    ) -> None:
        """Have an order carried out, and another one that follows from what came of it, as one activity."""

        def work() -> OrderResult:
            self._last = bind_order(name, arguments)
            result = self.host.perform_order(self._last)
            came = Came(self._last, result)
            following = then(came)
            if following is None:
                return result
            self.tell(came)
            self._last = following
            return self.host.perform_order(following)

        self._begin(doing, Activity[OrderResult](what, is_goal=True), work, lambda result: Came(self._last, result))

    def _change(self, what: str, job: Callable[[], ValueT], news: Callable[[ValueT], News]) -> None:
        def work() -> ValueT:
            with self.source.changing():
                return job()

        self._begin(Doing.LOADING, Activity[ValueT](what, is_goal=False), work, news)

    def _begin(
        self,
        doing: Doing,
        activity: Activity[ValueT],
        work: Callable[[], ValueT],
        news: Callable[[ValueT], News | None],
        *,
        quiet: bool = False,
    ) -> bool:
        """Have an activity carried out, and tell what came of it when the arm has come to rest; return whether it was begun."""

        def close(came: ValueT | RoboSandboxError) -> None:
            match came:
                case CancelledError():
                    self.tell(Stopped())
                case RoboSandboxError():
                    self.tell(Complaint(" ".join(str(came).split())))
                case _ if (said := news(came)) is not None:
                    self.tell(said)
                case _:
                    pass

        def end(_: Future[ValueT]) -> None:
            if self._activity is not activity:
                # Another was begun since the host let go of this one.
                return
            self.tell(Idle(self.cell.ways_back))
            self.source.refresh()
            # Last: who waits for it finds everything told.
            self.doing = Doing.NOTHING

        try:
            self.host.claim(activity)
        except BusyError:
            if not quiet:
                self.tell(Complaint(f"{self.doing} now; stop it first"))
            return False
        self.doing, self._activity = doing, activity
        self.tell(Began(doing, activity.what))
        activity.closing = close
        activity.done.add_done_callback(end)
        self.host.begin(activity, work)
        return True
