"""Turn on: lead a knob, lever or switch of a scene's file along its hinge or slide, away from where it rests."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.parts import RESISTED, set_part
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import Fact, fact


class TurnOn(Skill):
    """Lead a knob or lever away from where it rests."""

    name = "turn_on"
    words = Words(
        verbs=("turn on", "switch on", "turn {} on", "switch {} on", "turn up", "turn {} up"),
        object="part",
        slots=(
            Slot(
                argument="share",
                kind="share",
                prepositions=("", "to"),
                phrases=(
                    ("halfway", 0.5),
                    ("half way", 0.5),
                    ("all the way", 1.0),
                    ("fully", 1.0),
                    ("completely", 1.0),
                ),
            ),
        ),
    )

    def contract(self, *, part: str, share: float = 1.0) -> Contract:
        """Return what turning a part needs and brings about."""
        return Contract(needs=needs_of_turning(part), gives=(fact("turned_to", part, share),))

    def run(self, ctx: SkillContext, *, part: str, share: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0) -> SkillResult:
        """Take hold of a knob, lever or switch and lead it along its way.

        Args:
            part: Id of the part, as stove.knob.
            share: How far from where it rests, as a share of its way.

        Raises:
            ObjectNotFoundError: It is not seen.
            GraspError: Nothing of it fits between the fingers, or they missed it.
            UnreachableError: It, or its way, is out of reach.
            CollisionError: Something is in the way.
            DrawerError: It is locked or blocked, or the hand slipped off.
        """
        return set_part(Manipulator(ctx), self.name, part, share)


def needs_of_turning(part: str) -> tuple[Fact, ...]:
    """Return what has to hold of a part and the hand for it to be turned."""
    return (
        fact("has_gripper"),
        fact("movable_part", part),
        fact("hand_empty"),
        fact("may_press", RESISTED),
        fact("reachable", part),
    )
