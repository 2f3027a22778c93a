"""Courses of a prompt: a planner's plan until a failure, or a director that decides call by call.

The agent's loop asks a `Course` again and again, carries out what it answers, and reports what came of it. A planner that has
nothing but `plan` is asked at the beginning and after each failure; one with `begin` as well, a `Director`, is told of successes
too, and says itself when the prompt is done.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, runtime_checkable

from robosandbox.agent.episode import Episode, Listener, Step
from robosandbox.agent.goal import GoalContext
from robosandbox.agent.protocols import Attempt, Planner
from robosandbox.types import ObservedScene, Plan, Refusal
from robosandbox.values import frozen
from robosandbox.world.operators import Operator


@frozen(kw_only=True)
class PromptDone:
    """Answer of a director that has nothing left to do.

    Attributes:
        summary: What it says was done; a claim, unlike the steps.
        answer: What the person is told who asked for it.
    """

    summary: str
    answer: str = ""


@frozen(kw_only=True)
class Report:
    """Outcome of a plan.

    Attributes:
        steps: The calls that ended in their post-conditions, with the results.
        failure: How it ended early; None where every call succeeded.
    """

    steps: tuple[Step, ...]
    failure: Attempt | None


@frozen(kw_only=True)
class Desk:
    """Services for a director besides the calls that the agent carries out for it.

    Attributes:
        ctx: The world: it can be looked at, and tried out on its twin where it has one.
        skills: What may be called, by name.
        ask: Puts a question to the person and returns the answer; None where nobody is there.
        emit: Tells the agent's listeners of an event.
    """

    ctx: GoalContext
    skills: Mapping[str, Operator]
    ask: Callable[[str], str] | None
    emit: Listener


class Course(Protocol):
    """Course of action for one prompt, plan after plan."""

    @property
    def goes_on(self) -> bool:
        """True where it is asked again after a plan that succeeded."""
        ...

    def next(self, scene: ObservedScene, report: Report | None) -> Plan | Refusal | PromptDone:
        """Return what to carry out now.

        Args:
            scene: What perception sees.
            report: What came of the plan before; None the first time.

        Raises:
            PlannerError: There is no answer.
        """
        ...


@runtime_checkable
class Director(Protocol):
    """A planner that can decide step by step."""

    def begin(self, prompt: str, desk: Desk) -> Course:
        """Return the course for a prompt."""
        ...


@runtime_checkable
class Continuing(Protocol):
    """A planner whose plans may leave for later what only time can tell: `Plan.then`."""

    def go_on(self, scene: ObservedScene) -> Plan | Refusal:
        """Return what is done now that the steps of the last plan are; a plan of no steps where nothing is."""
        ...


@runtime_checkable
class Remembering(Protocol):
    """A planner that is told what came of each prompt."""

    def remember(self, episode: Episode) -> None:
        """Take note of an episode that is over."""
        ...


@runtime_checkable
class Conversing(Protocol):
    """A planner for which a prompt may refer to those before it."""

    def begin_anew(self) -> None:
        """Forget what was said: the world has started over."""
        ...


class PlannedCourse:
    """One plan, another one after each failure, and what it leaves for later.

    Args:
        planner: Who plans.
        prompt: What was said.
    """

    def __init__(self, planner: Planner, prompt: str) -> None:
        self._planner = planner
        self._prompt = prompt
        self._attempts: tuple[Attempt, ...] = ()
        self._then = ""

    @property
    def goes_on(self) -> bool:
        """True where the plan leaves something for when its steps are done."""
        return bool(self._then)

    def next(self, scene: ObservedScene, report: Report | None) -> Plan | Refusal | PromptDone:
        """Return the planner's answer, now that this has failed, or that time has told what it left open."""
        answer: Plan | Refusal
        if report is not None and report.failure is not None:
            self._attempts = (*self._attempts, report.failure)
        if report is not None and report.failure is None and isinstance(self._planner, Continuing):
            answer = self._planner.go_on(scene)
        else:
            answer = self._planner.plan(self._prompt, scene, self._attempts)
        later = bool(self._then)
        self._then = answer.then if isinstance(answer, Plan) and isinstance(self._planner, Continuing) else ""
        if later and isinstance(answer, Plan) and not answer.steps:
            return PromptDone(summary=answer.answer, answer=answer.answer)
        return answer


class GivenPlan:
    """A planner that has one plan, whatever is asked, and after a failure what is left of it and of the ways around that."""

    def __init__(self, plan: Plan, skills: Sequence[Operator] = ()) -> None:
        self._plan, self._skills = plan, skills

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal:
        """Return the plan, or what is left of it."""
        del prompt
        if not history:
            return self._plan
        # What goes well needs no search.
        from robosandbox.world.solve import solve

        return solve((history[-1].failed, *history[-1].remaining), scene, self._skills, tried=history)


def begin(planner: Planner, prompt: str, desk: Desk) -> Course:
    """Return a planner's course for a prompt."""
    return planner.begin(prompt, desk) if isinstance(planner, Director) else PlannedCourse(planner, prompt)
