"""Close: push a door, drawer or lid of a scene's file shut, or lead it by what can be taken hold of."""

from __future__ import annotations

from robosandbox.errors import CollisionError, GraspError, UnreachableError
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.parts import RESISTED, lead, push
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.parts import closed_share, open_share, open_value, shut_value


class Close(Skill):
    """Push or lead a part shut along its hinge or slide."""

    name = "close"

    def contract(self, *, part: str) -> Contract:
        """Return what leading a part shut needs and brings about."""
        return Contract(
            needs=(
                fact("has_gripper"),
                fact("movable_part", part),
                fact("hand_empty"),
                fact("may_press", RESISTED),
                fact("reachable", part),
            ),
            gives=(fact("closed", part),),
        )

    def run(self, ctx: SkillContext, *, part: str) -> SkillResult:
        """Push a door, drawer or lid shut, or lead it shut by a grip.

        Args:
            part: Id of the part, as cupboard.door.

        Raises:
            ObjectNotFoundError: It is not seen.
            GraspError: Nothing of it fits between the fingers, or they missed it.
            UnreachableError: Its handle, or its way, is out of reach.
            CollisionError: Something is in the way.
            DrawerError: It is locked or blocked, or the hand slipped off.
        """
        arm = Manipulator(ctx)
        before = arm.find(part)
        closed, shut = closed_share(before), shut_value(before)
        if open_share(before) <= closed:
            return SkillResult(
                skill=self.name, detail={"part": part, "open_share": open_share(before), "already_closed": True}
            )
        enough = open_value(before, closed)
        try:
            now, force = push(arm, part, [shut], enough)
        except (UnreachableError, CollisionError, GraspError) as unpushed:
            # Where there is no face to push on within reach, there may be something to hold.
            try:
                now, force = lead(arm, part, [shut], enough)
            except (UnreachableError, CollisionError, GraspError) as unled:
                raise arm.clearest([unled, unpushed]) from unled
        return SkillResult(skill=self.name, detail={"part": part, "open_share": open_share(now), "force_n": force})
