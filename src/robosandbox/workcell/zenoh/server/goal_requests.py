"""Requests about goals: accepted or refused at once, cancelled, looked up."""

from __future__ import annotations

from collections.abc import Callable

from robosandbox.errors import ConnectionLostError, ForbiddenError, InternalError, UnknownGoalError
from robosandbox.evidence import ConnectionEvidence
from robosandbox.types import SkillCall
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.orders import ORDERS, BoundOrder, bind_order
from robosandbox.workcell.zenoh.messages import GoalRef, SendGoal
from robosandbox.workcell.zenoh.server.changes import WorldChanges
from robosandbox.workcell.zenoh.server.goals import Ledger
from robosandbox.workcell.zenoh.server.requests import Request
from robosandbox.world.operators import BoundCall, bind


class GoalRequests:
    """Answers `skill/<name>/send_goal`, `cancel_goal` and `get_result`.

    Args:
        ledger: Where goals stand.
        served: Returns what is served now.
        boot_id: The sim process.
        robot_id: In keys.
        changes: What else changes the world: a goal waits for none of it, and is refused meanwhile.
        with_truth: Whether clients may have the world judged.
        begin: Has an accepted goal run.
        expect: Told the liveliness token that a goal is tied to.
    """

    def __init__(
        self,
        ledger: Ledger,
        served: Callable[[], EmbeddedWorkcell],
        *,
        boot_id: str,
        robot_id: str,
        changes: WorldChanges,
        with_truth: bool,
        begin: Callable[[str], None],
        expect: Callable[[str], None],
    ) -> None:
        self._ledger = ledger
        self._served = served
        self._boot_id = boot_id
        self._robot_id = robot_id
        self._changes = changes
        self._with_truth = with_truth
        self._begin = begin
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
            call = bind(SkillCall(skill=name, arguments=message.arguments), self._served().calls)
        try:
            goal, new = self._ledger.admit(message, call, self._changes.doing)
        except OSError as error:
            raise InternalError(
                f"not accepted: the sim cannot write beside its state file ({error.strerror}); make room there"
            ) from None
        request.answer(goal)
        if not new:
            return
        self._begin(goal.goal_id)
        if message.client_id is not None:
            self._expect(message.client_id)

    def stop(self, request: Request) -> None:
        """Have a goal stopped, and answer how far it is."""
        goal_id = self._named(request)
        self.cancel(goal_id)
        request.answer(self._ledger.find(goal_id))

    def result(self, request: Request) -> None:
        """Answer how far a goal is."""
        request.answer(self._ledger.find(self._named(request)))

    def cancel(self, goal_id: str, *, abandoned: bool = False) -> None:
        """Have a goal stopped; `abandoned` because its client is gone."""
        self._ledger.cancel(goal_id, self._served().ctx.cancel, abandoned=abandoned)

    def _named(self, request: Request) -> str:
        """Return the goal that a request is about, which has to be one of the skill in its key."""
        goal_id, name = request.message(GoalRef).goal_id, _skill_of(request)
        goal = self._ledger.find(goal_id)
        if goal.skill != name:
            raise UnknownGoalError(f"goal {goal_id} is a {goal.skill} goal, not {name[:60]!r}")
        return goal_id


def _skill_of(request: Request) -> str:
    return request.key.split("/")[3]
