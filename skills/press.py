"""Press: push a button or switch of a scene's file in, and let go."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from robosandbox.errors import Phase, SkillError
from robosandbox.evidence import Evidence
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.parts import RESISTED, press_part
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact

# Share of its way that a button has to go to be pressed.
_PRESSED = 0.7
# Share of a force that was asked for.
_CLOSE_ENOUGH = 0.9


class PressEvidence(Evidence):
    """How far a button went in, and what it resisted with.

    Attributes:
        part: Id.
        force: The largest felt, N.
        share: Of its way.
    """

    part: str
    force: float
    share: float


class PressError(SkillError):
    """A button did not go in."""

    code = "press"
    evidence_type: ClassVar[type[Evidence] | None] = PressEvidence


class Press(Skill):
    """Push a button in and let go."""

    name = "press"

    def contract(self, *, part: str, force: float | None = None) -> Contract:
        """Return what pressing a part needs and brings about."""
        return Contract(
            needs=(
                fact("movable_part", part),
                fact("hand_empty"),
                fact("accessible", part),
                fact("may_press", RESISTED if force is None else force),
                fact("reachable", part),
            ),
            gives=(fact("pressed", part),),
        )

    def run(self, ctx: SkillContext, *, part: str, force: Annotated[float, Field(gt=0.0)] | None = None) -> SkillResult:
        """Push a button or switch in along its slide with the closed fingers, and let go.

        Args:
            part: Id of the part, as bell.button.
            force: To press with, N; until it is felt to stop when left out.

        Raises:
            ObjectNotFoundError: It is not seen.
            AlreadyHoldingError: The gripper is full.
            UnreachableError: It is out of reach.
            CollisionError: Something is in the way.
            PressError: It did not go in.
        """
        arm = Manipulator(ctx)
        share, felt = press_part(arm, part, force)
        if share < _PRESSED or (force is not None and felt < _CLOSE_ENOUGH * force):
            asked = "" if force is None else f" of {force:g} N asked for"
            raise PressError(
                f"{part} went in by {share:.0%} of its way and resisted with {felt:.1f} N{asked}; it is locked, or stiffer than that",
                phase=Phase.VERIFY,
                evidence=PressEvidence(part=part, force=felt, share=share),
            )
        return SkillResult(skill=self.name, detail={"part": part, "pressed_share": share, "force_n": felt})
