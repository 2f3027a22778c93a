"""Move beside: bring the hand, and what it holds, next to a thing."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from robosandbox.skills.primitives.hand_move import HAND_GOES, HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import SIDE_AXES, Side, SkillResult
from robosandbox.world.relations import bounds, centre

# How each side is said behind a verb of the hand.
_SIDES: dict[Side, tuple[str, ...]] = {
    "front": ("in front of", "before", "to in front of"),
    "back": ("behind", "to behind"),
    "left": ("to the left of", "left of", "to the left side of"),
    "right": ("to the right of", "right of", "to the right side of"),
}


class MoveBeside(HandMove):
    """Bring the hand next to a thing."""

    name = "move_beside"
    words = tuple(
        Words(
            verbs=HAND_GOES,
            body="hand",
            slots=(
                Slot(argument="distance", kind="length", prepositions=("", "by", "at")),
                Slot(argument="object", kind="object", prepositions=said),
            ),
            required=("object",),
            means=(("side", side),),
        )
        for side, said in _SIDES.items()
    )

    def run(
        self,
        ctx: SkillContext,
        *,
        object: str,
        side: Side,
        distance: Annotated[float, Field(ge=0.0, le=2.0)] = 0.1,
    ) -> SkillResult:
        """Bring the hand next to a thing at the height of its top on a free way, pointing down; what it holds stays held.

        Args:
            object: Id of the thing.
            side: Of the thing, as the robot sees it.
            distance: From the thing's side to the tool centre point, metres.

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
        outward = np.array(SIDE_AXES[side])
        half = float(np.abs(outward) @ (most - least)[:2]) / 2.0
        x, y = centre(item)[:2] + (half + distance) * outward
        return SkillResult(skill=self.name, detail=arm.bring((float(x), float(y), float(most[2]) + arm.hangs)))
