"""The agent: perceive, plan, execute, and after a failure look again and replan."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Generic, TypeVar

from robosandbox.agent.course import Course, Desk, Finished, GivenPlan, Remembering, Report, begin
from robosandbox.agent.episode import (
    AgentEvent,
    Ended,
    Episode,
    FailedAttempt,
    FinalReason,
    Intended,
    Listener,
    PhaseEntered,
    Planned,
    Replanning,
    SkillEnded,
    SkillFailed,
    SkillStarted,
    Started,
    Step,
)
from robosandbox.agent.goal import GoalContext
from robosandbox.agent.goal_planner import GoalPlanner, is_goal
from robosandbox.agent.overheard import overheard
from robosandbox.agent.progress import Progress, summary
from robosandbox.agent.usage import metered
from robosandbox.errors import (
    CancelledError,
    GoalTimeoutError,
    InputError,
    InternalError,
    InvalidArgumentError,
    PlannerCancelledError,
    PlannerError,
    PlannerUnavailableError,
    RoboSandboxError,
    SkillError,
)
from robosandbox.protocols import Planner, Skill
from robosandbox.types import (
    MAX_PROMPT_LENGTH,
    Intent,
    ObservedScene,
    Plan,
    Refusal,
    RefusalCode,
    SkillCall,
    SkillResult,
)
from robosandbox.validation import did_you_mean
from robosandbox.world.contracts import Contract, contract_of
from robosandbox.world.monitor import Monitor
from robosandbox.world.verifier import verify

_log = logging.getLogger(__name__)

_FINAL_ERRORS: dict[type[SkillError], FinalReason] = {
    CancelledError: FinalReason.CANCELLED,
    GoalTimeoutError: FinalReason.TIMED_OUT,
    InternalError: FinalReason.INTERNAL_ERROR,
}

WorldT = TypeVar("WorldT", bound=GoalContext)

_PLANNER_REASONS = {
    PlannerUnavailableError: FinalReason.PLANNER_UNAVAILABLE,
    PlannerCancelledError: FinalReason.CANCELLED,
}


class Agent(Generic[WorldT]):
    """Carries out prompts, in a world of this process or in a remote one.

    Args:
        ctx: The world: it is looked at, skills are called with it, and its phases are listened to.
        skills: What the robot can do.
        planner: From a sentence to skill calls.
        max_replans: How often a failure may be answered with a new plan.

    Attributes:
        listeners: Called with each event, in the thread of `run`.
        permits: Called with each call before anything moves for it; one that raises a SkillError stops it.
        approve: Asked about each plan before the first of its calls; None approves all.
        ask: Puts a question of a planner to the person and returns the answer; None where nobody is there to answer.
        streams: Whether listeners are told what a model writes while it writes.
        thinks: Whether the planner is being asked.
        left: Set by whoever interrupts `run`, before a KeyboardInterrupt: the planner is not waited for any longer.
    """

    def __init__(self, ctx: WorldT, skills: Sequence[Skill[WorldT]], planner: Planner, max_replans: int = 3) -> None:
        if max_replans < 0:
            raise ValueError(f"max_replans is {max_replans}; it takes 0 or more")
        self.ctx = ctx
        self.skills: dict[str, Skill[WorldT]] = {skill.name: skill for skill in skills}
        if len(self.skills) != len(skills):
            raise ValueError(f"two skills share a name: {', '.join(sorted(skill.name for skill in skills))}")
        ctx.skills = self.skills
        self.planner = planner
        self.max_replans = max_replans
        self.listeners: list[Listener] = []
        self.permits: list[Callable[[SkillCall], None]] = []
        self.approve: Callable[[Plan], bool] | None = None
        self.ask: Callable[[str], str] | None = None
        self.streams: bool = False
        self.thinks: bool = False
        self.left: bool = False

    def plan(self, prompt: str) -> Plan | Refusal:
        """Return what the planner makes of the prompt and the scene; nothing moves.

        Raises:
            InputError: The prompt is too long.
            PlannerError: The planner has no answer.
        """
        check_prompt(prompt)
        return self.answer(prompt, self.ctx.look())

    def answer(self, prompt: str, scene: ObservedScene) -> Plan | Refusal:
        """Return the planner's answer for a scene, or a refusal where its plan has a step that cannot be done.

        Raises:
            PlannerError: The planner has no answer.
        """
        with overheard(self._emit if self.streams else None):
            answer = self._planner_for(prompt).plan(prompt, scene, ())
        return self._refused_if_hopeless(answer, scene)

    def run(self, prompt: str) -> Episode:
        """Carry out a prompt.

        Returns:
            What came of it; failures of skills and of the planner are in there and not raised.

        Raises:
            InputError: The prompt is too long.
        """
        check_prompt(prompt)
        return self._run(prompt, self._planner_for(prompt), self.max_replans)

    def follow(self, plan: Plan) -> Episode:
        """Carry out a plan as it is; a failure ends it.

        Returns:
            What came of it; its prompt is the plan in words.
        """
        return self._run(", ".join(map(str, plan.steps)), GivenPlan(plan), 0)

    def _run(self, prompt: str, planner: Planner, max_replans: int) -> Episode:
        told = Progress()
        self.listeners.append(told.hear)
        try:
            with metered() as usage, overheard(self._emit if self.streams else None):
                reason, detail = self._carry_out(prompt, planner, told, max_replans)
        finally:
            self.listeners.remove(told.hear)
        episode = told.ended(prompt, reason, detail, usage)
        if isinstance(planner, Remembering):
            planner.remember(episode)
        self._emit(Ended(episode))
        return episode

    def _carry_out(self, prompt: str, planner: Planner, told: Progress, max_replans: int) -> tuple[FinalReason, str]:
        """Carry out what the planner's course answers until it ends; return why it ended, also as a sentence."""
        self._emit(Started(prompt))
        course = begin(planner, prompt, Desk(ctx=self.ctx, skills=self.skills, ask=self.ask, emit=self._emit))
        monitor, report = Monitor(), None
        while True:
            scene = self.ctx.look()
            if report is None:
                monitor.begin(scene)
            try:
                answer = self._next(course, scene, report)
            except PlannerError as error:
                return _reason_of(error), str(error)
            answer = self._refused_if_hopeless(answer, scene) if isinstance(answer, Plan) else answer
            if isinstance(answer, Refusal):
                told.refusal = answer
                return FinalReason.GAVE_UP if report else FinalReason.REFUSED, answer.message
            report = self._reported(answer, course, told, monitor, report)
            if report is None:
                return FinalReason.DECLINED, "the plan was not confirmed; nothing was moved for it"
            failure = report.failure
            if failure is None:
                if isinstance(answer, Finished) or not course.goes_on:
                    answered = answer.answer if isinstance(answer, Plan) else ""
                    return FinalReason.PLAN_COMPLETE, answered or summary(told.steps)
                continue
            final = self._final(failure, told, max_replans)
            if final is not None:
                return final, f"{failure.failed}: {failure.error.message}"

    def _final(self, failure: FailedAttempt, told: Progress, max_replans: int) -> FinalReason | None:
        """Take down a failure; return why it is the last, or None where the course is asked again."""
        told.attempts.append(failure)
        final = _FINAL_ERRORS.get(type(failure.error))
        if final is not None or told.replans == max_replans:
            return final or FinalReason.REPLANS_EXHAUSTED
        told.replans += 1
        self._emit(Replanning(told.replans, failure.error.record()))
        return None

    def _reported(
        self, answer: Plan | Finished, course: Course, told: Progress, monitor: Monitor, last: Report | None
    ) -> Report | None:
        """Carry out a plan, or look at what is said to be finished; None where the plan was not confirmed."""
        if isinstance(answer, Finished):
            told.claim = answer.summary
            return Report(steps=(), failure=self._undone(monitor, at_the_end=True))
        before = told.plan
        told.plan = answer
        if before is not None and (course.goes_on or before.then):
            told.plan = Plan(
                steps=(*(step.call for step in told.steps), *answer.steps), then=answer.then, note=before.note
            )
        self._emit(Planned(answer, told.replans))
        if answer.steps and self.approve is not None and not self.approve(answer):
            return None
        begun = len(told.steps)
        # Who decides call by call has asked for each of them.
        failed = None if last is None or course.goes_on else last.failure
        asked = answer.steps if failed is None else (*failed.completed, failed.failed, *failed.remaining)
        failure = self._execute(answer, told.steps, monitor, asked, ends=not course.goes_on)
        return Report(steps=tuple(told.steps[begun:]), failure=failure)

    def _next(self, course: Course, scene: ObservedScene, report: Report | None) -> Plan | Refusal | Finished:
        """Return what the course answers; a person who does not want to wait for it may leave it."""
        if self.left:
            raise PlannerCancelledError("cancelled before the planner was asked")
        self.thinks = True
        try:
            return course.next(scene, report)
        except KeyboardInterrupt:
            if not self.left:
                raise
            raise PlannerCancelledError("cancelled while planning; the arm holds where it was") from None
        finally:
            self.thinks = False

    def _planner_for(self, prompt: str) -> Planner:
        """Return who plans for a prompt: the search over contracts where it lists relations, else the planner."""
        return GoalPlanner(list(self.skills.values()), self.ctx.abilities()) if is_goal(prompt) else self.planner

    def _refused_if_hopeless(self, answer: Plan | Refusal, scene: ObservedScene) -> Plan | Refusal:
        """Return a refusal in place of a plan with a step that nothing done first can make possible; else the answer itself.

        What something done first may mend is left to the skill that meets it: it says so before it moves, and repairs are tried.
        """
        if isinstance(answer, Refusal):
            return answer
        problems = verify(answer, scene, list(self.skills.values())).problems
        hopeless = next((problem for problem in problems if problem.is_final), None)
        return answer if hopeless is None else Refusal(code=RefusalCode.IMPOSSIBLE, message=str(hopeless))

    def _contract(self, call: SkillCall) -> Contract | None:
        skill = self.skills[call.skill]
        return contract_of(skill, skill.check(call.arguments))

    def _execute(
        self, plan: Plan, steps: list[Step], monitor: Monitor, asked: Sequence[SkillCall], *, ends: bool
    ) -> FailedAttempt | None:
        """Run the plan's calls, adding those that succeed to `steps`; return the first failure.

        What earlier calls brought about is looked at again on the way: where it was undone meanwhile, that call has failed.
        Other calls than those `asked` for are ways around a failure. `ends` tells whether nothing follows the plan.
        """
        for index, call in enumerate(plan.steps):
            self._emit(SkillStarted(call, index, len(plan.steps)))
            try:
                result = self.perform(call)
            except SkillError as error:
                self._emit(SkillFailed(call, error.record()))
                return FailedAttempt(
                    completed=plan.steps[:index], failed=call, error=error, remaining=plan.steps[index + 1 :]
                )
            steps.append(Step(call=call, result=result))
            self._emit(SkillEnded(call, result))
            monitor.add(call, self._contract(call), is_detour=call not in asked)
            left = plan.steps[index + 1 :]
            undone = self._undone(monitor, at_the_end=ends and not left)
            if undone is not None:
                return replace(undone, remaining=(*undone.remaining, *left))
        return None

    def _undone(self, monitor: Monitor, *, at_the_end: bool) -> FailedAttempt | None:
        """Return the failure that a call has become whose effect does not hold any more."""
        undone = monitor.undone(self.ctx.look, at_the_end=at_the_end)
        if undone is None:
            return None
        self._emit(SkillFailed(undone.call, undone.error.record()))
        return FailedAttempt(completed=(), failed=undone.call, error=undone.error, remaining=undone.to_repeat)

    def perform(self, call: SkillCall) -> SkillResult:
        """Carry out one skill call; listeners hear of its phases.

        Raises:
            SkillError: It did not reach its post-condition; a fault of the code is an InternalError with an id in the log.
        """
        skill = self.skills.get(call.skill)
        if skill is None:
            hint = did_you_mean(call.skill, self.skills)
            raise InvalidArgumentError(f"no skill {call.skill!r}; there is {', '.join(self.skills)}{hint}")

        def tell(phase: str) -> None:
            self._emit(PhaseEntered(call, phase))

        def show(intent: Intent) -> None:
            self._emit(Intended(call, intent))

        self.ctx.listeners.append(tell)
        if self.listeners:
            self.ctx.intent_listeners.append(show)
        try:
            for permit in self.permits:
                permit(call)
            return skill(self.ctx, call.arguments)
        except RoboSandboxError:
            raise
        except Exception as fault:
            raise InternalError.log(call, fault, _log) from fault
        finally:
            self.ctx.listeners.remove(tell)
            if show in self.ctx.intent_listeners:
                self.ctx.intent_listeners.remove(show)

    def _emit(self, event: AgentEvent) -> None:
        for listener in tuple(self.listeners):
            listener(event)


def check_prompt(prompt: str) -> None:
    """Refuse a prompt that no sentence needs.

    Raises:
        InputError: It is no text, or longer than `MAX_PROMPT_LENGTH`.
    """
    if not isinstance(prompt, str):
        raise InputError(f"prompt: {prompt!r:.60} is no text; give a sentence")
    if len(prompt) > MAX_PROMPT_LENGTH:
        raise InputError(
            f"prompt: {prompt[:20]!r}... has {len(prompt):,} characters; at most {MAX_PROMPT_LENGTH:,}; "
            "say it in a sentence or two"
        )


def _reason_of(error: PlannerError) -> FinalReason:
    return next((why for kind, why in _PLANNER_REASONS.items() if isinstance(error, kind)), FinalReason.PLANNER_FAILED)
