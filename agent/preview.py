"""Preview of a plan: its calls carried out on the twin, a simulation of what is believed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from robosandbox.agent.twin_guard import Track, Tracker
from robosandbox.driver import Driver
from robosandbox.errors import Failure, SkillError
from robosandbox.motion.clearance import Clearance
from robosandbox.types import ObservedScene, Plan, SkillCall, SkillResult
from robosandbox.values import frozen
from robosandbox.world.operators import Operator, bind
from robosandbox.world.scene_json import scene_changes

if TYPE_CHECKING:
    from robosandbox.agent.context import AgentContext


@frozen(kw_only=True)
class PreviewStep:
    """A call as it went on the twin.

    Attributes:
        call: Which one.
        result: What came of it; None of one that failed.
        seconds: Simulated time that it took.
        touches: What the robot touched, meant or not, in the order in which it did.
        nearest_mm: Least distance to what it was not to touch, 0 where that was touched; None where nothing came into sight.
        nearest_to: Name of that; "" where there is none.
        track: How the arm went.
    """

    call: SkillCall
    result: SkillResult | None
    seconds: float
    touches: tuple[str, ...]
    nearest_mm: float | None
    nearest_to: str
    track: Track

    def record(self) -> dict[str, Any]:
        """Return how it went as JSON data."""
        return {
            "call": str(self.call),
            "seconds": round(self.seconds, 3),
            "touches": list(self.touches),
            "nearest_mm": None if self.nearest_mm is None else round(self.nearest_mm, 1),
            "nearest_to": self.nearest_to,
            "side_effects": list(self.result.side_effects) if self.result else [],
        }


@frozen(kw_only=True)
class Preview:
    """Outcome of a plan on the twin.

    Attributes:
        calls: The calls that were tried, up to the first that failed.
        error: Why that did; None where every call reached its post-condition.
        touched: What the robot touched though no call named it.
        begin: The scene that it began with.
        end: The scene that was left.
    """

    calls: tuple[PreviewStep, ...]
    error: Failure | None = None
    touched: tuple[str, ...] = ()
    begin: ObservedScene
    end: ObservedScene

    @property
    def steps(self) -> tuple[tuple[SkillCall, SkillResult], ...]:
        """The calls that reached their post-conditions, with the results."""
        return tuple((step.call, step.result) for step in self.calls if step.result is not None)

    @property
    def failed(self) -> SkillCall | None:
        """The call that did not, if one did not."""
        return self.calls[-1].call if self.error is not None else None

    @property
    def seconds(self) -> float:
        """Simulated time that it took."""
        return sum(step.seconds for step in self.calls)

    @property
    def success(self) -> bool:
        """True where every call reached its post-condition."""
        return self.error is None

    def record(self) -> dict[str, Any]:
        """Return the preview as JSON data."""
        return {
            "success": self.success,
            "seconds": round(self.seconds, 3),
            "steps": [
                {
                    "call": step.call.model_dump(mode="json"),
                    "result": step.result.model_dump(mode="json"),
                    **{key: value for key, value in step.record().items() if key not in ("call", "side_effects")},
                }
                for step in self.calls
                if step.result is not None
            ],
            "failed": self.failed.model_dump(mode="json") if self.failed else None,
            "error": self.error.model_dump(mode="json") if self.error else None,
            "touched": list(self.touched),
        }

    def told(self) -> dict[str, Any]:
        """Return what would come of the plan as JSON data, for a model or client that asks before it calls."""
        data: dict[str, Any] = {
            "ok": self.success,
            "moves": any(step.track.moves for step in self.calls),
            "seconds": self.seconds,
            "would_work": [str(call) for call, _ in self.steps],
            "steps": [step.record() for step in self.calls],
            "side_effects": [effect for _, result in self.steps for effect in result.side_effects],
            "would_touch": list(self.touched),
            "changes": scene_changes(self.begin, self.end),
        }
        if self.failed is not None and self.error is not None:
            data |= {"would_fail": str(self.failed), "error": self.error.model_dump(mode="json")}
        return data

    def lines(self) -> list[str]:
        """Return a line for each call, for a person."""
        return preview_lines(self.told())


def preview_lines(told: Mapping[str, Any]) -> list[str]:
    """Return a line for each call of a preview, here or of another process, as `Preview.told` has it."""
    lines = [problem["error"]["message"] for problem in told.get("problems", ())]
    for step in told.get("steps", ()):
        failed = step["call"] == told.get("would_fail") and step is told["steps"][-1]
        how = f"would fail at {told['error']['phase']}: {told['error']['message']}" if failed else "would work"
        effects = f" ({'; '.join(step['side_effects'])})" if step["side_effects"] else ""
        touches = f", touches {', '.join(step['touches'])}" if step["touches"] else ""
        near = step["nearest_mm"]
        comes = "" if near is None else f", {near:.0f} mm from {step['nearest_to']} at the nearest"
        lines.append(f"{step['call']}: {how}{effects}; {step['seconds']:.1f} s{touches}{comes}")
    if told.get("would_touch"):
        lines.append(f"would touch {', '.join(told['would_touch'])} on the way")
    return [*lines, f"{told['seconds']:.1f} simulated seconds"] if "seconds" in told else lines


class _Touches:
    """A listener to ticks that notes what the robot touches, and besides what it is about.

    Attributes:
        about: What may be touched.
        now: What was touched since it was emptied last.
        unmeant: What was touched that may not be.
    """

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self.about: set[str] = set()
        self.now: dict[str, None] = {}
        self.unmeant: dict[str, None] = {}

    def __call__(self) -> None:
        for _, other in self._driver.senses.contacts():
            # A drawer's sliding box is "<id>/box".
            name = other.partition("/")[0]
            self.now[name] = None
            if name not in self.about:
                self.unmeant[name] = None


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
        touches, clearance, tracker = _Touches(twin.driver), Clearance(twin.driver, twin.arm.name), Tracker(twin)
        if twin.driver.capabilities.contact == "named":
            twin.driver.subscribe(touches)
        twin.driver.subscribe(clearance)
        twin.driver.subscribe(tracker)
        tried: list[PreviewStep] = []
        error: Failure | None = None
        for call in plan.steps:
            scene, began = twin.look(), twin.driver.time
            touches.about |= {*map(str, call.arguments.values()), *scene.in_hands}
            touches.now.clear()
            clearance.begin(touches.about, scene.in_hands)
            tracker.begin()
            result: SkillResult | None = None
            try:
                result = twin.perform(bind(call, skills))
            except SkillError as failed:
                error = failed.failure
            nearest, near_to = clearance.nearest or (None, "")
            step = PreviewStep(
                call=call,
                result=result,
                seconds=twin.driver.time - began,
                touches=tuple(touches.now),
                nearest_mm=None if nearest is None else 1000.0 * max(0.0, nearest),
                nearest_to=near_to,
                track=tracker.track(),
            )
            tried.append(step)
            if error is not None:
                break
        return Preview(
            calls=tuple(tried),
            error=error,
            touched=tuple(touches.unmeant),
            begin=begin,
            end=twin.look(),
        )
