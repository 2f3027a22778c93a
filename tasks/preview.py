"""What a plan would do: its calls carried out on the twin, a simulation of what is believed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from robosandbox.agent.agent import Agent
from robosandbox.errors import ErrorRecord, SkillError
from robosandbox.tasks.embedded import EmbeddedWorkcell
from robosandbox.types import Plan, SkillCall, SkillResult


@dataclass(frozen=True, slots=True, kw_only=True)
class Preview:
    """What came of a plan on the twin.

    Attributes:
        steps: The calls that reached their post-conditions, with the results.
        failed: The call that did not, if one did not.
        error: Why.
        seconds: Simulated time that it took.
    """

    steps: tuple[tuple[SkillCall, SkillResult], ...]
    failed: SkillCall | None = None
    error: ErrorRecord | None = None
    seconds: float

    @property
    def success(self) -> bool:
        """Whether every call reached its post-condition."""
        return self.failed is None

    def record(self) -> dict[str, Any]:
        """Return the preview as JSON data."""
        return {
            "success": self.success,
            "seconds": round(self.seconds, 3),
            "steps": [
                {"call": call.model_dump(mode="json"), "result": result.model_dump(mode="json")}
                for call, result in self.steps
            ],
            "failed": self.failed.model_dump(mode="json") if self.failed else None,
            "error": self.error.model_dump(mode="json") if self.error else None,
        }

    def lines(self) -> list[str]:
        """Return a line for each call, for a person."""
        told = [f"{call}: would work{_effects(result)}" for call, result in self.steps]
        if self.failed is not None and self.error is not None:
            told.append(f"{self.failed}: would fail at {self.error.phase}: {self.error.message}")
        return [*told, f"{self.seconds:.1f} simulated seconds"]


def preview(session: EmbeddedWorkcell, plan: Plan) -> Preview:
    """Carry out a plan on the twin of the session's world; the world itself is left alone."""
    ctx = session.ctx.twin()
    copy = ctx.sim
    agent = Agent(ctx=ctx, skills=session.skills, planner=session.agent.planner)
    start = copy.time
    done: list[tuple[SkillCall, SkillResult]] = []
    result = Preview(steps=(), seconds=0.0)
    for call in plan.steps:
        try:
            done.append((call, agent.perform(call)))
        except SkillError as error:
            result = replace(result, failed=call, error=error.record())
            break
    return replace(result, steps=tuple(done), seconds=copy.time - start)


def _effects(result: SkillResult) -> str:
    return f" ({'; '.join(result.side_effects)})" if result.side_effects else ""
