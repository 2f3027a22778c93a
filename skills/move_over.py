"""Move over: bring the hand, and what it holds, over a thing."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from robosandbox.skills.primitives.hand_move import HAND_GOES, HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import SkillResult
from robosandbox.world.relations import centre, top

_TOP = tuple(
    f"{over} the {part} of"
    for over in ("over", "above", "from", "off")
    for part in ("top", "top face", "top side", "top surface", "upper face", "centre", "center", "middle")
)
_STEADY = ("", "still", "steady", "motionless")


def _over(*prepositions: str) -> tuple[Slot, ...]:
    return (
        Slot(argument="object", kind="object", prepositions=prepositions),
        Slot(
            argument="height",
            kind="length",
            prepositions=(
                "",
                "by",
                "at",
                "to",
                "to a point",
                "to a spot",
                "to a place",
                "at a point",
                "to about",
                "about",
                "to within",
                "within",
                "at a height of",
            ),
            endings=(("up", 1.0), ("higher", 1.0), ("away", 1.0)),
        ),
        Slot(argument="seconds", kind="duration", prepositions=("for",)),
    )


_BETWEEN = tuple(
    f"{over}{between}"
    for over in ("", "over ", "to ", "above ")
    for between in (
        "halfway between",
        "half way between",
        "midway between",
        "between",
        "the middle between",
        "the midpoint between",
        "the point between",
        "the midpoint of",
    )
)


# Times that the hand is sent over things in one call, as orders are done over.
_MOST_PASSES = 40
# What may come before a count.
_UNTIL = (
    "",
    *(
        f"until {who} {did}".strip()
        for who in ("you have", "i have", "it has")
        for did in (
            "counted",
            "made",
            "done",
            "been at each one",
            "been at each",
            "been at each of them",
            "been over each",
        )
    ),
)


class MoveOver(HandMove):
    """Bring the hand over a thing."""

    name = "move_over"
    words = (
        Words(
            verbs=(
                *HAND_GOES,
                *("hover", "be", "stay", "stop", "wait", "hang", "linger", "remain", "line up", "rest", "pause"),
                *(f"{hold} {{}} {how}".rstrip() for hold in ("hold", "keep") for how in _STEADY),
                *("centre", "center", "centre {}", "center {}", "align", "align {}", "line {} up"),
            ),
            body="hand",
            slots=_over(
                *(
                    "over",
                    "above",
                    "to above",
                    "over to",
                    "to over",
                    "directly over",
                    "of",
                    "to",
                    "straight to",
                    "to a point above",
                ),
                *(
                    "to a point over",
                    "to a spot above",
                    "to the point above",
                    "to just above",
                    "just above",
                    "right above",
                ),
                *_TOP,
            ),
            required=("object",),
        ),
        # "home, above the red cube, home"
        Words(
            verbs=("hover",),
            body="hand",
            alone=True,
            slots=_over("over", "above", "directly over", "directly above", "right above", "just above"),
            required=("object",),
        ),
        Words(
            verbs=(
                "approach",
                "visit",
                "tour",
                "call at",
                "go see",
                "fly to",
                "check on",
                "go and see",
                "reach for",
                "reach out for",
                "reach towards",
            ),
            object="object",
            hand="any",
        ),
        # "go halfway between the red one and the green one"
        Words(
            verbs=(*HAND_GOES, "hover"),
            body="hand",
            slots=(
                Slot(argument="object other", kind="pair", prepositions=_BETWEEN),
                Slot(argument="height", kind="length", prepositions=("", "by", "at"), endings=(("up", 1.0),)),
            ),
            required=("object other",),
        ),
        # "swing back and forth between the red and the green cube three times"
        Words(
            verbs=tuple(
                f"{go} {to_and_fro}"
                for go in (
                    *("go", "move", "swing", "travel"),
                    *(f"keep {going}" for going in ("going", "moving", "swinging")),
                )
                for to_and_fro in ("back and forth between", "to and fro between")
            )
            + ("alternate between", "go between", "shuttle between", "move your hand back and forth between"),
            slots=(
                Slot(argument="object other", kind="pair"),
                Slot(
                    argument="passes",
                    kind="number",
                    prepositions=_UNTIL,
                    phrases=(("once", 2.0), ("twice", 4.0), ("a couple of times", 4.0), ("a few times", 6.0)),
                    endings=(
                        *((round_trips, 2.0) for round_trips in ("times", "time", "rounds", "visits", "times each")),
                        *((one_way, 1.0) for one_way in ("passes", "moves", "trips", "crossings", "swings", "legs")),
                    ),
                    bare=False,
                ),
            ),
            required=("passes",),
        ),
        Words(
            verbs=("hold", "keep"), object="held", slots=_over("over", "above"), required=("object",), hand="holding"
        ),
    )

    def run(
        self,
        ctx: SkillContext,
        *,
        object: str,
        height: Annotated[float, Field(ge=0.0, le=2.0)] = 0.1,
        held: str | None = None,
        seconds: Annotated[float, Field(ge=0.0, le=3600.0)] = 0.0,
        other: str | None = None,
        passes: Annotated[int, Field(ge=1, le=_MOST_PASSES)] | None = None,
    ) -> SkillResult:
        """Bring the hand over the middle of a thing, or halfway between two, on a free way, pointing down; what it holds stays held.

        Args:
            object: Id of the thing.
            height: From the thing's top to the tool centre point, or to the underside of what is held, metres.
            held: Id of what is to be held there; nothing, or whatever is held, when left out.
            seconds: How long it stays there.
            other: Id of the other thing, where it is halfway between two, and `height` from the higher one's top.
            passes: How many times it goes over one of the two, in turn, in place of halfway between them.

        Raises:
            ObjectNotFoundError: It is not seen.
            NotHoldingError: What is to be held there is not held.
            UnreachableError: The hand cannot be there.
            CollisionError: Something is in the way.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        below = arm.find(object)
        hangs = 0.0 if arm.start.held == object else arm.hangs
        ends = [below] if other is None else [below, arm.find(other)]
        # Over each in turn, or over the middle of all.
        stops = [[ends[number % len(ends)]] for number in range(passes)] if passes else [ends]
        detail: dict[str, float | str | bool] = {}
        for over in stops:
            x, y, _ = np.mean([centre(end) for end in over], axis=0)
            detail = arm.bring((float(x), float(y), max(map(top, over)) + height + hangs))
        if seconds > 0.0:
            arm.driver.wait(seconds)
        return SkillResult(skill=self.name, detail=detail)
