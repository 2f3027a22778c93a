"""Move to: bring the hand to a pose."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from robosandbox.skills.primitives.hand_move import HAND_GOES, HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import SkillResult

_TO = Slot(
    argument="x y z",
    kind="point",
    prepositions=(
        *("", "to", "to position", "to the position", "to point", "to the point", "through"),
        *(
            f"{to} {these} points {so}".rstrip()
            for to in ("through", "to", "along")
            for these in ("these", "the", "the following")
            for so in ("", ":", "one after the other", "one after the other :", "in turn :", "in order :")
        ),
    ),
)
_FROM = Slot(
    argument="from_x from_y from_z",
    kind="point",
    prepositions=("from", "starting at", "starting from", "from the point", "from point"),
)
_LINES = tuple(
    f"{verb} a {straight}line"
    for verb in ("draw", "trace", "follow", "go along", "move along", "run along")
    for straight in ("", "straight ")
)


class MoveTo(HandMove):
    """Move the hand to a pose."""

    name = "move_to"
    words = (
        Words(
            verbs=(*HAND_GOES, "visit", "go through"),
            body="hand",
            slots=(
                _TO,
                _FROM,
                Slot(
                    argument="straight",
                    kind="phrase",
                    phrases=(("in a straight line", True), ("straight", True), ("linearly", True)),
                ),
            ),
            required=("x y z",),
        ),
        # "follow a straight line from (a) to (b)"
        Words(verbs=_LINES, body="hand", slots=(_TO, _FROM), required=("x y z",), means=(("straight", True),)),
    )

    def run(
        self,
        ctx: SkillContext,
        *,
        x: float,
        y: float,
        z: float,
        heading: float | None = None,
        tilt: Annotated[float, Field(ge=0.0, le=np.pi)] = 0.0,
        towards: float = 0.0,
        straight: bool = False,
        from_x: float | None = None,
        from_y: float | None = None,
        from_z: float | None = None,
    ) -> SkillResult:
        """Move the tool centre point to a place on a free way, the hand pointing down or tilted; what it holds stays held.

        Args:
            x: Forward from the world's origin, metres.
            y: To the left, metres.
            z: Up, metres.
            heading: Direction in which the fingers close about the vertical, before the hand tilts, rad from x; as it is when left out.
            tilt: Angle between the hand's approach and straight down, rad; 1.5708 points it level.
            towards: Direction into which the hand points when it is tilted, rad from x.
            straight: Whether the tool centre point goes in a straight line.
            from_x: Where that line begins: the tool centre point is brought there first; where it is when left out.
            from_y: The same.
            from_z: The same.

        Raises:
            UnreachableError: The hand cannot be there.
            CollisionError: Something is in the way.
            LimitError: It is outside of the workspace.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        if from_x is not None and from_y is not None and from_z is not None:
            Mover(ctx).bring((from_x, from_y, from_z), heading=heading, tilt=tilt, towards=towards, straight=False)
            straight = True
        place = Mover(ctx).bring((x, y, z), heading=heading, tilt=tilt, towards=towards, straight=straight)
        return SkillResult(skill=self.name, detail=place)
