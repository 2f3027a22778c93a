"""Shake: move the hand, and what it holds, to and fro."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from robosandbox.errors import Phase, UnsupportedError
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import Pose, SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact

_TIMES = Slot(
    argument="times",
    kind="number",
    endings=(("times", 1.0),),
    bare=False,
    phrases=(("once", 1.0), ("twice", 2.0)),
)


class Shake(HandMove):
    """Move the hand to and fro."""

    name = "shake"
    words = (
        Words(verbs=("shake",), object="object", slots=(_TIMES,), hand="holding"),
        Words(verbs=("wave", "wave your hand", "wave the hand", "shake your hand", "shake the hand"), slots=(_TIMES,)),
    )

    def contract(self, *, object: str | None = None, **others: Any) -> Contract:
        """Return that what is to be shaken is held, and stays so."""
        del others
        return Contract(needs=() if object is None else (fact("holding", object),), keeps_hold=True)

    def run(
        self,
        ctx: SkillContext,
        *,
        object: str | None = None,
        times: Annotated[int, Field(ge=1, le=20)] = 3,
        width: Annotated[float, Field(gt=0.0, le=0.3)] = 0.05,
    ) -> SkillResult:
        """Move the tool centre point to the left and to the right of where it is, and back there; what it holds stays held.

        Args:
            object: Id of what is held and to be shaken; nothing, or whatever is held, when left out.
            times: How often it goes to each side.
            width: From side to side, metres.

        Raises:
            NotHoldingError: It is not held.
            UnsupportedError: What lies in what is held would be spilt.
            UnreachableError: The hand cannot go there in straight lines.
            CollisionError: Something is in the way.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        if arm.carries:
            raise UnsupportedError(
                f"{arm.start.held} holds {', '.join(arm.carries)}, which would be spilt; put it down, or pour it out first",
                phase=Phase.CHECK,
            )
        here = arm.state.tcp_pose
        sides = [np.array([0.0, sign * width / 2.0, 0.0]) for _ in range(times) for sign in (1.0, -1.0)]
        points = [*(here.position + side for side in sides), here.position]
        poses = [Pose(xyz=tuple(point), quat_xyzw=here.quat_xyzw) for point in points]
        way = arm.motion.plan_through(arm.q, poses, speed=arm.speed)
        return SkillResult(skill=self.name, detail={**arm.arrive(way, here), "times": float(times)})
