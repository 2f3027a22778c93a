"""Close drawer: push a drawer shut at its grip."""

from __future__ import annotations

from collections.abc import Iterator

from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.parts import RESISTED, push
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import SkillResult
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.parts import part_value, shut_value
from robosandbox.world.relations import CLOSED_WITHIN


class CloseDrawer(Skill):
    """Push a drawer shut at its grip."""

    name = "close_drawer"

    def contract(self, *, drawer: str) -> Contract:
        """Return what pushing a drawer shut needs and brings about."""
        return Contract(
            needs=(
                fact("opens", drawer),
                fact("hand_empty"),
                fact("shuts", drawer),
                fact("may_press", RESISTED),
                fact("reachable", drawer),
            ),
            gives=(fact("closed", drawer),),
        )

    def alternatives(self, failed: FailedCall, *, drawer: str) -> Iterator[Alternative]:
        """Yield sliding it out first: what it presses on is free then."""
        if failed.had_begun and failed.met:
            why = f"{', '.join(failed.met)} jams {drawer} and is put aside first"
            yield Alternative(why=why, first=(fact("open", drawer),), cleared=failed.met, call=failed.call)

    def run(self, ctx: SkillContext, *, drawer: str) -> SkillResult:
        """Push a drawer shut.

        Args:
            drawer: Id of the drawer.

        Raises:
            ObjectNotFoundError: It is not seen.
            InvalidArgumentError: It is no drawer.
            AlreadyHoldingError: The gripper is full.
            UnreachableError: The grip, or where it would go, is out of reach.
            CollisionError: Something is in the way.
            DrawerError: It is locked, or something in it or behind it keeps it open.
        """
        arm = Manipulator(ctx)
        before = now = arm.find(drawer)
        force = 0.0
        if part_value(before) > CLOSED_WITHIN:
            now, force = push(arm, drawer, [shut_value(before)], CLOSED_WITHIN)
        return SkillResult(
            skill=self.name,
            detail={
                "drawer": drawer,
                "opening_mm": 1e3 * part_value(now),
                "force_n": force,
                **({"already_closed": True} if now is before else {}),
            },
        )
