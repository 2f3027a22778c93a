"""Set tempo: choose how fast the arm goes from now on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from robosandbox.skills.base import Skill
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import SkillResult, find_tempo

_SPEEDS = (
    *(
        (speed, "fast")
        for speed in (
            "full speed",
            "normal speed",
            "usual speed",
            "top speed",
            "normal pace",
            "normal",
            "the normal speed",
            "your normal speed",
            "your usual speed",
            "the usual speed",
        )
    ),
    *((f"half {your}{speed}", "brisk") for your in ("", "the ", "your ") for speed in ("speed", "pace", "tempo")),
    *((speed, "careful") for speed in ("quarter speed", "low speed", "slow speed")),
)
# "to 50 %"
_SHARES_OF_SPEED = tuple(
    (f"{to}{share}{of}", tempo)
    for to in ("to ", "at ")
    for share, tempo in (
        *(("50 %", "brisk"), ("50 percent", "brisk"), ("half", "brisk"), ("100 %", "fast"), ("100 percent", "fast")),
        *(
            ("25 %", "careful"),
            ("25 percent", "careful"),
            ("a quarter", "careful"),
            ("slow", "careful"),
            ("low", "careful"),
        ),
        *(("fast", "fast"), ("normal", "fast"), ("maximum", "fast"), ("full", "fast")),
    )
    for of in ("", " speed", " of normal", " of the normal speed", " of your normal speed", " of full speed")
)
_LIMITS = ("limit", "set", "keep", "cap", "restrict", "change", "reduce", "lower", "raise")
_OF_THE_HAND = tuple(
    f"{of}{what}".strip()
    for of in ("", "tool ", "tcp ", "hand ", "arm ", "travel ", "movement ")
    for what in ("speed", "top speed", "maximum speed", "max speed", "pace", "velocity")
)


def _pacing(verbs: Sequence[str], *hows: str) -> tuple[str, ...]:
    """Return how people ask for another pace: "go a bit slower", "slow down a little"."""
    some = ("a bit", "a little", "a little bit", "much", "even", "a lot")
    compared = [f"{much} {how}".strip() for how in hows for much in ("", *some)]
    return (
        *(f"{go} {how}" for how in compared for go in ("go", "move", "work")),
        *hows,
        *(f"{verb} {much}".strip() for verb in verbs for much in ("", "again", *some)),
    )


def _alone(tempo: str) -> tuple[str, ...]:
    """Return how people name a pace without a verb, or with one that says that it is not the present one."""
    # An article is no verb, nor is an adjective alone.
    named = [
        said
        for said, meant in _SPEEDS
        if meant == tempo and (len(said.split()) == 2 or said.startswith("half ")) and not said.startswith("the ")
    ]
    return tuple(f"{before} {said}".strip() for said in named for before in ("", "back to", "resume", "use"))


class SetTempo(Skill):
    """Choose how fast the arm goes from now on."""

    name = "set_tempo"
    words = (
        # "work at half speed"
        Words(
            verbs=(
                "go",
                "move",
                "work",
                "run",
                "operate",
                "drive",
                "proceed",
                "travel",
                "continue",
                "carry on",
                "keep going",
                "do everything",
                "do it all",
            ),
            slots=(Slot(argument="tempo", kind="phrase", phrases=_SPEEDS),),
            required=("tempo",),
            pace="tempo",
        ),
        Words(
            verbs=("go back", "return", "switch"),
            slots=(Slot(argument="tempo", kind="phrase", phrases=tuple((f"to {said}", t) for said, t in _SPEEDS)),),
            required=("tempo",),
        ),
        # "never go faster than 10 cm per second"
        Words(
            verbs=(
                *(
                    f"{never} {go} faster than"
                    for never in ("never", "do not")
                    for go in ("go", "move", "work", "travel")
                ),
                *(
                    f"{set_it} {whose}{speed}"
                    for set_it in _LIMITS
                    for whose in ("your ", "the ", "")
                    for speed in _OF_THE_HAND
                ),
                *(f"{to}" for to in ("slow down to", "speed up to")),
            ),
            slots=(Slot(argument="tempo", kind="speed", prepositions=("", "to", "at", "below", "under")),),
            required=("tempo",),
        ),
        Words(
            verbs=(
                *(
                    f"{set_it} {whose} {speed}"
                    for set_it in _LIMITS
                    for whose in ("your", "the")
                    for speed in _OF_THE_HAND
                ),
                "slow down",
                "speed up",
            ),
            slots=(
                Slot(
                    argument="tempo",
                    kind="phrase",
                    phrases=(*_SHARES_OF_SPEED, *((f"to {said}", t) for said, t in _SPEEDS)),
                ),
            ),
            required=("tempo",),
        ),
        *(
            Words(verbs=verbs, means=(("tempo", tempo),))
            for tempo, verbs in (
                (
                    "careful",
                    (
                        *_pacing(("slow down", "be careful", "be gentle"), "slower", "gentler", "more slowly"),
                        *_alone("careful"),
                    ),
                ),
                ("brisk", ("go half as fast", "move half as fast", *_alone("brisk"))),
                ("fast", (*_pacing(("speed up", "hurry up"), "faster", "more quickly"), *_alone("fast"))),
            )
        ),
    )

    def run(
        self,
        ctx: SkillContext,
        *,
        tempo: Annotated[str, Field(pattern=r"^(careful|brisk|fast|\d+(\.\d+)? (m/s|s|%))$")],
    ) -> SkillResult:
        """Move nothing; what each hand holds stays held.

        Args:
            tempo: Careful keeps to a share of the joints' limits that leaves a person time; brisk takes half of them, fast all, "20 %" so much; a speed
                as "0.1 m/s" is one that the tool centre point does not pass, a time as "8 s" one that each motion takes at least.
        """
        before = ctx.tempo.name
        ctx.go_at(find_tempo(tempo))
        return SkillResult(skill=self.name, detail={"tempo": tempo, "before": before})
