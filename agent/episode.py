"""Episode of a prompt: its outcome, its steps and failed attempts, and the events on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from enum import StrEnum
from typing import Any

from robosandbox.agent.usage import Usage
from robosandbox.errors import Failure
from robosandbox.skills.events import (
    Intended as Intended,
    PhaseEntered as PhaseEntered,
    SkillEnded as SkillEnded,
    SkillEvent as SkillEvent,
    SkillFailed as SkillFailed,
    SkillStarted as SkillStarted,
)
from robosandbox.types import Plan, Refusal, SkillCall, SkillResult
from robosandbox.values import frozen
from robosandbox.world.alternatives import Attempt


class FinalReason(StrEnum):
    """Reason why an episode ended; only the first is success."""

    PLAN_COMPLETE = "plan_complete"
    REFUSED = "refused"
    DECLINED = "declined"
    GAVE_UP = "gave_up"
    REPLANS_EXHAUSTED = "replans_exhausted"
    CANCELLED = "cancelled"
    TIMED_OUT = "timed_out"
    INTERNAL_ERROR = "internal_error"
    PLANNER_UNAVAILABLE = "planner_unavailable"
    PLANNER_FAILED = "planner_failed"


@frozen(kw_only=True)
class Step:
    """A skill call that ended in its post-condition."""

    call: SkillCall
    result: SkillResult


@frozen(kw_only=True)
class Consulted:
    """A director used a tool that moves nothing, or one that was turned down before anything moved.

    Attributes:
        tool: Its name.
        arguments: As JSON data.
        answer: What it was told, as JSON data.
    """

    tool: str
    arguments: Mapping[str, Any]
    answer: Mapping[str, Any]


@frozen(kw_only=True)
class Episode:
    """Outcome of a prompt.

    Attributes:
        prompt: As said.
        success: Whether every step of the last plan reached its post-condition.
        steps: The calls that did, over all plans, in order.
        plan: The last plan; None when the first answer was a refusal.
        replans: How often the agent planned anew after a failure.
        final_reason: Why it ended.
        final_detail: The same as a sentence.
        attempts: The plans that ended early.
        refusal: The planner's no, at first or after a failure.
        error: The first failure that nothing mended; None after a success.
        model_usage: What language models were asked meanwhile, and every exchange with them; none where none was asked.
        consulted: What a director looked up, tried out and asked between its calls, in order.
        claim: What a director says was done; "" without one.
    """

    prompt: str
    success: bool
    steps: tuple[Step, ...]
    plan: Plan | None
    replans: int
    final_reason: FinalReason
    final_detail: str
    attempts: tuple[Attempt, ...] = ()
    refusal: Refusal | None = None
    error: Failure | None = None
    model_usage: Usage = field(default_factory=Usage)
    consulted: tuple[Consulted, ...] = ()
    claim: str = ""

    @property
    def answer(self) -> str:
        """Answer to the person who asked a question; "" for orders."""
        return self.plan.answer if self.plan else ""

    def record(self) -> dict[str, Any]:
        """Return the episode as JSON data."""
        return {
            "prompt": self.prompt,
            "success": self.success,
            "final_reason": self.final_reason.value,
            "final_detail": self.final_detail,
            "replans": self.replans,
            "plan": self.plan.model_dump(mode="json")["steps"] if self.plan else None,
            "answer": self.answer,
            "note": self.plan.note if self.plan else "",
            "steps": [
                {"call": step.call.model_dump(mode="json"), "result": step.result.model_dump(mode="json")}
                for step in self.steps
            ],
            "attempts": [
                {
                    "completed": [call.model_dump(mode="json") for call in attempt.completed],
                    "failed": attempt.failed.model_dump(mode="json"),
                    "remaining": [call.model_dump(mode="json") for call in attempt.remaining],
                    "error": attempt.error.model_dump(mode="json"),
                }
                for attempt in self.attempts
            ],
            "refusal": self.refusal.model_dump(mode="json") if self.refusal else None,
            "error": self.error.model_dump(mode="json") if self.error else None,
            "model_usage": self.model_usage.record(),
            "transcript": self.model_usage.transcript(),
            "consulted": [
                {"tool": one.tool, "arguments": dict(one.arguments), "answer": dict(one.answer)}
                for one in self.consulted
            ],
            "claim": self.claim,
        }


@frozen
class Started:
    """A prompt was taken; nothing has been planned yet."""

    prompt: str


@frozen
class Thought:
    """A director says why it does what comes next; its own words, nothing measured."""

    text: str


@frozen(kw_only=True)
class Writing:
    """A model is writing its answer; none of it is checked, and none of it is done before it is.

    Attributes:
        thought: What was added to its thought.
        calls: Calls that are complete now.
    """

    thought: str = ""
    calls: tuple[SkillCall, ...] = ()


@frozen
class Planned:
    """There is a plan; `replan` is 0 for the first."""

    plan: Plan
    replan: int


@frozen
class Replanning:
    """The planner is asked again, for the `replan`-th time."""

    replan: int
    error: Failure


@frozen
class Ended:
    """The episode is over."""

    episode: Episode


AgentEvent = Started | Thought | Writing | Consulted | Planned | SkillEvent | Replanning | Ended
Listener = Callable[[AgentEvent], None]
