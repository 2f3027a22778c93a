"""Turn hand: turn or tilt the hand where it is."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field

from robosandbox.skills.primitives.hand_move import HANDS, HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import SENSES, Slot, Words
from robosandbox.types import Pose, SkillResult, matrix_about_axis

_Angle = Annotated[float, Field(ge=-math.pi, le=math.pi)]
_WRISTS = (*HANDS, "the wrist", "your wrist")

_LEANING = tuple(
    (f"{said}{by}", sign)
    for said, sign in (("forward", 1.0), ("forwards", 1.0), ("back", -1.0), ("backward", -1.0), ("backwards", -1.0))
    for by in ("", " by")
)


class TurnHand(HandMove):
    """Turn or tilt the hand where it is."""

    name = "turn_hand"
    words = (
        Words(
            verbs=tuple(
                f"{verb} {what}" for verb in ("turn", "rotate", "twist", "spin", "roll", "swivel") for what in _WRISTS
            ),
            slots=(
                Slot(
                    argument="angle",
                    kind="angle",
                    prepositions=("", "by"),
                    phrases=(
                        ("a quarter turn", math.pi / 2.0),
                        ("a quarter of a turn", math.pi / 2.0),
                        ("half a turn", math.pi),
                        ("a half turn", math.pi),
                    ),
                    beginnings=SENSES,
                    endings=SENSES,
                ),
            ),
            required=("angle",),
        ),
        Words(
            verbs=tuple(f"{verb} {what}" for verb in ("tilt", "incline") for what in _WRISTS),
            slots=(
                Slot(
                    argument="tilt",
                    kind="angle",
                    prepositions=("", "by"),
                    beginnings=_LEANING,
                    endings=_LEANING,
                ),
            ),
            required=("tilt",),
        ),
    )

    def run(self, ctx: SkillContext, *, angle: _Angle = 0.0, tilt: _Angle = 0.0) -> SkillResult:
        """Turn the hand about the tool centre point, which stays where it is; what it holds stays held.

        Args:
            angle: About the vertical, rad; counterclockwise seen from above is positive.
            tilt: About the axis along which the fingers close, after the turn, rad; the fingertips go away from the base where positive.

        Raises:
            UnreachableError: The hand cannot stand so.
            CollisionError: Something is in the way.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        here = arm.state.tcp_pose
        turned = matrix_about_axis(np.array([0.0, 0.0, 1.0]), angle) @ here.rotation
        away = np.array([*(here.position[:2] - np.array(arm.start.base_xy)), 0.0])
        axis = turned[:, 1]
        # The tips go along the axis crossed with where the hand points.
        sense = 1.0 if np.cross(axis, turned[:, 2]) @ away >= 0.0 else -1.0
        goal = Pose.from_matrix(here.position, matrix_about_axis(axis, sense * tilt) @ turned)
        return SkillResult(skill=self.name, detail=arm.arrive(arm.way_to(arm.standing_at(goal)), goal))
