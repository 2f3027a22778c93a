"""Open drawer: pull a drawer out by its grip."""

from __future__ import annotations

from collections.abc import Iterator

from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.parts import PULLED_SHARE, RESISTED, lead
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import SkillResult
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.parts import open_value, part_value

# Shares of its way that are tried, the most first; chosen so that a hand which cannot go all the way still opens it.
_SHARES = (0.98, 0.9, 0.8)


class OpenDrawer(Skill):
    """Pull a drawer out by its grip."""

    name = "open_drawer"

    def contract(self, *, drawer: str) -> Contract:
        """Return what pulling a drawer open needs and brings about."""
        return Contract(
            needs=(
                fact("has_gripper"),
                fact("opens", drawer),
                fact("hand_empty"),
                fact("grip_fits", drawer),
                fact("may_press", RESISTED),
                fact("reachable", drawer),
                fact("room_to_open", drawer),
            ),
            gives=(fact("open", drawer),),
        )

    def alternatives(self, failed: FailedCall, *, drawer: str) -> Iterator[Alternative]:
        """Yield sliding it back first: what it presses on is free then."""
        if failed.had_begun and failed.met:
            why = f"{', '.join(failed.met)} jams {drawer} and is put aside first"
            yield Alternative(why=why, first=(fact("closed", drawer),), cleared=failed.met, call=failed.call)

    def run(self, ctx: SkillContext, *, drawer: str) -> SkillResult:
        """Pull a drawer open by its grip.

        Args:
            drawer: Id of the drawer.

        Raises:
            ObjectNotFoundError: It is not seen.
            InvalidArgumentError: It is no drawer.
            AlreadyHoldingError: The gripper is full.
            GraspError: The fingers are too narrow for the grip, or missed it.
            UnreachableError: The grip, or where it would go, is out of reach.
            CollisionError: Something is in the way.
            DrawerError: It is locked or blocked, or the hand slipped off.
        """
        arm = Manipulator(ctx)
        before = now = arm.find(drawer)
        enough, force = open_value(before, PULLED_SHARE), 0.0
        if part_value(before) < enough:
            now, force = lead(arm, drawer, [open_value(before, share) for share in _SHARES], enough)
        return SkillResult(
            skill=self.name,
            detail={
                "drawer": drawer,
                "opening_mm": 1e3 * part_value(now),
                "force_n": force,
                **({"already_open": True} if now is before else {}),
            },
        )
