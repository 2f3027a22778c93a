"""Set tempo: choose how fast the arm goes from now on."""

from __future__ import annotations

from typing import Literal

from robosandbox.skills.base import Skill
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import SkillResult, find_tempo


class SetTempo(Skill):
    """Choose how fast the arm goes from now on."""

    name = "set_tempo"
    words = tuple(
        Words(verbs=verbs, means=(("tempo", tempo),))
        for tempo, verbs in (
            (
                "careful",
                (
                    "go slower",
                    "slow down",
                    "move slower",
                    "go slowly",
                    "be careful",
                    "be gentle",
                    "slower",
                ),
            ),
            ("brisk", ("go half as fast", "move half as fast")),
            (
                "fast",
                (
                    "go faster",
                    "move faster",
                    "speed up",
                    "hurry up",
                    "faster",
                    "go at normal speed",
                    "move at normal speed",
                ),
            ),
        )
    )

    def run(self, ctx: SkillContext, *, tempo: Literal["careful", "brisk", "fast"]) -> SkillResult:
        """Move nothing; what each hand holds stays held.

        Args:
            tempo: Careful keeps to a share of the joints' limits that leaves a person time; brisk takes half of them, fast all.
        """
        before = ctx.tempo.name
        ctx.go_at(find_tempo(tempo))
        return SkillResult(skill=self.name, detail={"tempo": tempo, "before": before})
