"""Move to height: the hand goes straight up or down to so much above the table."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from robosandbox.skills.primitives.hand_move import HAND_GOES, HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import Pose, SkillResult

_ENDS = ("until you are", "until it is", "until your hand is", "until the hand is", "to")
_OVER = tuple((f"{over} the table", 1.0) for over in ("above", "over", "off", "from"))


class MoveToHeight(HandMove):
    """Bring the hand to a height."""

    name = "move_to_height"
    words = Words(
        verbs=(*HAND_GOES, *(f"{goes} {way}" for goes in HAND_GOES for way in ("down", "up"))),
        slots=(Slot(argument="height", kind="length", prepositions=_ENDS, endings=_OVER, bare=False),),
        required=("height",),
    )

    def run(self, ctx: SkillContext, *, height: Annotated[float, Field(ge=0.0, le=3.0)]) -> SkillResult:
        """Move the tool centre point straight up or down to a height without turning the hand; what it holds stays held.

        Args:
            height: Above the table, metres.

        Raises:
            UnreachableError: The hand cannot go there in a straight line.
            CollisionError: Something is in the way.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        here = arm.state.tcp_pose
        goal = Pose(xyz=(*here.xyz[:2], arm.start.table_height + height), quat_xyzw=here.quat_xyzw)
        way = arm.kept_level(arm.motion.plan_line(arm.q, goal, speed=arm.speed))
        return SkillResult(skill=self.name, detail=arm.arrive(way, goal))
