"""Move to height: the hand goes straight up or down to so much above the table."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from robosandbox.skills.primitives.hand_move import GOES_ON, HAND_GOES, HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import Pose, SkillResult

_ENDS = (
    *(
        f"{until} {who} {about}".strip()
        for until in ("until", "till")
        for who in ("you are", "it is", "your hand is", "the hand is", "the fingertips are", "the tip is", "you reach")
        for about in ("", "about")
    ),
    *("to", "to about", "at", "down to", "up to", "at about", "to a height of", "at a height of"),
)
_OVER = tuple(
    (f"{over} {table}", 1.0)
    for over in ("above", "over", "off", "from")
    for table in ("the table", "table", "the tabletop", "the table top")
)


_HEIGHT = Slot(argument="height", kind="length", prepositions=_ENDS, endings=_OVER, bare=False)
AT_A_HEIGHT = Slot(
    argument="height",
    kind="length",
    prepositions=(
        *("to a height of", "at a height of", "to height", "to a level of", "at an altitude of", "at z", "at z ="),
        *(
            f"{kept} {steady}"
            for kept in ("at", "keeping", "keeping at", "maintaining", "staying at", "holding")
            for steady in ("a constant height of", "a steady height of", "a fixed height of", "the same height of")
        ),
        *("keeping a height of", "maintaining a height of", "staying at a height of"),
    ),
    endings=_OVER,
)
# "lift it to 20 cm": of what is lifted it is plain over what.
_TO = Slot(argument="height", kind="length", prepositions=("to", "up to", "down to", "to about"))
_SECONDS = Slot(argument="seconds", kind="duration", prepositions=("for", "for about"))
OF_THE_HAND = Slot(argument="height", kind="length", prepositions=("", *_ENDS), endings=_OVER, bare=False)


class MoveToHeight(HandMove):
    """Bring the hand to a height."""

    name = "move_to_height"
    words = (
        Words(
            verbs=(
                *HAND_GOES,
                *(f"{goes} {way}" for goes in HAND_GOES for way in ("down", "up")),
                *(f"{verb} {{}}" for verb in ("lower", "raise", "lift", "hold", "keep")),
                *(
                    "descend",
                    "lower",
                    "raise",
                    "rise",
                    "climb",
                    "sink",
                    "stop",
                    "hover",
                    "stay",
                    "wait",
                    "finish",
                    "end",
                    "end up",
                    "park",
                ),
            ),
            body="hand",
            slots=(OF_THE_HAND, AT_A_HEIGHT, _SECONDS),
            required=("height",),
        ),
        Words(
            verbs=("lower", "lift", "raise", "hold", "bring", "lower {} down"),
            object="held",
            slots=(_HEIGHT, AT_A_HEIGHT, _TO, _SECONDS),
            required=("height",),
            hand="holding",
        ),
        Words(
            verbs=tuple(f"{verb} {{}}" for verb in ("lower", "raise", "lift")),
            body="hand",
            slots=(_TO, _SECONDS),
            required=("height",),
        ),
        # "go down to 8 cm, carry on down to 4"
        Words(
            verbs=tuple(f"{goes} {way}" for goes in (*HAND_GOES, *GOES_ON) for way in ("down", "up")),
            body="hand",
            slots=(Slot(argument="height", kind="length", prepositions=("to", "to about"), endings=_OVER), _SECONDS),
            required=("height",),
        ),
        # "hold it 6 cm above the table", but "lift it 6 cm off the table" is by so much.
        Words(
            verbs=("hold", "keep", "hold up", "hold {} up", "hold {} still"),
            object="held",
            slots=(OF_THE_HAND, AT_A_HEIGHT, _SECONDS),
            required=("height",),
            hand="holding",
        ),
    )

    def run(
        self,
        ctx: SkillContext,
        *,
        height: Annotated[float, Field(ge=0.0, le=3.0)],
        held: str | None = None,
        seconds: Annotated[float, Field(ge=0.0, le=3600.0)] = 0.0,
    ) -> SkillResult:
        """Move the tool centre point straight up or down to a height without turning the hand; what it holds stays held.

        Args:
            height: Above the table, metres; with `held` of the underside of what is held.
            held: Id of what is held.
            seconds: How long it stays there.

        Raises:
            UnreachableError: The hand cannot go there in a straight line.
            CollisionError: Something is in the way.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        here = arm.state.tcp_pose
        hangs = 0.0 if held is None else arm.hangs
        goal = Pose(xyz=(*here.xyz[:2], arm.start.table_height + height + hangs), quat_xyzw=here.quat_xyzw)
        way = arm.kept_level(arm.motion.plan_line(arm.q, goal, speed=arm.speed))
        detail = arm.arrive(way, goal)
        if seconds > 0.0:
            arm.driver.wait(seconds)
        return SkillResult(skill=self.name, detail=detail)
