"""Goals over Zenoh: accepted or refused at once, carried out by the host and told about, cancelled, looked up."""

from __future__ import annotations

import functools
from collections.abc import Callable
from concurrent.futures import Future

from robosandbox.errors import (
    CancelledError,
    ConnectionLostError,
    Failure,
    ForbiddenError,
    InternalError,
    InvalidArgumentError,
    RoboSandboxError,
    SkillError,
    UnknownGoalError,
)
from robosandbox.evidence import ConnectionEvidence
from robosandbox.skills import events
from robosandbox.types import SkillCall, SkillResult
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.orders import ORDERS, BoundOrder, OrderResult, bind_order
from robosandbox.workcell.zenoh.messages import Feedback, Goal, GoalIntent, GoalRef, SendGoal
from robosandbox.workcell.zenoh.server.autosave import Autosave
from robosandbox.workcell.zenoh.server.goals import Ledger, LiveGoal
from robosandbox.workcell.zenoh.server.publishing import GoalNews
from robosandbox.workcell.zenoh.server.readings import thinned
from robosandbox.workcell.zenoh.server.requests import Request
from robosandbox.world.operators import BoundCall, bind


class GoalRequests:
    """Answers `skill/<name>/send_goal`, `cancel_goal` and `get_result`.

    Args:
        host: Carries goals out.
        ledger: Where they stand.
        news: Where they are told about.
        autosave: Keeps accepted goals, and the world with each that ends, before anybody hears of it.
        boot_id: The sim process.
        robot_id: In keys.
        with_truth: Whether clients may have the world judged.
        expect: Told the liveliness token that a goal is tied to.
    """

    def __init__(
        self,
        host: WorkcellHost,
        ledger: Ledger,
        news: GoalNews,
        autosave: Autosave,
        *,
        boot_id: str,
        robot_id: str,
        with_truth: bool,
        expect: Callable[[str], None],
    ) -> None:
        self._host = host
        self._ledger = ledger
        self._news = news
        self._autosave = autosave
        self._boot_id = boot_id
        self._robot_id = robot_id
        self._with_truth = with_truth
        self._expect = expect

    def send(self, request: Request) -> None:
        """Accept a goal, or refuse it."""
        message = request.message(SendGoal)
        if message.boot_id not in (None, self._boot_id):
            raise ConnectionLostError(
                "the sim was restarted since the plan was made; look again and plan anew",
                evidence=ConnectionEvidence(robot_id=self._robot_id, restarted=True),
            )
        name = _skill_of(request)
        call: BoundCall | BoundOrder
        if name == "judge" and not self._with_truth:
            raise ForbiddenError("judge: this sim was started with --no-ground-truth, so that nothing can be judged")
        if name in ORDERS:
            call = bind_order(name, message.arguments)
        else:
            call = bind(SkillCall(skill=name, arguments=message.arguments), self._host.cell.calls)
        try:
            entry, new = self._ledger.admit(message, call.name, self._host)
        except OSError as error:
            raise InternalError(
                f"not accepted: the sim cannot write beside its state file ({error.strerror}); make room there"
            ) from None
        request.answer(entry.goal)
        if not new:
            return
        # It moves nothing before a power cut would leave it known.
        self._autosave.when_flushed(lambda: self._begin(entry, call, message))
        if message.client_id is not None:
            self._expect(message.client_id)

    def stop(self, request: Request) -> None:
        """Have a goal stopped, and answer how far it is."""
        entry = self._ledger.entry(self._named(request))
        if entry.activity is not None:
            self._host.stop(entry.activity)
        request.answer(entry.goal)

    def result(self, request: Request) -> None:
        """Answer how far a goal is."""
        request.answer(self._ledger.find(self._named(request)))

    # In the world's thread.

    def _begin(self, entry: LiveGoal, call: BoundCall | BoundOrder, message: SendGoal) -> None:
        """Have a goal carried out when those before it have ended."""
        activity = entry.activity
        assert activity is not None, "a goal of an earlier process is not run again"
        ends: list[Goal] = []

        def close(came: SkillResult | OrderResult | RoboSandboxError) -> None:
            outcome = self._outcome(came, abandoned=activity.abandoned)
            ends.append(self._ledger.ended(entry.goal.goal_id, self._now, outcome))
            self._autosave.save(ends[0])

        def tell(_: Future[SkillResult | OrderResult]) -> None:
            self._ledger.finish(ends[0])
            self._news.status(ends[0])

        activity.closing = close
        activity.done.add_done_callback(tell)
        self._host.begin(activity, lambda: self._carry_out(entry, call, message))

    def _carry_out(self, entry: LiveGoal, call: BoundCall | BoundOrder, message: SendGoal) -> SkillResult | OrderResult:
        self._news.status(self._ledger.start(entry.goal.goal_id, self._now))
        leave = self._host.events.subscribe(functools.partial(self._tell, entry, self._now, message.intents))
        try:
            return self._host.perform(call, confirmed=message.confirmed)
        finally:
            leave()

    def _tell(self, entry: LiveGoal, began: float, with_intents: bool, event: object) -> None:
        goal, now = entry.goal, self._now
        match event:
            case events.PhaseEntered(_, phase):
                entry.phases += 1
                self._news.feedback(
                    Feedback(
                        goal_id=goal.goal_id,
                        skill=goal.skill,
                        phase=phase,
                        number=entry.phases,
                        time=now,
                        elapsed=now - began,
                    )
                )
            case events.Intended(_, intent) if with_intents:
                self._news.intent(GoalIntent(goal_id=goal.goal_id, intent=thinned(intent)))
            case _:
                pass

    def _outcome(
        self, came: SkillResult | OrderResult | RoboSandboxError, *, abandoned: bool
    ) -> SkillResult | OrderResult | Failure:
        match came:
            case CancelledError() if abandoned:
                # Nobody has cancelled: this is read by a client that lost its connection and came back.
                return ConnectionLostError(
                    "the connection to the client was lost and the goal stopped; look what is done and send what is left",
                    phase=came.phase,
                    evidence=ConnectionEvidence(robot_id=self._robot_id, restarted=False),
                ).failure
            case SkillError():
                return came.failure
            case RoboSandboxError():
                return InvalidArgumentError(str(came)).failure
            case _:
                return came

    @property
    def _now(self) -> float:
        return self._host.embedded.driver.time

    def _named(self, request: Request) -> str:
        """Return the goal that a request is about, which has to be one of the skill in its key."""
        goal_id, name = request.message(GoalRef).goal_id, _skill_of(request)
        goal = self._ledger.find(goal_id)
        if goal.skill != name:
            raise UnknownGoalError(f"goal {goal_id} is a {goal.skill} goal, not {name[:60]!r}")
        return goal_id


def _skill_of(request: Request) -> str:
    return request.key.split("/")[3]
