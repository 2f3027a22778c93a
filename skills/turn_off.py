"""Turn off: lead a knob, lever or switch of a scene's file back to where it rests."""

from __future__ import annotations

from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.parts import set_part
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.turn_on import needs_of_turning
from robosandbox.skills.words import Words
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact


class TurnOff(Skill):
    """Lead a knob or lever back to where it rests."""

    name = "turn_off"
    words = Words(verbs=("turn off", "switch off", "turn {} off", "switch {} off"), object="part")

    def contract(self, *, part: str) -> Contract:
        """Return what turning a part back needs and brings about."""
        return Contract(needs=needs_of_turning(part), gives=(fact("turned_to", part, 0.0),))

    def run(self, ctx: SkillContext, *, part: str) -> SkillResult:
        """Take hold of a knob, lever or switch and lead it back to where it rests.

        Args:
            part: Id of the part, as stove.knob.

        Raises:
            ObjectNotFoundError: It is not seen.
            GraspError: Nothing of it fits between the fingers, or they missed it.
            UnreachableError: It, or its way, is out of reach.
            CollisionError: Something is in the way.
            DrawerError: It is locked or blocked, or the hand slipped off.
        """
        return set_part(Manipulator(ctx), self.name, part, 0.0)
