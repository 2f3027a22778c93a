"""Set tempo: choose how fast the arm goes from now on."""

from __future__ import annotations

from typing import Literal

from robosandbox.skills.base import Skill
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import SkillResult, find_tempo

_GOES = (
    "go",
    "move",
    "work",
    "travel",
    "run",
    "drive",
    "do everything",
    "do it all",
    "continue",
    "carry on",
    "keep going",
)
_SPEEDS: dict[str, tuple[str, ...]] = {
    "careful": (
        "slower",
        *(
            f"{share} {whose}{usual}{pace}"
            for share in ("at a quarter of", "at a third of")
            for whose in ("the ", "your ")
            for usual in ("", "usual ", "normal ")
            for pace in ("speed", "pace")
        ),
        "at quarter speed",
        "at low speed",
        "at a slow speed",
        "at a slow pace",
        "slowly",
        "more slowly",
        "carefully",
        "more carefully",
        "gently",
    ),
    "brisk": (
        *(
            f"at half {whose}{usual}{pace}"
            for whose in ("", "the ", "your ")
            for usual in ("", "usual ", "normal ")
            for pace in ("speed", "pace")
        ),
        "at 50 % speed",
    ),
    "fast": (
        *(
            f"at {usual} {pace}"
            for usual in ("full", "normal", "your normal", "your usual", "the usual", "top")
            for pace in ("speed", "pace")
        ),
        "as fast as you can",
        "as fast as is safe",
        "normally again",
        "fast",
        "faster",
    ),
}
_BACK = ("return to", "go back to", "switch to", "use", "set")


def _verbs(tempo: str, also: tuple[str, ...]) -> tuple[str, ...]:
    """Return verbs that choose a tempo, as "work at half speed" and "back to normal speed"."""
    ways = _SPEEDS[tempo]
    named = tuple(each.removeprefix("at ") for each in ways if each.endswith((" speed", " pace")))
    return (
        *also,
        *(f"{go} {how}" for go in _GOES for how in ways),
        *(f"{back} {speed}" for back in _BACK for speed in named),
    )


class SetTempo(Skill):
    """Choose how fast the arm goes from now on."""

    name = "set_tempo"
    words = tuple(
        Words(verbs=_verbs(tempo, also), means=(("tempo", tempo),))
        for tempo, also in (
            ("careful", ("slow down", "be careful", "be gentle", "slower")),
            ("brisk", ("go half as fast", "move half as fast")),
            ("fast", ("speed up", "hurry up", "faster")),
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
