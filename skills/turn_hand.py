"""Turn hand: turn or tilt the hand where it is."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field

from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import A_LITTLE_TURN, SENSES, TURNS, Slot, Words
from robosandbox.types import Array, Pose, SkillResult, matrix_about_axis

_Angle = Annotated[float, Field(ge=-math.pi, le=math.pi)]
_LEANING = tuple(
    (f"{said}{by}", sign)
    for said, sign in (
        *(
            (f"{away} {you}", 1.0)
            for away in ("away from", "forward away from")
            for you in ("you", "your base", "the base")
        ),
        *(
            (f"{towards} {you}", -1.0)
            for towards in ("towards", "back towards")
            for you in ("you", "your base", "the base")
        ),
        *((f"{towards} the far side{of}", 1.0) for towards in ("towards", "to") for of in ("", " of the table")),
        ("forward", 1.0),
        ("forwards", 1.0),
        ("back", -1.0),
        ("backward", -1.0),
        ("backwards", -1.0),
    )
    for by in ("", " by", " from vertical", " from the vertical", " away from vertical")
)
_TURNS = (
    *TURNS,
    ("a quarter", math.pi / 2.0),
    ("upside down", math.pi),
    *(
        (said, A_LITTLE_TURN)
        for said in ("a little turn", "a small turn", "a slight turn", "a little", "a bit", "slightly")
    ),
)


_SIDEWAYS = tuple(
    (f"{to}{side}{by}", sign)
    for to in ("to the ", "", "to your ")
    for side, sign in (("left", 1.0), ("right", -1.0), ("side", 1.0))
    for by in ("", " by", " from vertical")
    if to or side != "side"
) + (
    *(("sideways", 1.0), ("over sideways", 1.0), ("sideways by", 1.0)),
    *((f"{over}to one side{by}", 1.0) for over in ("", "over ") for by in ("", " by")),
)
# What is plainly seen to lean, rad.
_PLAINLY = math.radians(45.0)
# Length of a level part of a unit vector from which on it tells a direction.
_LEAST = 0.1
_STRAIGHT = (
    *(f"{point} {{}} straight down" for point in ("point", "turn", "aim", "hold", "keep", "face", "make")),
    *(
        f"{level} {{}} {out}"
        for level in ("straighten", "level")
        for out in ("out", "up", "again", "out again", "up again")
    ),
    *(f"{level} {{}}" for level in ("straighten", "straighten out", "straighten up", "level", "level out")),
    *(
        f"{make} {{}} {upright}"
        for make in ("make", "hold", "keep", "bring", "put", "turn")
        for upright in ("vertical", "upright", "level", "straight", "back upright")
    ),
    *(
        *(
            f"bring it {back}"
            for back in ("back level", "back upright", "upright again", "back straight", "level again")
        ),
        "straighten it",
        "straighten it again",
        "straighten up again",
        "straighten again",
        "upright again",
        "straighten up",
        "straighten out",
        "straighten it back up",
    ),
    *(f"point straight down {with_it}" for with_it in ("with your hand", "with the hand", "")),
)
_DOWN = (
    *(f"{pointing}{down}" for pointing in ("", "pointing ") for down in ("straight down", "down", "vertically down")),
    *("vertical", "upright", "perpendicular to the table", "straight down at the table"),
)
_FORWARD = tuple(
    f"point {{}} {forward}{level}"
    for forward in ("forward", "forwards", "straight ahead", "ahead", "to the horizon", "at the horizon")
    for level in ("", " level with the table", " parallel to the table", " horizontally")
)
_TO_THE_HORIZON = tuple(
    f"{sideways}{so}{the} {fingers} {point} {forward}"
    for sideways in ("", "sideways ", "level ", "forward ")
    for so in ("so ", "so that ", "until ")
    for the in ("the", "your")
    for fingers in ("fingers", "fingertips", "tips")
    for point in ("point", "are pointing", "look")
    for forward in ("forward", "forwards", "straight ahead", "to the horizon", "at the horizon", "straight forward")
)
_SOME = (("a little", A_LITTLE_TURN), ("a bit", A_LITTLE_TURN), ("slightly", A_LITTLE_TURN))


class TurnHand(HandMove):
    """Turn or tilt the hand where it is."""

    name = "turn_hand"
    words = (
        Words(
            verbs=(
                *("turn", "rotate", "twist", "spin", "roll", "swivel", "yaw", "spin round"),
                *("give {}", "turn {} round", "turn {} around", "spin {} round", "rotate {} round"),
            ),
            nouns=("turn", "rotation", "twist", "spin"),
            body="wrist",
            slots=(
                Slot(
                    argument="angle",
                    kind="angle",
                    prepositions=("", "by", "through"),
                    phrases=_TURNS,
                    beginnings=SENSES,
                    endings=SENSES,
                ),
            ),
            required=("angle",),
        ),
        Words(
            verbs=("tilt", "incline", "lean", "tip", "pitch", "tilt over", "lean over", "tilt {} over", "lean {} over"),
            nouns=("tilt",),
            body="wrist",
            slots=(
                Slot(
                    argument="tilt",
                    kind="angle",
                    prepositions=("", "by"),
                    phrases=_SOME,
                    beginnings=_LEANING,
                    endings=(*_LEANING, ("from vertical", 1.0), ("from the vertical", 1.0), ("off vertical", 1.0)),
                ),
            ),
            required=("tilt",),
        ),
        Words(
            verbs=(
                "tilt",
                "incline",
                "lean",
                "tip",
                "bank",
                "tilt over",
                "lean over",
                "tilt {} over",
                "lean {} over",
                "tip {} over",
            ),
            body="wrist",
            slots=(
                Slot(
                    argument="sideways",
                    kind="angle",
                    prepositions=("", "by"),
                    phrases=tuple((said, sign * _PLAINLY) for said, sign in _SIDEWAYS if not said.endswith("by")),
                    beginnings=_SIDEWAYS,
                    endings=_SIDEWAYS,
                    bare=False,
                ),
            ),
            required=("sideways",),
        ),
        Words(verbs=_STRAIGHT, body="wrist", means=(("upright", True),)),
        # "I want the hand pointing straight down", "hand vertical"
        Words(
            verbs=tuple(f"{have} {{}}" for have in ("have", "keep", "get", "bring")),
            body="wrist",
            alone=True,
            slots=(Slot(argument="upright", kind="phrase", phrases=tuple((said, 1.0) for said in _DOWN)),),
            required=("upright",),
        ),
        Words(verbs=_FORWARD, body="wrist", means=(("upright", True), ("tilt", math.pi / 2.0))),
        Words(
            verbs=tuple(f"{turn} {{}}" for turn in ("turn", "tilt", "tip", "rotate", "point", "bring")),
            body="wrist",
            slots=(
                Slot(argument="tilt", kind="phrase", phrases=tuple((said, math.pi / 2.0) for said in _TO_THE_HORIZON)),
            ),
            required=("tilt",),
            means=(("upright", True),),
        ),
    )

    def run(
        self,
        ctx: SkillContext,
        *,
        angle: _Angle = 0.0,
        tilt: _Angle = 0.0,
        sideways: _Angle = 0.0,
        upright: bool = False,
    ) -> SkillResult:
        """Turn the hand about the tool centre point, which stays where it is; what it holds stays held.

        Args:
            angle: About the vertical, rad; counterclockwise seen from above is positive.
            tilt: About the level line across that from the base to the hand, after the turn, rad; the fingertips go away from the base
                where positive.
            sideways: About the horizontal line from the base to the hand, after both, rad; the fingertips go to the left where positive,
                as seen from the base.
            upright: Whether it is to point straight down, however it is tilted now, before it is turned and tilted.

        Raises:
            UnreachableError: The hand cannot stand so.
            CollisionError: Something is in the way.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        here = arm.state.tcp_pose
        if upright and not (angle or tilt or sideways):
            return SkillResult(skill=self.name, detail=arm.bring(here.xyz))
        rotation = _straight_down(here.rotation) if upright else here.rotation
        turned = matrix_about_axis(np.array([0.0, 0.0, 1.0]), angle) @ rotation
        away = np.array([*(here.position[:2] - np.array(arm.start.base_xy)), 0.0])
        level = away / np.linalg.norm(away) if away.any() else np.array([1.0, 0.0, 0.0])
        left = np.cross([0.0, 0.0, 1.0], level)
        leaning = matrix_about_axis(level, sideways) @ matrix_about_axis(left, -tilt) @ turned
        goal = Pose.from_matrix(here.position, leaning)
        return SkillResult(skill=self.name, detail=arm.arrive(arm.way_to(arm.standing_at(goal)), goal))


def _straight_down(rotation: Array) -> Array:
    """Return a hand's rotation (3, 3) without its tilt: straight down, the fingers closing as nearly along the same line as they can."""
    down, closing = np.array([0.0, 0.0, -1.0]), rotation[:, 1] * (1.0, 1.0, 0.0)
    if np.linalg.norm(closing) < _LEAST:
        closing = np.cross(down, rotation[:, 0])
    closing = closing / np.linalg.norm(closing)
    return np.column_stack([np.cross(closing, down), closing, down])
