"""A goal that a sim process runs for this one: followed through its news, looked up where news may be missing."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING

from robosandbox.errors import ConnectionLostError, UnknownGoalError
from robosandbox.evidence import ConnectionEvidence
from robosandbox.types import Intent, SkillResult
from robosandbox.workcell.zenoh.messages import Feedback, Goal, GoalIntent
from robosandbox.workcell.zenoh.transport import check_process

if TYPE_CHECKING:
    from robosandbox.workcell.zenoh.client.robot import RemoteRobot

_CHECK_SECONDS = 2.0
# How long the thread waits at a stretch, seconds; chosen so that Ctrl-C is heard meanwhile.
_SLICE_SECONDS = 0.02


class RemoteGoal:
    """A goal on its way."""

    def __init__(self, robot: RemoteRobot, goal: Goal) -> None:
        self._robot = robot
        self._goal = goal
        self._feedback: deque[Feedback] = deque()
        self._intents: deque[Intent] = deque()
        self._changed = threading.Condition()
        self._lost = False

    @property
    def id(self) -> str:
        """Its UUID."""
        return self._goal.goal_id

    @property
    def skill(self) -> str:
        """Skill that the goal runs."""
        return self._goal.skill

    @property
    def goal(self) -> Goal:
        """Status of the goal, as last heard."""
        return self._goal

    def cancel(self) -> None:
        """Ask the sim to stop it; `wait` then raises CancelledError."""
        self._robot.cancel(self)

    def wait(self, timeout: float | None = None) -> SkillResult:
        """Return the result when the goal has ended.

        A sim that goes away is waited for; what it knows of the goal when it is back decides.

        Args:
            timeout: Seconds on the wall; no limit when left out.

        Raises:
            SkillError: The skill failed, was cancelled, or the sim was restarted while it ran.
            TimeoutError: The goal runs on.
            ServiceUnavailableError: The sim went away and did not come back, or this process was forked since.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        for _ in self.follow():
            if deadline is not None and time.monotonic() > deadline:
                raise TimeoutError(f"{self.skill} still runs after {timeout:g} s")
        return self._goal.outcome()

    def follow(self) -> Iterator[Feedback | None]:
        """Yield feedback as it comes until the goal has ended; None when there has been none for a moment.

        Raises:
            ConnectionLostError: The sim was restarted and does not know the goal.
            ServiceUnavailableError: The sim went away and did not come back.
        """
        checked = time.monotonic()
        while True:
            if not self._goal.status.final:
                # Nobody would bring news.
                check_process()
            # Waiting in slices keeps Ctrl-C alive.
            with self._changed:
                self._changed.wait_for(self._has_news, _SLICE_SECONDS)
                final, lost = self._goal.status.final, self._lost
            while self._feedback:
                yield self._feedback.popleft()
            if final:
                return
            if lost:
                self._robot.wait_until_back()
                self._lost = False
                self._look_up()
            elif time.monotonic() - checked > _CHECK_SECONDS:
                # News may be dropped on a crowded link; the ledger is not.
                checked = time.monotonic()
                self._look_up()
            yield None

    def intents(self) -> Iterator[Intent]:
        """Yield what the skill has said since that it is about to do; nothing where the goal was sent without `intents`."""
        while self._intents:
            yield self._intents.popleft()

    def _has_news(self) -> bool:
        return self._lost or self._goal.status.final or bool(self._feedback) or bool(self._intents)

    def _look_up(self) -> None:
        try:
            self.hear(self._robot.result(self.skill, self.id))
        except UnknownGoalError:
            raise ConnectionLostError(
                f"the sim was restarted while {self.skill} ran and does not know it any more; look what is done",
                evidence=ConnectionEvidence(robot_id=self._robot.id, restarted=True),
            ) from None

    # What the robot tells it, from Zenoh's threads.

    def hear(self, news: Goal | Feedback | GoalIntent) -> None:
        """Take news."""
        with self._changed:
            if isinstance(news, Feedback):
                self._feedback.append(news)
            elif isinstance(news, GoalIntent):
                self._intents.append(news.intent)
            elif not self._goal.status.final:
                self._goal = news
                if news.status.final:
                    self._robot.forget(self)
            self._changed.notify_all()

    def lose(self) -> None:
        """The sim is gone."""
        with self._changed:
            self._lost = True
            self._changed.notify_all()
