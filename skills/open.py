"""Open: lead a door, drawer or lid of a scene's file open by what can be taken hold of."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Annotated

from pydantic import Field

from robosandbox.errors import CollisionError, DrawerError, GraspError, UnreachableError
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.parts import MOST_FORCE, RESISTED, lead_latched, lead_or_push
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import DetectedObject, SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.parts import (
    OPEN_SHARE,
    OPENED_WITHIN,
    TURNED_WITHIN,
    open_share,
    open_value,
    part_value,
    shut_value,
    sprung_handle,
)

# Shares of what was asked for that are tried, the most first: a hand that cannot go all the way still opens it.
_SHARES = (1.0, 0.85, 0.7)


class Open(Skill):
    """Lead a part open along its hinge or slide."""

    name = "open"

    def contract(self, *, part: str, share: float = 0.9, force: float | None = None) -> Contract:
        """Return what leading a part open needs and brings about."""
        # Less than all of its way is a wish: the hand opens it as far as it gets.
        is_wish = isinstance(share, float) and share < 1.0
        return Contract(
            needs=(
                fact("has_gripper"),
                fact("movable_part", part),
                fact("hand_empty"),
                fact("may_press", RESISTED if force is None else force),
                fact("reachable", part),
                fact("room_to_swing", part),
            ),
            gives=(fact("open", part) if is_wish else fact("open", part, share),),
        )

    def run(
        self,
        ctx: SkillContext,
        *,
        part: str,
        share: Annotated[float, Field(gt=0.5, le=1.0)] = 0.9,
        force: Annotated[float, Field(gt=0.0)] | None = None,
    ) -> SkillResult:
        """Take hold of a door, drawer or lid and lead it open; push it where there is nothing to hold, and turn a handle that has a spring first.

        Args:
            part: Id of the part, as cupboard.door.
            share: How far, as a share of its way.
            force: Along its way from which it counts as stuck where it is pushed, N.

        Raises:
            ObjectNotFoundError: It is not seen.
            GraspError: Nothing of it fits between the fingers, or they missed it.
            UnreachableError: Its handle, or its way, is out of reach.
            CollisionError: Something is in the way.
            DrawerError: It is locked or blocked, or the hand slipped off.
        """
        arm = Manipulator(ctx)
        before = arm.find(part)
        if open_share(before) > (OPEN_SHARE if share < 1.0 else share - OPENED_WITHIN):
            return SkillResult(
                skill=self.name, detail={"part": part, "open_share": open_share(before), "already_open": True}
            )
        most = MOST_FORCE if force is None else force
        least = max(OPEN_SHARE, open_share(before))
        goals = [open_value(before, share * tried) for tried in _SHARES if share * tried > least]
        enough = open_value(before, OPEN_SHARE if least == OPEN_SHARE else share - OPENED_WITHIN)
        handle = sprung_handle(before, arm.start.objects)
        if handle is None:
            now, force = lead_or_push(arm, part, goals, enough, most)
        else:
            now, force = lead_latched(arm, part, handle.id, goals, enough)
        if share - open_share(now) > TURNED_WITHIN:
            now = _further(ctx, part, [goal for goal in goals if _beyond(now, goal)], most)
        return SkillResult(skill=self.name, detail={"part": part, "open_share": open_share(now), "force_n": force})


def _further(ctx: SkillContext, name: str, goals: Sequence[float], most: float) -> DetectedObject:
    """Lead or push a part that is open on to one of some values of its joint, where that is possible, and return it as it is then."""
    arm = Manipulator(ctx)
    with suppress(UnreachableError, CollisionError, GraspError, DrawerError):
        return lead_or_push(arm, name, goals, goals[-1], most)[0]
    return arm.find(name, arm.look())


def _beyond(part: DetectedObject, value: float) -> bool:
    """Tell whether a value of its joint is clearly farther from shut than where a part is."""
    way, gone = abs(value - shut_value(part)), abs(part_value(part) - shut_value(part))
    return way - gone > TURNED_WITHIN * abs(open_value(part) - shut_value(part))
