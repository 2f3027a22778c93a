"""Trace: move the hand along a circle or a polygon."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from robosandbox.skills.move_to_height import AT_A_HEIGHT, OF_THE_HAND
from robosandbox.skills.primitives.hand_move import HAND_GOES, HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import ROUNDS, Slot, Words
from robosandbox.types import Array, Pose, SkillResult

ShapeName = Literal["circle", "square", "triangle", "pentagon", "hexagon", "eight"]
# Corners of each; a circle's chords are off it by a 500th of its radius.
_CORNERS: dict[str, int] = {"circle": 50, "square": 4, "triangle": 3, "pentagon": 5, "hexagon": 6, "eight": 50}
# What goes without corners.
_ROUND = frozenset({"circle", "eight"})
_CALLED: tuple[tuple[str, ShapeName], ...] = (
    *((name, name) for name in ("circle", "square", "triangle", "pentagon", "hexagon")),
    *(
        (said, "eight")
        for said in ("figure eight", "figure of eight", "figure 8", "eight", "infinity sign", "infinity symbol")
    ),
)
_SHAPES = tuple(
    (f"{before} {called}{there}".strip(), name)
    for called, name in _CALLED
    for before in (
        "",
        "a",
        "an",
        "in a",
        "along a",
        "around in a",
        "wide",
        "one",
        "the shape of a",
        "in the shape of a",
    )
    for there in ("", " in the air", " in the air in front of you", " in front of you")
)
_LEVEL = (
    "in a level plane",
    "in a horizontal plane",
    "in the horizontal plane",
    "level",
    "flat",
    "horizontal",
    "flat like a plate",
    "horizontally",
    "level with the table",
    "parallel to the table",
    "and keep it flat",
    "and keep it level",
    "keep it flat",
)
_UPRIGHT = (
    "in a vertical plane",
    "in the vertical plane",
    "in an upright plane",
    "upright",
    "vertical",
    "standing",
    "vertically",
    "facing me",
    "facing you",
    "facing yourself",
    "standing up",
    "like a wheel",
)
_PLANES = (*((said, "level") for said in _LEVEL), *((said, "upright") for said in _UPRIGHT))
_SIZED = tuple(
    (said, number)
    for number, words in (
        (
            1.0,
            (
                "of",
                "sides",
                "sides of",
                "side",
                "each side",
                "with a diameter of",
                "with sides of",
                "with",
                "a",
                "an",
                "in a",
                "about",
                "roughly",
                "of about",
                "diameter",
                "size",
            ),
        ),
        (2.0, ("with a radius of", "of radius", "with radius", "radius")),
    )
    for said in words
)


_ACROSS = tuple(
    (said, 1.0)
    for said in (
        "across",
        "wide",
        "big",
        "in size",
        "long",
        "in diameter",
        "diameter",
        "sides",
        "on each side",
        "on a side",
        "a side",
        "each side",
    )
)


# What people compare a size with, metres across; usual sizes of each. And what is small or big in the air before an arm, unless
# a size is told.
_LIKENED = (
    *(
        (f"{about}{as_big} {thing}", size)
        for thing, size in (
            *(
                ("a coin", 0.025),
                ("a saucer", 0.15),
                ("a plate", 0.25),
                ("a dinner plate", 0.27),
                ("a side plate", 0.18),
            ),
            *(("a football", 0.22), ("an apple", 0.08), ("an orange", 0.08), ("a tennis ball", 0.067), ("a cd", 0.12)),
            *(("a mug", 0.08), ("a cup", 0.08), ("a hand", 0.18), ("a fist", 0.1)),
        )
        for about in ("", "about ", "roughly ")
        for as_big in ("as big as", "as wide as", "as large as", "the size of")
    ),
)
_VAGUELY = (
    *((f"that is {small}", 0.06) for small in ("small", "little", "tiny")),
    *((f"that is {big}", 0.2) for big in ("big", "large", "huge", "wide")),
)


class Trace(HandMove):
    """Move the hand along a figure."""

    name = "trace"
    words = Words(
        verbs=("draw", "trace", "make", "do", "sketch", "draw me", "trace me", "sketch me", *HAND_GOES),
        body="hand",
        alone=True,
        slots=(
            Slot(argument="shape", kind="phrase", phrases=_SHAPES),
            Slot(
                argument="size",
                kind="length",
                prepositions=("of", "with a diameter of", "with sides of", "with", "about", "roughly", ""),
                beginnings=_SIZED,
                endings=(*_ACROSS, ("radius", 2.0), ("in radius", 2.0)),
                phrases=_VAGUELY,
            ),
            Slot(argument="size", kind="phrase", phrases=_LIKENED),
            Slot(
                argument="plane",
                kind="phrase",
                phrases=(*_PLANES, *((f"{a} {said}", plane) for a in ("a", "an", "in a") for said, plane in _PLANES)),
            ),
            OF_THE_HAND,
            AT_A_HEIGHT,
            Slot(argument="times", kind="number", endings=(("times", 1.0),), bare=False, phrases=ROUNDS),
        ),
        required=("shape",),
    )

    def run(
        self,
        ctx: SkillContext,
        *,
        shape: ShapeName,
        size: Annotated[float, Field(gt=0.0, le=1.0)] = 0.1,
        plane: Literal["level", "upright"] = "level",
        height: Annotated[float, Field(ge=0.0, le=3.0)] | None = None,
        times: Annotated[int, Field(ge=1, le=20)] = 1,
    ) -> SkillResult:
        """Move the tool centre point along a figure; what is held stays held.

        It begins and ends where the hand is, goes forward first, upright up, and lies to the left of there; an eight on both sides.

        Args:
            shape: The figure.
            size: Its diameter, or the length of its sides, metres; of an eight the diameter of each half.
            plane: Whether it is level, or upright from side to side.
            height: Above the table, metres, to which the hand goes straight up or down first; None begins where it is.
            times: How often it goes along it.

        Raises:
            UnreachableError: The hand cannot go there in straight lines.
            CollisionError: Something is in the way.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        here = arm.state.tcp_pose
        if height is not None:
            here = Pose(xyz=(*here.xyz[:2], arm.start.table_height + height), quat_xyzw=here.quat_xyzw)
            arm.arrive(arm.kept_level(arm.motion.plan_line(arm.q, here, speed=arm.speed)), here)
        corners = _figure(shape, size)
        if plane == "upright":
            corners = corners[:, [2, 1, 0]]
        points = [here.position + corner for corner in corners]
        poses = [Pose(xyz=tuple(point), quat_xyzw=here.quat_xyzw) for _ in range(times) for point in points]
        way = arm.kept_level(arm.motion.plan_through(arm.q, poses, speed=arm.speed))
        if shape in _ROUND:
            detail = arm.arrive(way, here)
        else:
            # An arm that does not stop cuts corners, or goes beyond them.
            *sides, last = poses
            for pose in sides:
                arm.arrive(arm.motion.plan_line(arm.q, pose, speed=arm.speed), pose)
            detail = arm.arrive(arm.motion.plan_line(arm.q, last, speed=arm.speed), last)
        return SkillResult(skill=self.name, detail={**detail, "shape": shape, "size_m": size})


def _figure(shape: str, size: float) -> Array:
    """Return the corners of a figure after the one at the origin, in order and back to it, metres, shape (n, 3)."""
    if shape == "eight":
        left = _figure("circle", size)
        return np.vstack([left, left * [1.0, -1.0, 1.0]])
    corners = _CORNERS[shape]
    # A circle's tangent is forward where it begins, and its first chord half a corner off that.
    side, first = (size * np.sin(np.pi / corners), 0.5) if shape == "circle" else (size, 0.0)
    headings = 2.0 * np.pi * (np.arange(corners) + first) / corners
    return np.cumsum(side * np.column_stack([np.cos(headings), np.sin(headings), np.zeros(corners)]), axis=0)
