"""Move beside: bring the hand, and what it holds, next to a thing."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from robosandbox.errors import CollisionError, UnreachableError
from robosandbox.skills.primitives.hand_move import HAND_GOES, HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import SIDE_AXES, Side, SkillResult
from robosandbox.world.relations import bounds, centre

# How each side is said behind a verb of the hand.
_SIDES: dict[Side, tuple[str, ...]] = {
    "front": ("in front of", "before", "to in front of"),
    "back": ("behind", "to behind"),
    "left": ("to the left of", "left of", "to the left side of", "on the left of", "on the left side of"),
    "right": ("to the right of", "right of", "to the right side of", "on the right of", "on the right side of"),
}


_DOWN = (
    *("come down", "go down", "move down", "get down", "descend"),
    *(f"{bring} {{}} down" for bring in ("bring", "put", "lower", "take", "move", "get", "place", "set")),
)
_BESIDE = (
    "next to",
    "beside",
    "alongside",
    *("right next to", "right beside", "right alongside", "just beside", "just next to"),
    "to the side of",
    "to next to",
    "close to",
    "near",
    "by the side of",
)
_OVER_TABLE = tuple(
    (f"{over} {table}", 1.0)
    for over in ("above", "over", "off", "from")
    for table in ("the table", "table", "the tabletop", "the table top", "the table surface")
)


def _said(prepositions: tuple[str, ...]) -> tuple[Slot, ...]:
    return (
        Slot(
            argument="distance",
            kind="length",
            prepositions=("", "by", "at", "with a gap of", "leaving", "with"),
            endings=(
                ("gap", 1.0),
                ("away", 1.0),
                ("away from it", 1.0),
                ("from it", 1.0),
                ("apart", 1.0),
                ("clear", 1.0),
                ("between", 1.0),
                ("of space", 1.0),
            ),
        ),
        Slot(argument="object", kind="object", prepositions=prepositions),
        Slot(argument="height", kind="length", prepositions=("", "at"), endings=_OVER_TABLE, bare=False),
    )


_ON_ITS_SIDE = Slot(
    argument="side",
    kind="phrase",
    phrases=tuple(
        (f"{on} {its} {side}{hand}", side)
        for on in ("on", "at", "to")
        for its in ("its", "the")
        for side in ("left", "right")
        for hand in ("", " side", " hand side")
    ),
)


class MoveBeside(HandMove):
    """Bring the hand next to a thing."""

    name = "move_beside"
    words = (
        *(
            Words(
                verbs=(*HAND_GOES, *_DOWN, "hover", "stop", "be", "stay"),
                body="hand",
                slots=_said(prepositions),
                required=("object",),
                means=(("side", side),),
            )
            for side, prepositions in _SIDES.items()
        ),
        Words(
            verbs=(*HAND_GOES, *_DOWN, "hover", "stop"),
            body="hand",
            slots=(*_said(_BESIDE), _ON_ITS_SIDE),
            required=("object",),
        ),
    )

    def run(
        self,
        ctx: SkillContext,
        *,
        object: str,
        side: Side | None = None,
        distance: Annotated[float, Field(ge=0.0, le=2.0)] = 0.1,
        height: Annotated[float, Field(ge=0.0, le=2.0)] | None = None,
    ) -> SkillResult:
        """Bring the hand next to a thing on a free way, pointing down; what it holds stays held.

        Args:
            object: Id of the thing.
            side: Of the thing, as the robot sees it; the first at which there is room, from the nearest on, when left out.
            distance: From the thing's side to the tool centre point, metres.
            height: Of the tool centre point, or of the underside of what is held, above the table, metres; that of the thing's top
                when left out.

        Raises:
            ObjectNotFoundError: It is not seen.
            UnreachableError: The hand cannot be there.
            CollisionError: Something is in the way.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        item = arm.find(object)
        least, most = bounds(item)
        z = float(most[2]) if height is None else arm.start.table_height + height
        places: list[tuple[float, float]] = []
        for one in SIDE_AXES if side is None else (side,):
            outward = np.array(SIDE_AXES[one])
            half = float(np.abs(outward) @ (most - least)[:2]) / 2.0
            x, y = centre(item)[:2] + (half + distance) * outward
            places.append((float(x), float(y)))
        here = arm.state.tcp_pose.xyz[:2]
        places.sort(key=lambda place: float(np.hypot(place[0] - here[0], place[1] - here[1])))
        failure: UnreachableError | CollisionError | None = None
        for x, y in places:
            try:
                return SkillResult(skill=self.name, detail=arm.bring((x, y, z + arm.hangs)))
            except (UnreachableError, CollisionError) as error:
                failure = failure or error
        assert failure is not None
        raise failure
