"""The ledger of goals: which run, wait or have ended; each id runs once."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from robosandbox.errors import (
    BusyError,
    CancelledError,
    ConnectionLostError,
    Failure,
    InvalidMessageError,
    UnknownGoalError,
)
from robosandbox.evidence import BusyEvidence, ConnectionEvidence, MessageEvidence
from robosandbox.types import SkillResult
from robosandbox.workcell.orders import Answer, BoundOrder
from robosandbox.workcell.zenoh.messages import KEPT_RESULTS, Goal, GoalStatus, SendGoal
from robosandbox.workcell.zenoh.server.journal import Acceptance, KeptGoal
from robosandbox.world.operators import BoundCall

# Goals that may wait behind the running one; chosen as longer than any plan that a person follows.
MAX_WAITING = 16


@dataclass(slots=True, eq=False)
class LiveGoal:
    """A goal in the sim process.

    Attributes:
        goal: As clients see it now.
        arguments: As they came.
        call: The same, bound; None for one of an earlier process.
        timeout: Simulated seconds; None for no limit.
        client_id: Whose loss cancels it.
        cancelled: Whether somebody asked for its end.
        abandoned: Whether that was because its client was lost.
        phases: How many began.
        intents: Whether its client wants to hear what it is about to do.
    """

    goal: Goal
    arguments: Mapping[str, Any]
    call: BoundCall | BoundOrder | None = None
    timeout: float | None = None
    client_id: str | None = None
    cancelled: bool = False
    abandoned: bool = False
    phases: int = 0
    intents: bool = False


class Ledger:
    """Goals by id, safe to use from every thread; the last `KEPT_RESULTS` ended ones stay readable.

    Args:
        boot_id: Of this process.
        keep: Writes an accepted goal down before anybody can see it; raises OSError where it cannot.
    """

    def __init__(self, boot_id: str, keep: Callable[[Acceptance], None]) -> None:
        self._boot_id = boot_id
        self._keep_acceptance = keep
        self._accepted = 0
        self._lock = threading.Lock()
        self._live: OrderedDict[str, LiveGoal] = OrderedDict()
        self._ended: OrderedDict[str, LiveGoal] = OrderedDict()

    def admit(self, request: SendGoal, call: BoundCall | BoundOrder, doing: str | None) -> tuple[Goal, bool]:
        """Take a goal in, or find it.

        Args:
            request: What was asked.
            call: The same, bound.
            doing: What else than goals occupies the robot.

        Returns:
            The goal as it stands, and whether it is new.

        Raises:
            BusyError: Another goal runs and this one would not wait, or too many wait.
            InvalidMessageError: The id was used for something else.
            OSError: It could not be written down, and is not accepted.
        """
        with self._lock:
            known = self._live.get(request.goal_id) or self._ended.get(request.goal_id)
            if known is not None:
                if known.goal.skill != call.name or dict(known.arguments) != request.arguments:
                    problem = f"{request.goal_id} is a {known.goal.skill} goal already; make a new id"
                    raise InvalidMessageError(problem, evidence=MessageEvidence(field="goal_id", problem=problem))
                return known.goal, False
            self._refuse_if_busy(request, doing)
            goal = Goal(goal_id=request.goal_id, boot_id=self._boot_id, skill=call.name, status=GoalStatus.ACCEPTED)
            number = self._accepted + 1
            self._keep_acceptance(Acceptance(number=number, goal=goal, arguments=request.arguments))
            self._accepted = number
            self._live[request.goal_id] = LiveGoal(
                goal, request.arguments, call, request.timeout, request.client_id, intents=request.intents
            )
            return goal, True

    def _refuse_if_busy(self, request: SendGoal, doing: str | None) -> None:
        first = next(iter(self._live.values()), None)
        waiting = max(0, len(self._live) - 1)
        if first is None and doing is None:
            return
        if request.queue and len(self._live) <= MAX_WAITING:
            return
        name = first.goal.skill if first else str(doing)
        what = "cancel it, wait for it, or send with queue"
        if request.queue:
            what = f"{waiting} goals wait already"
        elif first and first.cancelled:
            what = "it was cancelled and is being stopped; wait for its end (`wait`, or its status), or send with queue"
        raise BusyError(
            f"the robot is busy with {name}; {what}",
            evidence=BusyEvidence(doing=name, goal_id=first.goal.goal_id if first else None, waiting=waiting),
        )

    def find(self, goal_id: str) -> Goal:
        """Return a goal.

        Raises:
            UnknownGoalError: There is none, or it ended too long ago.
        """
        return self.entry(goal_id).goal

    def entry(self, goal_id: str) -> LiveGoal:
        """Return a goal with what the sim knows of it.

        Raises:
            UnknownGoalError: There is none, or it ended too long ago.
        """
        with self._lock:
            found = self._live.get(goal_id) or self._ended.get(goal_id)
        if found is None:
            raise UnknownGoalError(f"no goal {goal_id}; the last {KEPT_RESULTS} ended ones are kept")
        return found

    def start(self, goal_id: str, time: float) -> bool:
        """Mark a goal as executing; False when it was cancelled while it waited."""
        with self._lock:
            entry = self._live[goal_id]
            if entry.cancelled:
                return False
            entry.goal = entry.goal.model_copy(update={"status": GoalStatus.EXECUTING, "began": time})
            return True

    def ended(self, goal_id: str, time: float, outcome: SkillResult | Answer | Failure) -> Goal:
        """Return a goal as it ends, which `finish` then makes known."""
        change: dict[str, Any] = {}
        if isinstance(outcome, Answer):
            change["answer"] = outcome.data
        if isinstance(outcome, Answer) and outcome.failure is not None:
            outcome = outcome.failure
        if isinstance(outcome, SkillResult):
            change = {"status": GoalStatus.SUCCEEDED, "result": outcome}
        elif isinstance(outcome, Answer):
            change["status"] = GoalStatus.SUCCEEDED
        else:
            cancelled = outcome.code is CancelledError.code
            change |= {"status": GoalStatus.CANCELLED if cancelled else GoalStatus.FAILED, "error": outcome}
        return self.find(goal_id).model_copy(update={**change, "ended": time})

    def finish(self, ended: Goal) -> None:
        """Record how a goal ended."""
        with self._lock:
            entry = self._live.pop(ended.goal_id)
            entry.goal = ended
            self._keep(entry)

    def cancel(self, goal_id: str, stop: Callable[[], None], *, abandoned: bool = False) -> None:
        """Ask for a goal's end.

        Args:
            goal_id: Which.
            stop: Called if it executes, while no other goal can take its place.
            abandoned: Whether its client was lost.
        """
        entry = self.entry(goal_id)
        with self._lock:
            if entry.goal.status.final:
                return
            entry.cancelled = True
            entry.abandoned = entry.abandoned or abandoned
            if entry.goal.status is GoalStatus.EXECUTING:
                stop()

    def of_client(self, client_id: str) -> tuple[str, ...]:
        """Return the ids of a client's goals that have not ended."""
        with self._lock:
            return tuple(name for name, entry in self._live.items() if entry.client_id == client_id)

    def live(self) -> tuple[str, ...]:
        """Return the ids of all goals that have not ended, in the order in which they run."""
        with self._lock:
            return tuple(self._live)

    def doing(self) -> str | None:
        """Return the skill of the goal that runs or is next."""
        with self._lock:
            return next((entry.goal.skill for entry in self._live.values()), None)

    def is_stopping(self) -> bool:
        """Return whether the goal that runs or is next was cancelled and has not ended."""
        with self._lock:
            return next((entry.cancelled for entry in self._live.values()), False)

    # Across restarts.

    def dump(self, ended: Goal | None = None) -> tuple[tuple[KeptGoal, ...], int]:
        """Return all goals, one of them as it ends, and the number of the last that was accepted."""
        with self._lock:
            entries = [*self._ended.values(), *self._live.values()]
            goals = [
                (entry, ended if ended and ended.goal_id == entry.goal.goal_id else entry.goal) for entry in entries
            ]
            kept = tuple(KeptGoal(goal=goal, arguments=dict(entry.arguments)) for entry, goal in goals)
            return kept, self._accepted

    def adopt(self, kept: Iterable[KeptGoal], robot_id: str) -> None:
        """Take over the goals of the process before; what it left unfinished has failed."""
        lost = ConnectionLostError(
            "the sim stopped while this goal was open; look what is done and send what is left",
            evidence=ConnectionEvidence(robot_id=robot_id, restarted=True),
        ).failure
        for item in kept:
            goal = item.goal
            if not goal.status.final:
                goal = goal.model_copy(update={"status": GoalStatus.FAILED, "error": lost})
            with self._lock:
                self._keep(LiveGoal(goal, item.arguments))

    def _keep(self, entry: LiveGoal) -> None:
        self._ended[entry.goal.goal_id] = entry
        while len(self._ended) > KEPT_RESULTS:
            self._ended.popitem(last=False)
