"""Set tempo: choose how fast the arm goes from now on."""

from __future__ import annotations

from typing import Literal

from robosandbox.skills.base import Skill
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import SkillResult, find_tempo

_SPEEDS = (
    *((speed, "fast") for speed in ("full speed", "normal speed", "usual speed", "top speed", "normal pace")),
    *((speed, "brisk") for speed in ("half speed", "half pace")),
    *((speed, "careful") for speed in ("quarter speed", "low speed", "slow speed")),
)


class SetTempo(Skill):
    """Choose how fast the arm goes from now on."""

    name = "set_tempo"
    words = (
        # "work at half speed"
        Words(
            verbs=("go", "move", "work", "travel", "continue", "carry on", "keep going"),
            slots=(Slot(argument="tempo", kind="phrase", phrases=_SPEEDS),),
            required=("tempo",),
            pace="tempo",
        ),
        Words(
            verbs=("go back", "return", "switch"),
            slots=(Slot(argument="tempo", kind="phrase", phrases=tuple((f"to {said}", t) for said, t in _SPEEDS)),),
            required=("tempo",),
        ),
        *(
            Words(verbs=verbs, means=(("tempo", tempo),))
            for tempo, verbs in (
                ("careful", ("go slower", "move slower", "slow down", "be careful", "be gentle", "slower")),
                ("brisk", ("go half as fast", "move half as fast")),
                ("fast", ("go faster", "move faster", "speed up", "hurry up", "faster")),
            )
        ),
    )

    def run(self, ctx: SkillContext, *, tempo: Literal["careful", "brisk", "fast"]) -> SkillResult:
        """Move nothing; what each hand holds stays held.

        Args:
            tempo: Careful keeps to a share of the joints' limits that leaves a person time; brisk takes half of them, fast all.
        """
        before = ctx.tempo.name
        ctx.go_at(find_tempo(tempo))
        return SkillResult(skill=self.name, detail={"tempo": tempo, "before": before})
