"""The agent: perceive, plan, execute, and after a failure look again and replan."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any, Generic, TypeVar

from robosandbox.agent.course import Conversing, Course, Desk, GivenPlan, PromptDone, Remembering, Report, begin
from robosandbox.agent.episode import (
    AgentEvent,
    Ended,
    Episode,
    FinalReason,
    Planned,
    Replanning,
    Started,
    Step,
)
from robosandbox.agent.gate import Gate, UnconfirmedError, answer_to_question
from robosandbox.agent.goal import GoalContext
from robosandbox.agent.goal_planner import GoalPlanner, is_goal
from robosandbox.agent.overheard import overheard
from robosandbox.agent.progress import Progress, summary
from robosandbox.agent.protocols import Planner
from robosandbox.agent.usage import metered
from robosandbox.agent.written_calls import written_calls
from robosandbox.errors import (
    ErrorCode,
    InputError,
    InvalidArgumentError,
    PlannerCancelledError,
    PlannerError,
    PlannerUnavailableError,
    RefusedPromptError,
    SkillError,
)
from robosandbox.skills.events import SkillFailed
from robosandbox.types import (
    MAX_PROMPT_LENGTH,
    ObservedScene,
    Plan,
    Refusal,
    RefusalCode,
    SkillCall,
    SkillResult,
)
from robosandbox.world.alternatives import Attempt
from robosandbox.world.foresight import with_grips
from robosandbox.world.monitor import Monitor
from robosandbox.world.operators import BoundCall, Operator, bind
from robosandbox.world.verifier import verify

_log = logging.getLogger(__name__)

_FINAL_ERRORS: dict[str, FinalReason] = {
    ErrorCode.CANCELLED: FinalReason.CANCELLED,
    ErrorCode.GOAL_TIMEOUT: FinalReason.TIMED_OUT,
    ErrorCode.INTERNAL: FinalReason.INTERNAL_ERROR,
    # What was shown is not what happens: somebody has to look.
    ErrorCode.TWIN: FinalReason.GAVE_UP,
}

WorldT = TypeVar("WorldT", bound=GoalContext)

_PLANNER_REASONS = {
    PlannerUnavailableError: FinalReason.PLANNER_UNAVAILABLE,
    PlannerCancelledError: FinalReason.CANCELLED,
}


class _NotApprovedError(Exception):
    """A plan is not to be carried out; the message says why."""


class Agent(Generic[WorldT]):
    """Carries out prompts, in a world of this process or in a remote one.

    Args:
        ctx: The world: it is looked at, skills are called with it, and its phases are listened to.
        skills: What the robot can do.
        planner: From a sentence to skill calls.
        max_replans: How often a failure may be answered with a new plan.

    Attributes:
        calls: What a plan may call: the skills, and what else people write out, as moves of the hand alone.
        approve: Asked about each plan before the first of its calls, and about each call by itself: whether it may be carried
            out, or a SkillError that says why not. None approves all.
        takes_answers: Whether a question about a plan can be answered by the next sentence.
        ask: Puts a question of a planner to the person and returns the answer; None where nobody is there to answer.
        streams: Whether listeners are told what a model writes while it writes.
        thinks: Whether the planner is being asked.
        left: Set by whoever interrupts `run`, before a KeyboardInterrupt: the planner is not waited for any longer.
    """

    def __init__(self, ctx: WorldT, skills: Sequence[Operator], planner: Planner, max_replans: int = 3) -> None:
        if max_replans < 0:
            raise ValueError(f"max_replans is {max_replans}; it takes 0 or more")
        self.ctx = ctx
        self.skills: dict[str, Operator] = {skill.name: skill for skill in skills}
        if len(self.skills) != len(skills):
            raise ValueError(f"two skills share a name: {', '.join(sorted(skill.name for skill in skills))}")
        self.calls: Mapping[str, Operator] = self.skills
        ctx.skills = self.skills
        self.planner = planner
        self.max_replans = max_replans
        self.approve: Callable[[Plan], bool] | None = None
        self.takes_answers: bool = False
        # The sentence and the plan that a yes is waited for, and the plan that has it.
        self._open: tuple[str, Plan] | None = None
        self._confirmed: Plan | None = None
        self.ask: Callable[[str], str] | None = None
        self.streams: bool = False
        self.thinks: bool = False
        self.left: bool = False

    def take_over(self, before: Agent[Any]) -> None:
        """Ask and tell the people that another agent, in whose place this one is, has asked and told."""
        approve = before.approve
        self.approve = approve.of(self) if isinstance(approve, Gate) else approve
        self.ask, self.streams = before.ask, before.streams

    def begin_anew(self) -> None:
        """Begin a new conversation: the world has started over."""
        self._open = None
        if isinstance(self.planner, Conversing):
            self.planner.begin_anew()

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
            planner = self._planner_for(prompt)
            answer = planner.plan(prompt, scene, ())
        return answer if isinstance(answer, Refusal) else self._foreseen(planner, answer, scene)[0]

    def run(self, prompt: str, *, takes_answers: bool = False) -> Episode:
        """Carry out a prompt.

        Args:
            prompt: What was said.
            takes_answers: Whether a plan that is to be confirmed waits for the next prompt to do so.

        Returns:
            What came of it; failures of skills and of the planner are in there and not raised.

        Raises:
            InputError: The prompt is too long.
        """
        check_prompt(prompt)
        waiting, self._open = self._open, None
        said = None if waiting is None else answer_to_question(prompt)
        if said is False:
            return self._run(prompt, GivenPlan(Plan(steps=(), answer="it is not carried out")), 0)
        if waiting is not None and said:
            # It is planned anew: a plan that has become another one is shown again.
            prompt, self._confirmed = waiting
        self.takes_answers = takes_answers
        try:
            return self._run(prompt, self._planner_for(prompt), self.max_replans)
        finally:
            self.takes_answers, self._confirmed = False, None

    def follow(self, plan: Plan) -> Episode:
        """Carry out a plan as it is; a failure ends it.

        Returns:
            What came of it; its prompt is the plan in words.
        """
        return self._run(", ".join(map(str, plan.steps)), GivenPlan(plan), 0)

    def _run(self, prompt: str, planner: Planner, max_replans: int) -> Episode:
        told = Progress()
        leave = self.ctx.events.subscribe(told.hear)
        try:
            with metered() as usage, overheard(self._emit if self.streams else None):
                reason, detail = self._carry_out(prompt, planner, told, max_replans)
        finally:
            leave()
        episode = told.ended(prompt, reason, detail, usage)
        if self._open is not None:
            # Nothing was done, and with a yes the sentence comes again.
            self._open = prompt, self._open[1]
        elif isinstance(planner, Remembering):
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
            calls: tuple[BoundCall, ...] = ()
            if isinstance(answer, Plan):
                checked = self._checked(answer, scene) if report else self._foreseen(planner, answer, scene)
                answer, calls = checked
            if isinstance(answer, Refusal):
                told.refusal = answer
                if report is None:
                    return FinalReason.REFUSED, answer.message
                return FinalReason.GAVE_UP, _closing_line(told.cause(), answer)
            try:
                report = self._reported(answer, calls, course, told, monitor, report)
            except UnconfirmedError as question:
                assert isinstance(answer, Plan)
                self._open = prompt, answer
                told.refusal = Refusal(code=RefusalCode.AMBIGUOUS, message=question.message, candidates=("yes", "no"))
                return FinalReason.REFUSED, question.message
            except _NotApprovedError as declined:
                return FinalReason.DECLINED, str(declined)
            failure = report.failure
            if failure is None:
                if isinstance(answer, PromptDone) or not course.goes_on:
                    done = summary(told.steps)
                    if isinstance(answer, PromptDone):
                        return FinalReason.PLAN_COMPLETE, f"{done}; {answer.answer}" if answer.answer else done
                    return FinalReason.PLAN_COMPLETE, answer.answer or done
                continue
            final = self._final(failure, told, max_replans)
            if final is FinalReason.REPLANS_EXHAUSTED:
                return final, _closing_line(told.cause())
            if final is not None:
                return final, f"{failure.failed}: {failure.error.message}"

    def _final(self, failure: Attempt, told: Progress, max_replans: int) -> FinalReason | None:
        """Take down a failure; return why it is the last, or None where the course is asked again."""
        told.fail(failure)
        final = _FINAL_ERRORS.get(failure.error.code)
        if final is not None or told.replans == max_replans:
            return final or FinalReason.REPLANS_EXHAUSTED
        told.replans += 1
        self._emit(Replanning(told.replans, failure.error))
        return None

    def _reported(
        self,
        answer: Plan | PromptDone,
        calls: tuple[BoundCall, ...],
        course: Course,
        told: Progress,
        monitor: Monitor,
        last: Report | None,
    ) -> Report:
        """Carry out a plan, or look at what is said to be finished.

        Raises:
            UnconfirmedError: A yes is waited for.
            _NotApprovedError: The plan is not to be carried out.
        """
        if isinstance(answer, PromptDone):
            told.claim = answer.summary
            return Report(steps=(), failure=self._undone(monitor, at_the_end=True))
        before = told.plan
        told.plan = answer
        if before is not None and (course.goes_on or before.then):
            told.plan = Plan(
                steps=(*(step.call for step in told.steps), *answer.steps),
                then=answer.then,
                note=before.note,
                tempo=before.tempo,
            )
        self._emit(Planned(answer, told.replans))
        self._approve(answer, course, told)
        begun = len(told.steps)
        if last is None or last.failure is None or course.goes_on:
            # Who decides call by call has asked for each of them; the ways around one failure are not asked for after the next.
            told.asked = told.left = answer.steps
        else:
            told.left = [call for call in (last.failure.failed, *last.failure.remaining) if call in told.asked]
        try:
            with self._at(answer.tempo):
                failure = self._execute(answer, calls, told.steps, monitor, told.left, ends=not course.goes_on)
        except SkillError as error:
            # The tempo could not be set, and nothing was done.
            failure = Attempt(completed=(), failed=answer.steps[0], error=error.failure, remaining=answer.steps[1:])
        return Report(steps=tuple(told.steps[begun:]), failure=failure)

    def _approve(self, plan: Plan, course: Course, told: Progress) -> None:
        """Have a plan approved; errors as those of `_reported`."""
        confirmed, self._confirmed = self._confirmed, None
        self.ctx.confirmed = confirmed is not None and plan.steps == confirmed.steps
        if not plan.steps or self.approve is None or self.ctx.confirmed:
            return
        # Who decides call by call could not go on where a question has ended the prompt.
        self.takes_answers = self.takes_answers and not course.goes_on
        try:
            approved = self.approve(plan)
        except UnconfirmedError:
            raise
        except SkillError as error:
            told.fail(Attempt(completed=(), failed=plan.steps[0], error=error.failure, remaining=plan.steps[1:]))
            raise _NotApprovedError(error.message) from None
        if not approved:
            raise _NotApprovedError("the plan was not confirmed; nothing was moved for it")

    @contextmanager
    def _at(self, tempo: str) -> Iterator[None]:
        """Go at a tempo meanwhile, and at the one before it afterwards, where something sets it."""
        if not tempo or "set_tempo" not in self.calls:
            yield
            return
        before = self._go_at(tempo)
        try:
            yield
        finally:
            # What was stopped or lost is told by what stopped it.
            with suppress(SkillError):
                self._go_at(before)

    def _go_at(self, tempo: str) -> str:
        """Set the tempo; return the one before."""
        done = self.ctx.perform(self._bound(SkillCall(skill="set_tempo", arguments={"tempo": tempo})))
        return str(done.detail["before"])

    def _next(self, course: Course, scene: ObservedScene, report: Report | None) -> Plan | Refusal | PromptDone:
        """Return what the course answers; a person who does not want to wait for it may leave it."""
        if self.left:
            raise PlannerCancelledError("cancelled before the planner was asked")
        self.thinks = True
        try:
            return course.next(scene, report)
        except (Exception, KeyboardInterrupt) as error:
            # An interrupt may come out of a library as another error.
            if not self.left:
                raise
            raise PlannerCancelledError("cancelled while planning; the arm holds where it was") from error
        finally:
            self.thinks = False

    def _planner_for(self, prompt: str) -> Planner:
        """Return who plans for a prompt: nobody where it is calls, the search where it lists relations, else the planner."""
        if written := written_calls(prompt, self.calls):
            return GivenPlan(Plan(steps=written), list(self.skills.values()))
        return GoalPlanner(list(self.skills.values()), self.ctx.abilities()) if is_goal(prompt) else self.planner

    def _checked(self, plan: Plan, scene: ObservedScene) -> tuple[Plan | Refusal, tuple[BoundCall, ...]]:
        """Return a plan with its calls bound, or a refusal where nothing done first can make one of its steps possible.

        What something done first may mend is left to the skill that meets it: it says so before it moves, and repairs are
        tried. No calls come with a plan of which one is wrong in itself.
        """
        verdict = verify(plan, scene, list(self.calls.values()))
        hopeless = next((problem for problem in verdict.problems if problem.is_final), None)
        if hopeless is not None:
            return Refusal(code=RefusalCode.IMPOSSIBLE, message=str(hopeless)), ()
        return plan, verdict.calls

    def _foreseen(
        self, planner: Planner, plan: Plan, scene: ObservedScene
    ) -> tuple[Plan | Refusal, tuple[BoundCall, ...]]:
        """Return a first plan as `_checked` does, its grips chosen for what is to come; one that was given stays as it is."""
        answer, calls = self._checked(plan, scene)
        if isinstance(answer, Plan) and not isinstance(planner, GivenPlan):
            calls = with_grips(calls, scene, self.calls)
            answer = answer.model_copy(update={"steps": tuple(one.call for one in calls)}) if calls else answer
        return answer, calls

    def _execute(
        self,
        plan: Plan,
        calls: tuple[BoundCall, ...],
        steps: list[Step],
        monitor: Monitor,
        asked: Sequence[SkillCall],
        *,
        ends: bool,
    ) -> Attempt | None:
        """Run the plan's calls, adding those that succeed to `steps`; return the first failure.

        What earlier calls brought about is looked at again on the way: where it was undone meanwhile, that call has failed.
        Other calls than those `asked` for, each as often, are ways around a failure. `ends` tells whether nothing follows the plan.
        """
        still = list(asked)
        for index, call in enumerate(plan.steps):
            try:
                bound = calls[index] if calls else self._bound(call)
                result = self.ctx.perform(bound, index=index, total=len(plan.steps))
            except SkillError as error:
                return Attempt(
                    completed=plan.steps[:index], failed=call, error=error.failure, remaining=plan.steps[index + 1 :]
                )
            steps.append(Step(call=call, result=result))
            monitor.add(call, bound.contract, is_detour=call not in still)
            if call in still:
                still.remove(call)
            left = plan.steps[index + 1 :]
            undone = self._undone(monitor, at_the_end=ends and not left)
            if undone is not None:
                # A way around an earlier failure was for how things stood then.
                return replace(undone, remaining=(*undone.remaining, *(later for later in left if later in still)))
        return None

    def _undone(self, monitor: Monitor, *, at_the_end: bool) -> Attempt | None:
        """Return the failure that a call has become whose effect does not hold any more."""
        undone = monitor.undone(self.ctx.look, at_the_end=at_the_end)
        if undone is not None:
            self._emit(SkillFailed(undone.failed, undone.error))
        return undone

    def perform(self, call: SkillCall) -> SkillResult:
        """Carry out one skill call; errors as those of `perform_bound`."""
        return self.perform_bound(self._bound(call))

    def perform_bound(self, call: BoundCall, *, confirmed: bool = False) -> SkillResult:
        """Carry out one call, once it is approved as a plan of its own.

        Args:
            call: Which one.
            confirmed: Whether a person has done so already.

        Raises:
            SkillError: It was not approved, or did not reach its post-condition; a fault of the code is an InternalError with
                an id in the log.
        """
        self.ctx.confirmed = confirmed
        if not confirmed and self.approve is not None and not self.approve(Plan(steps=(call.call,))):
            raise RefusedPromptError(f"{call.call} was not confirmed; nothing was moved for it")
        return self.ctx.perform(call)

    def _bound(self, call: SkillCall) -> BoundCall:
        try:
            return bind(call, self.calls)
        except InvalidArgumentError as error:
            self._emit(SkillFailed(call, error.failure))
            raise

    def _emit(self, event: AgentEvent) -> None:
        self.ctx.events.emit(event)


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


def _closing_line(cause: Attempt | None, refusal: Refusal | None = None) -> str:
    """Return why an episode failed: its first cause, and a question that is left open; the refusal where nothing failed."""
    if cause is None:
        return refusal.message if refusal else ""
    said = f"{cause.failed}: {cause.error.message}"
    if refusal is None or refusal.code is not RefusalCode.AMBIGUOUS:
        return said
    return f"{said}; {refusal.message}"
