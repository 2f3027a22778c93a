"""The ledger of goals: how each stands or has ended; each id runs once."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from robosandbox.errors import (
    CancelledError,
    ConnectionLostError,
    Failure,
    InvalidMessageError,
    UnknownGoalError,
)
from robosandbox.evidence import ConnectionEvidence, MessageEvidence
from robosandbox.types import SkillResult
from robosandbox.workcell.host import Activity, WorkcellHost
from robosandbox.workcell.orders import OrderResult
from robosandbox.workcell.zenoh.messages import KEPT_RESULTS, Goal, GoalStatus, SendGoal
from robosandbox.workcell.zenoh.server.journal import Acceptance, KeptGoal


@dataclass(slots=True, eq=False)
class LiveGoal:
    """A goal in the sim process.

    Attributes:
        goal: As clients see it now.
        arguments: As they came.
        activity: What the host carries out; None for a goal of an earlier process.
        phases: How many began.
    """

    goal: Goal
    arguments: Mapping[str, Any]
    activity: Activity[SkillResult | OrderResult] | None = None
    phases: int = 0


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

    def admit(self, request: SendGoal, name: str, host: WorkcellHost) -> tuple[LiveGoal, bool]:
        """Take a goal in, or find it.

        Args:
            request: What was asked.
            name: The skill or order.
            host: Has it among its activities from here on; it does not begin yet.

        Returns:
            The goal as it stands, and whether it is new.

        Raises:
            BusyError: The host does something else and this one would not wait, or too many wait.
            InvalidMessageError: The id was used for something else.
            OSError: It could not be written down, and is not accepted.
        """
        with self._lock:
            known = self._live.get(request.goal_id) or self._ended.get(request.goal_id)
            if known is not None:
                if known.goal.skill != name or dict(known.arguments) != request.arguments:
                    problem = f"{request.goal_id} is a {known.goal.skill} goal already; make a new id"
                    raise InvalidMessageError(problem, evidence=MessageEvidence(field="goal_id", problem=problem))
                return known, False
            activity = Activity[SkillResult | OrderResult](
                name, is_goal=True, goal_id=request.goal_id, owner=request.client_id, timeout=request.timeout
            )
            host.claim(activity, queue=request.queue)
            goal = Goal(goal_id=request.goal_id, boot_id=self._boot_id, skill=name, status=GoalStatus.ACCEPTED)
            number = self._accepted + 1
            try:
                self._keep_acceptance(Acceptance(number=number, goal=goal, arguments=request.arguments))
            except OSError:
                host.drop(activity)
                raise
            self._accepted = number
            entry = self._live[request.goal_id] = LiveGoal(goal, request.arguments, activity)
            return entry, True

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

    def start(self, goal_id: str, time: float) -> Goal:
        """Return a goal that executes from now on."""
        with self._lock:
            entry = self._live[goal_id]
            entry.goal = entry.goal.model_copy(update={"status": GoalStatus.EXECUTING, "began": time})
            return entry.goal

    def ended(self, goal_id: str, time: float, outcome: SkillResult | OrderResult | Failure) -> Goal:
        """Return a goal as it ends, which `finish` then makes known."""
        change: dict[str, Any] = {}
        if isinstance(outcome, OrderResult):
            change["answer"] = outcome.data
        if isinstance(outcome, OrderResult) and outcome.failure is not None:
            outcome = outcome.failure
        if isinstance(outcome, SkillResult):
            change = {"status": GoalStatus.SUCCEEDED, "result": outcome}
        elif isinstance(outcome, OrderResult):
            change["status"] = GoalStatus.SUCCEEDED
        else:
            cancelled = outcome.code is CancelledError.code
            change |= {"status": GoalStatus.CANCELLED if cancelled else GoalStatus.FAILED, "error": outcome}
        return self.find(goal_id).model_copy(update={**change, "ended": time})

    def finish(self, ended: Goal) -> None:
        """Record how a goal ended."""
        with self._lock:
            entry = self._live.pop(ended.goal_id)
            entry.goal, entry.activity = ended, None
            self._keep(entry)

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
