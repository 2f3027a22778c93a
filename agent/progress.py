"""Progress of an episode, kept while it runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from robosandbox.agent.episode import AgentEvent, Consulted, Episode, FinalReason, Step
from robosandbox.agent.usage import Usage
from robosandbox.types import Plan, Refusal, SkillCall
from robosandbox.world.alternatives import Attempt


@dataclass(slots=True)
class Progress:
    """The parts of an `Episode`, as they come; what they are is said there.

    Attributes:
        asked: The calls of the plan that is being carried out, without the ways around failures that came into it.
        left: Those of them that are still to be made, or to be made again: one that was made may come once more as a way around a failure,
            as picking up what already lies in the bin.
    """

    steps: list[Step] = field(default_factory=list)
    attempts: list[Attempt] = field(default_factory=list)
    consulted: list[Consulted] = field(default_factory=list)
    plan: Plan | None = None
    asked: Sequence[SkillCall] = ()
    left: Sequence[SkillCall] = ()
    refusal: Refusal | None = None
    replans: int = 0
    claim: str = ""
    _begun: list[int] = field(default_factory=list)

    def hear(self, event: AgentEvent) -> None:
        """Keep what was looked up, tried out and asked."""
        if isinstance(event, Consulted):
            self.consulted.append(event)

    def cause(self) -> Attempt | None:
        """Return the first failure that no later call has mended, or the last where all were; None without one.

        A failure is mended once its skill has succeeded with the same thing.
        """
        for attempt, begun in zip(self.attempts, self._begun, strict=True):
            later = (step.call for step in self.steps[begun:])
            if not any(_is_about_the_same(call, attempt.failed) for call in later):
                return attempt
        return self.attempts[-1] if self.attempts else None

    def fail(self, attempt: Attempt) -> None:
        """Take down a plan that ended early."""
        self.attempts.append(attempt)
        self._begun.append(len(self.steps))

    def ended(self, prompt: str, reason: FinalReason, detail: str, usage: Usage) -> Episode:
        """Return the episode, now that it is over."""
        success = reason is FinalReason.PLAN_COMPLETE
        cause = None if success else self.cause()
        return Episode(
            prompt=prompt,
            success=success,
            steps=tuple(self.steps),
            plan=self.plan,
            replans=self.replans,
            final_reason=reason,
            final_detail=detail,
            attempts=tuple(self.attempts),
            refusal=self.refusal,
            error=None if cause is None else cause.error,
            model_usage=usage,
            consulted=tuple(self.consulted),
            claim=self.claim,
        )


def _is_about_the_same(call: SkillCall, failed: SkillCall) -> bool:
    """Tell whether a call does with a thing what a failed one was to do with it."""
    return call.skill == failed.skill and next(iter(call.arguments.values()), None) == next(
        iter(failed.arguments.values()), None
    )


def summary(steps: Sequence[Step]) -> str:
    """Return what was done, found out and changed besides, in a line."""
    found = [step.result.found for step in steps if step.result.found]
    changed = [effect for step in steps for effect in step.result.side_effects]
    done = str(Plan(steps=tuple(step.call for step in steps)))
    return "; ".join([done, *found, *changed])
