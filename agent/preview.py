"""Preview of a plan: its calls carried out on the twin, a simulation of what is believed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from robosandbox.driver import Driver
from robosandbox.errors import Failure, SkillError
from robosandbox.types import ObservedScene, Plan, SkillCall, SkillResult
from robosandbox.values import frozen
from robosandbox.world.operators import Operator, bind
from robosandbox.world.scene_json import scene_changes

if TYPE_CHECKING:
    from robosandbox.agent.context import AgentContext


@frozen(kw_only=True)
class Preview:
    """Outcome of a plan on the twin.

    Attributes:
        steps: The calls that reached their post-conditions, with the results.
        failed: The call that did not, if one did not.
        error: Why.
        seconds: Simulated time that it took.
        touched: What the robot touched though no call named it.
        begin: The scene that it began with.
        end: The scene that was left.
    """

    steps: tuple[tuple[SkillCall, SkillResult], ...]
    failed: SkillCall | None = None
    error: Failure | None = None
    seconds: float
    touched: tuple[str, ...] = ()
    begin: ObservedScene
    end: ObservedScene

    @property
    def success(self) -> bool:
        """True where every call reached its post-condition."""
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
            "touched": list(self.touched),
        }

    def told(self) -> dict[str, Any]:
        """Return what would come of the plan as JSON data, for a model or client that asks before it calls."""
        data: dict[str, Any] = {
            "ok": self.success,
            "seconds": self.seconds,
            "would_work": [str(call) for call, _ in self.steps],
            "side_effects": [effect for _, result in self.steps for effect in result.side_effects],
            "would_touch": list(self.touched),
            "changes": scene_changes(self.begin, self.end),
        }
        if self.failed is not None and self.error is not None:
            data |= {"would_fail": str(self.failed), "error": self.error.model_dump(mode="json")}
        return data

    def lines(self) -> list[str]:
        """Return a line for each call, for a person."""
        told = [f"{call}: would work{_effects(result)}" for call, result in self.steps]
        if self.failed is not None and self.error is not None:
            told.append(f"{self.failed}: would fail at {self.error.phase}: {self.error.message}")
        if self.touched:
            told.append(f"would touch {', '.join(self.touched)} on the way")
        return [*told, f"{self.seconds:.1f} simulated seconds"]


@dataclass(slots=True)
class _Touches:
    """A listener to ticks that notes what the robot touches besides what it is about."""

    driver: Driver
    about: set[str] = field(default_factory=set)
    found: dict[str, None] = field(default_factory=dict)

    def __call__(self) -> None:
        for _, other in self.driver.senses.contacts():
            # A drawer's sliding box is "<id>/box".
            name = other.partition("/")[0]
            if name not in self.about:
                self.found[name] = None


def preview(
    ctx: AgentContext, plan: Plan, skills: Mapping[str, Operator], *, tick: Callable[[], None] | None = None
) -> Preview:
    """Carry out a plan on the twin of a world; the world itself is left alone.

    Args:
        ctx: The world.
        plan: What to try.
        skills: What it may call, by name.
        tick: Called at each control tick; a SkillError that it raises ends the trial.
    """
    with ctx.twin() as twin:
        if tick is not None:
            twin.driver.subscribe(tick)
        begin = twin.look()
        touches = _Touches(twin.driver)
        if twin.driver.capabilities.contact == "named":
            twin.driver.subscribe(touches)
        done: list[tuple[SkillCall, SkillResult]] = []
        result = Preview(steps=(), seconds=0.0, begin=begin, end=begin)
        for call in plan.steps:
            touches.about |= {*map(str, call.arguments.values()), *twin.look().in_hands}
            try:
                done.append((call, twin.perform(bind(call, skills))))
            except SkillError as error:
                result = replace(result, failed=call, error=error.failure)
                break
        seconds = twin.driver.time - begin.time
        return replace(result, steps=tuple(done), seconds=seconds, touched=tuple(touches.found), end=twin.look())


def _effects(result: SkillResult) -> str:
    return f" ({'; '.join(result.side_effects)})" if result.side_effects else ""
