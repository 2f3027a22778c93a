"""A skill whose calls are recorded, each as an episode of its own: where goals come one by one, without an agent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from robosandbox.errors import SkillError
from robosandbox.skills.protocols import Skill, SkillContext
from robosandbox.types import SkillCall, SkillResult

if TYPE_CHECKING:
    from robosandbox.workcell.recording.recorder import Recorder


class RecordedSkill:
    """Calls a skill and takes down what comes of it.

    Args:
        skill: What is called.
        recorder: Of the world in which it is called; calls in copies of it are not recorded.
    """

    def __init__(self, skill: Skill[Any], recorder: Recorder) -> None:
        self.name: str = skill.name
        self.description: str = skill.description
        self.schema = skill.schema
        self.contract: Any = getattr(skill, "contract", None)
        self.alternatives: Any = getattr(skill, "alternatives", None)
        self._skill = skill
        self._recorder = recorder

    def check(self, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the arguments converted to their types; raises InvalidArgumentError."""
        return self._skill.check(arguments)

    def __call__(self, ctx: SkillContext, arguments: Mapping[str, Any]) -> SkillResult:
        """Check the arguments and run; raises SkillError."""
        recorder = self._recorder
        if not recorder.watches(ctx):
            return self._skill(ctx, arguments)
        call = SkillCall(skill=self.name, arguments=dict(arguments))
        recorder.begin(str(call))
        recorder.enter(self.name, "")
        recorder.note("skill_started", call=call, index=0, total=1)

        def tell(phase: str) -> None:
            recorder.enter(self.name, phase)
            recorder.note("phase", skill=self.name, phase=phase)

        ctx.listeners.append(tell)
        outcome = (False, "internal_error", f"{call}: a fault of the code")
        try:
            result = self._skill(ctx, arguments)
            recorder.note("skill_ended", call=call, result=result)
            outcome = (True, "plan_complete", str(call))
            return result
        except SkillError as error:
            record = error.record()
            recorder.note("skill_failed", call=call, error=record)
            outcome = (False, record.code, f"{call}: {record.message}")
            raise
        finally:
            ctx.listeners.remove(tell)
            recorder.finish(outcome=outcome)
