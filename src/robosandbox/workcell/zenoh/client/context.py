"""A remote robot as an agent sees it: a world to look at and skills to call."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

from robosandbox.agent.goal import GoalContext
from robosandbox.errors import CancelledError, GoalTimeoutError
from robosandbox.evidence import TimeoutEvidence
from robosandbox.skills.base import Skill
from robosandbox.skills.catalogue import load_skills
from robosandbox.skills.manual import MANUAL
from robosandbox.skills.words import Words
from robosandbox.types import ObservedScene, SkillResult
from robosandbox.workcell.zenoh.messages import SkillInfo
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract
from robosandbox.world.operators import BoundCall

if TYPE_CHECKING:
    from robosandbox.workcell.zenoh.client.robot import RemoteRobot


class RemoteContext(GoalContext):
    """Context of an agent whose robot is remote; the sim process has the rest, and keeps its limits."""

    def __init__(self, robot: RemoteRobot) -> None:
        super().__init__()
        self._robot = robot
        self._boot_id: str | None = None
        self._left: float | None = None
        self._timeout: float | None = None

    def look(self) -> ObservedScene:
        """Return what perception sees now; waits for a sim that is away."""
        seen = self._robot.look()
        self._boot_id = seen.boot_id
        return seen.scene

    def simulate(self, calls: Sequence[BoundCall], *, tick: Callable[[], None] | None = None) -> dict[str, Any]:
        """Return what would come of calls on the sim's twin.

        Raises:
            SkillError: The sim is busy, or refuses.
        """
        del tick
        steps = [call.call.model_dump(mode="json") for call in calls]
        return self._robot.order("simulate", stop=self._cancelled, steps=steps)

    def _allow(self, timeout: float | None) -> None:
        self._timeout = self._left = timeout

    def _perform(self, call: BoundCall) -> SkillResult:
        if self._cancelled.is_set():
            self._cancelled.clear()
            raise CancelledError("cancelled; the arm holds where it was")
        if self._left is not None and self._left <= 0.0:
            timeout = self._timeout or 0.0
            raise GoalTimeoutError(
                f"not done after {timeout:g} s; allow more time or ask for less at once",
                evidence=TimeoutEvidence(deadline=timeout, elapsed=timeout - self._left),
            )
        goal = self._robot.send(
            call.skill.name,
            call.arguments,
            timeout=self._left,
            boot_id=self._boot_id,
            intents=bool(len(self.events)),
            confirmed=self.confirmed,
        )
        asked = False
        try:
            for feedback in goal.follow():
                if feedback is not None:
                    self.entered(feedback.phase)
                for intent in goal.intents():
                    self.announce(intent)
                if self._cancelled.is_set() and not asked:
                    asked = True
                    goal.cancel()
            return goal.goal.outcome()
        finally:
            self._robot.forget(goal)
            if self._left is not None and goal.goal.began is not None and goal.goal.ended is not None:
                self._left -= goal.goal.ended - goal.goal.began


class RemoteSkill:
    """A skill of a remote robot, with the schema that the robot gave."""

    def __init__(self, info: SkillInfo) -> None:
        self._info = info

    @property
    def name(self) -> str:
        """Its name."""
        return self._info.name

    @property
    def description(self) -> str:
        """Description of the skill in a line."""
        return self._info.description

    @property
    def schema(self) -> Mapping[str, Any]:
        """JSON schema of the arguments."""
        return self._info.arguments

    @property
    def words(self) -> Words | tuple[Words, ...] | None:
        """Words with which people ask for it, where this machine has the same skill."""
        return None if self._installed is None else self._installed.words

    @property
    def translations(self) -> Mapping[str, str]:
        """The same in languages that are data."""
        return {} if self._installed is None else self._installed.translations

    def check(self, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the arguments, checked where this machine has the same skill; the sim checks them before anything moves."""
        return arguments if self._installed is None else self._installed.check(arguments)

    def contract(self, *args: Any, **arguments: Any) -> Contract:
        """Return the contract of a call, where this machine has the same skill; else one that promises nothing."""
        return Contract() if self._installed is None else self._installed.contract(*args, **arguments)

    def alternatives(self, failed: FailedCall, *args: Any, **arguments: Any) -> Iterable[Alternative]:
        """Return ways around a failed call, where this machine has the same skill."""
        return () if self._installed is None else self._installed.alternatives(failed, *args, **arguments)

    @cached_property
    def _installed(self) -> Skill | None:
        own = (*load_skills(), *MANUAL)
        return next((skill for skill in own if skill.name == self.name and skill.schema == self.schema), None)
