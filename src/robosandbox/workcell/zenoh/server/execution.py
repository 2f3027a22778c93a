"""Goals run to their end in the world's thread, told about and saved on the way."""

from __future__ import annotations

import logging
from collections.abc import Callable

from robosandbox.driver import come_to_rest
from robosandbox.errors import CancelledError, ConnectionLostError, Failure, InternalError, SkillError
from robosandbox.evidence import ConnectionEvidence
from robosandbox.skills import events
from robosandbox.skills.events import PhaseEntered, SkillEvent
from robosandbox.types import SkillResult
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.orders import Answer, BoundOrder
from robosandbox.workcell.zenoh.messages import Feedback, Goal, Intended
from robosandbox.workcell.zenoh.server.goals import Ledger, LiveGoal
from robosandbox.workcell.zenoh.server.publishing import GoalNews
from robosandbox.workcell.zenoh.server.snapshots import thinned
from robosandbox.world.operators import BoundCall

_log = logging.getLogger(__name__)
# How often coming to rest is begun anew; chosen because a cancel or a limit may end each trial.
_REST_TRIALS = 5


class Executor:
    """Runs the ledger's goals; only in the world's thread.

    Args:
        ledger: Where they stand.
        news: Where they are told about.
        robot_id: For errors.
        save: Saves the world with a goal that ends, before anybody hears of it.

    Attributes:
        running: The goal that runs.
    """

    def __init__(self, ledger: Ledger, news: GoalNews, robot_id: str, save: Callable[[Goal], None]) -> None:
        self.running: LiveGoal | None = None
        self._ledger = ledger
        self._news = news
        self._robot_id = robot_id
        self._save = save

    def execute(self, goal_id: str, served: EmbeddedWorkcell) -> None:
        """Run a goal to its end."""
        entry = self._ledger.entry(goal_id)
        outcome: SkillResult | Answer | Failure
        self.running = entry
        try:
            with served.ctx.goal(entry.timeout):
                # From here on a cancel reaches the context; one that came before is in the ledger.
                if not self._ledger.start(goal_id, served.driver.time):
                    raise CancelledError("cancelled before it began")
                self._news.status(entry.goal)
                assert entry.call is not None, "a goal of an earlier process is not run again"
                outcome = self._call(entry, entry.call, served)
        except CancelledError as error:
            outcome = self._abandoned(error) if entry.abandoned else error.failure
        except SkillError as error:
            outcome = error.failure
        except Exception as fault:
            outcome = InternalError.log(entry.goal.skill, fault, _log).failure
        if isinstance(outcome, Failure) or (isinstance(outcome, Answer) and outcome.failure is not None):
            _come_to_rest(served)
        self.running = None
        ended = self._ledger.ended(goal_id, served.driver.time, outcome)
        self._save(ended)
        self._ledger.finish(ended)
        self._news.status(ended)

    def _abandoned(self, error: CancelledError) -> Failure:
        """Return what a client reads that lost its connection and came back: nobody has cancelled."""
        return ConnectionLostError(
            "the connection to the client was lost and the goal stopped; look what is done and send what is left",
            phase=error.phase,
            evidence=ConnectionEvidence(robot_id=self._robot_id, restarted=False),
        ).failure

    def _call(self, entry: LiveGoal, call: BoundCall | BoundOrder, served: EmbeddedWorkcell) -> SkillResult | Answer:
        began, goal = served.driver.time, entry.goal

        def tell(event: SkillEvent) -> None:
            match event:
                case PhaseEntered(_, phase):
                    entry.phases += 1
                    now = served.driver.time
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
                case events.Intended(_, intent) if entry.intents:
                    self._news.intent(Intended(goal_id=goal.goal_id, intent=thinned(intent)))
                case _:
                    pass

        leave = served.ctx.events.subscribe(tell)
        try:
            return call.carry_out(served) if isinstance(call, BoundOrder) else served.ctx.perform(call)
        finally:
            leave()


def _come_to_rest(served: EmbeddedWorkcell) -> None:
    for _ in range(_REST_TRIALS):
        try:
            # A new goal of the context, in which no deadline and no earlier cancel counts.
            with served.ctx.goal():
                come_to_rest(served.driver)
            return
        except SkillError as error:
            # Another cancel, or a limit that the braking arm still passes.
            _log.debug("on the way to rest: %s", error)
