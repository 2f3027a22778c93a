"""Move towards: the hand goes some way to a thing, or away from it."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.skills.primitives.hand_move import HAND_GOES, HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import Pose, SkillResult
from robosandbox.world.relations import centre

# Metres between the hand and the middle of a thing, level, below which it is over it.
_OVER = 0.005
# Metres that it goes where nobody says how far.
_SOME = 0.05


class MoveTowards(HandMove):
    """Move the hand some way to a thing."""

    name = "move_towards"
    words = (
        Words(
            verbs=HAND_GOES,
            body="hand",
            slots=(
                Slot(argument="distance", kind="length", prepositions=("", "by")),
                Slot(
                    argument="object",
                    kind="object",
                    prepositions=("towards", "toward", "closer to", "nearer to", "nearer", "up to"),
                ),
            ),
            required=("object",),
        ),
        Words(
            verbs=HAND_GOES,
            body="hand",
            slots=(
                Slot(argument="distance", kind="length", beginnings=(("", -1.0), ("by", -1.0)), bare=False),
                Slot(argument="object", kind="object", prepositions=("away from",)),
            ),
            required=("object",),
            means=(("distance", -_SOME),),
        ),
    )

    def run(
        self, ctx: SkillContext, *, object: str, distance: Annotated[float, Field(ge=-2.0, le=2.0)] = _SOME
    ) -> SkillResult:
        """Move the tool centre point level and straight towards the middle of a thing, without turning; what it holds stays held.

        Args:
            object: Id of the thing.
            distance: How far, metres; away from it where negative.

        Raises:
            ObjectNotFoundError: It is not seen.
            InvalidArgumentError: The hand is right over it, so that no way leads towards it.
            UnreachableError: The hand cannot go there in a straight line.
            CollisionError: Something is in the way.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        here = arm.state.tcp_pose
        way = (centre(arm.find(object)) - here.position)[:2]
        far = float(np.linalg.norm(way))
        if far < _OVER:
            raise InvalidArgumentError(
                f"object: the hand is over {object} already, and no level way leads towards it or away",
                phase=Phase.CHECK,
            )
        step = np.array([*(distance / far * way), 0.0])
        goal = Pose(xyz=tuple(here.position + step), quat_xyzw=here.quat_xyzw)
        return SkillResult(skill=self.name, detail=arm.arrive(arm.motion.plan_line(arm.q, goal, speed=arm.speed), goal))
