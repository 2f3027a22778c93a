"""Measure: feel how wide the thing between the fingers is."""

from __future__ import annotations

from robosandbox.errors import GraspError, Phase, UnsupportedError
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact

_FINGERS = ("your fingers", "the fingers", "your gripper", "the gripper", "your hand")


class Measure(HandMove):
    """Measure what is held."""

    name = "measure"
    words = Words(
        verbs=(
            *("measure", "measure the width of", "measure how wide {} is", "gauge"),
            *(f"measure {{}} {by} {fingers}" for by in ("with", "by", "using") for fingers in _FINGERS),
            *(f"use {fingers} to measure {{}}" for fingers in _FINGERS),
        ),
        object="object",
        hand="holding",
        returns=True,
    )

    def contract(self, *, object: str) -> Contract:
        """Return that the object is held, and stays so."""
        return Contract(needs=(fact("holding", object),), keeps_hold=True)

    def run(self, ctx: SkillContext, *, object: str) -> SkillResult:
        """Read how far apart the fingers are that hold a thing; it stays held.

        Args:
            object: Id of what is held.

        Raises:
            UnsupportedError: The hand has no fingers.
            GraspError: They have closed on nothing.
        """
        arm = Mover(ctx)
        gripper = arm.state.gripper
        if gripper is None or gripper.seal is not None:
            raise UnsupportedError("the robot has no fingers to measure with", phase=Phase.CHECK)
        if arm.look().held != object:
            raise GraspError(f"{object} is not between the fingers", phase=Phase.VERIFY)
        width = 1e3 * gripper.width
        return SkillResult(
            skill=self.name,
            detail={"object": object, "width_mm": width},
            found=f"{object} is {width:.1f} mm wide between the fingers",
        )
