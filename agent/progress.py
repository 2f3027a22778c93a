"""What an episode has come to so far, kept while it runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from robosandbox.agent.episode import AgentEvent, Consulted, Episode, FailedAttempt, FinalReason, Step
from robosandbox.agent.usage import Usage
from robosandbox.types import Plan, Refusal


@dataclass(slots=True)
class Progress:
    """The parts of an `Episode`, as they come; what they are is said there."""

    steps: list[Step] = field(default_factory=list)
    attempts: list[FailedAttempt] = field(default_factory=list)
    consulted: list[Consulted] = field(default_factory=list)
    plan: Plan | None = None
    refusal: Refusal | None = None
    replans: int = 0
    claim: str = ""

    def hear(self, event: AgentEvent) -> None:
        """Keep what was looked up, tried out and asked."""
        if isinstance(event, Consulted):
            self.consulted.append(event)

    def ended(self, prompt: str, reason: FinalReason, detail: str, usage: Usage) -> Episode:
        """Return the episode, now that it is over."""
        success = reason is FinalReason.PLAN_COMPLETE
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
            error=self.attempts[-1].error.record() if self.attempts and not success else None,
            model_usage=usage,
            consulted=tuple(self.consulted),
            claim=self.claim,
        )


def summary(steps: Sequence[Step]) -> str:
    """Return what was done and what else changed meanwhile, in a line."""
    changed = [effect for step in steps for effect in step.result.side_effects]
    done = str(Plan(steps=tuple(step.call for step in steps)))
    return f"{done}; {'; '.join(changed)}" if changed else done
