"""The agent: perceive, plan, execute, and after a failure look again and replan."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

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
from robosandbox.agent.usage import Usage, metered
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
from robosandbox.protocols import Attempt, Planner, Skill
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

    def plan(self, prompt: str) -> Plan | Refusal:
        """Return what the planner makes of the prompt and the scene; nothing moves.

        Raises:
            InputError: The prompt is too long.
            PlannerError: The planner has no answer.
        """
        check_prompt(prompt)
        return self.answer(prompt, self._look())

    def answer(self, prompt: str, scene: ObservedScene) -> Plan | Refusal:
        """Return the planner's answer for a scene, or a refusal where its plan has a step that cannot be done.

        Raises:
            PlannerError: The planner has no answer.
        """
        return self._refused_if_hopeless(self._planner_for(prompt).plan(prompt, scene, ()), scene)

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
        return self._run(", ".join(map(str, plan.steps)), _Given(plan), 0)

    def _run(self, prompt: str, planner: Planner, max_replans: int) -> Episode:
        with metered() as usage:
            episode = self._carry_out(prompt, planner, max_replans, usage)
        self._emit(Ended(episode))
        return episode

    def _carry_out(self, prompt: str, planner: Planner, max_replans: int, usage: Usage) -> Episode:
        self._emit(Started(prompt))
        steps: list[Step] = []
        attempts: list[FailedAttempt] = []
        plan: Plan | None = None
        replans = 0
        answer: Plan | Refusal | None = None
        monitor = Monitor()
        while True:
            scene = self._look()
            if not attempts:
                monitor.begin(scene)
            try:
                answer = planner.plan(prompt, scene, tuple(attempts))
            except PlannerError as error:
                reason, detail = _reason_of(error), str(error)
                break
            answer = self._refused_if_hopeless(answer, scene)
            if isinstance(answer, Refusal):
                reason = FinalReason.GAVE_UP if attempts else FinalReason.REFUSED
                detail = answer.message
                break
            plan = answer
            self._emit(Planned(plan, replans))
            if self.approve is not None and not self.approve(plan):
                reason, detail = FinalReason.DECLINED, "the plan was not confirmed; nothing was moved for it"
                break
            failure = self._execute(plan, steps, monitor)
            if failure is None:
                reason, detail = FinalReason.PLAN_COMPLETE, _summary(steps)
                break
            attempts.append(failure)
            final = _FINAL_ERRORS.get(type(failure.error))
            if final or replans == max_replans:
                reason = final or FinalReason.REPLANS_EXHAUSTED
                detail = f"{failure.failed}: {failure.error.message}"
                break
            replans += 1
            self._emit(Replanning(replans, failure.error.record()))
        success = reason is FinalReason.PLAN_COMPLETE
        return Episode(
            prompt=prompt,
            success=success,
            steps=tuple(steps),
            plan=plan,
            replans=replans,
            final_reason=reason,
            final_detail=detail,
            attempts=tuple(attempts),
            refusal=answer if isinstance(answer, Refusal) else None,
            error=attempts[-1].error.record() if attempts and not success else None,
            model_usage=usage,
        )

    def _planner_for(self, prompt: str) -> Planner:
        """Return who plans for a prompt: the search over contracts where it lists relations, else the planner."""
        return GoalPlanner(list(self.skills.values())) if is_goal(prompt) else self.planner

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

    def _look(self) -> ObservedScene:
        return self.ctx.look()

    def _execute(self, plan: Plan, steps: list[Step], monitor: Monitor) -> FailedAttempt | None:
        """Run the plan's calls, adding those that succeed to `steps`; return the first failure.

        What earlier calls brought about is looked at again on the way: where it was undone meanwhile, that call has failed.
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
            monitor.add(call, self._contract(call))
            undone = monitor.undone(self._look, at_the_end=index + 1 == len(plan.steps))
            if undone is not None:
                self._emit(SkillFailed(undone.call, undone.error.record()))
                again = (*undone.to_repeat, *plan.steps[index + 1 :])
                return FailedAttempt(completed=(), failed=undone.call, error=undone.error, remaining=again)
        return None

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


class _Given:
    """A planner that has one plan, whatever is asked."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal:
        del prompt, scene, history
        return self._plan


def check_prompt(prompt: str) -> None:
    """Refuse a prompt that no sentence needs.

    Raises:
        InputError: It is longer than `MAX_PROMPT_LENGTH`.
    """
    if len(prompt) > MAX_PROMPT_LENGTH:
        raise InputError(
            f"prompt: {prompt[:20]!r}... has {len(prompt):,} characters; at most {MAX_PROMPT_LENGTH:,}; "
            "say it in a sentence or two"
        )


def _reason_of(error: PlannerError) -> FinalReason:
    return next((why for kind, why in _PLANNER_REASONS.items() if isinstance(error, kind)), FinalReason.PLANNER_FAILED)


def _summary(steps: Sequence[Step]) -> str:
    changed = [effect for step in steps for effect in step.result.side_effects]
    done = ", ".join(str(step.call) for step in steps) or "nothing to do"
    return f"{done}; {'; '.join(changed)}" if changed else done
