"""Weigh: feel how heavy the thing in the hand is."""

from __future__ import annotations

import numpy as np

from robosandbox.driver import require
from robosandbox.errors import NotHoldingError, Phase
from robosandbox.skills.primitives.gripping import GRAVITY
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.hand import stands

# Seconds of standing before the first reading and over which readings are taken.
_REST, _SECONDS = 0.5, 1.0


class Weigh(HandMove):
    """Weigh what is held."""

    name = "weigh"
    words = Words(
        verbs=(
            *(
                "weigh",
                "weigh {} in your hand",
                "measure the weight of",
                "estimate the weight of",
                "feel the weight of",
            ),
            *("determine the weight of", "feel how heavy {} is", "estimate how heavy {} is", "measure how heavy {} is"),
        ),
        object="object",
        hand="holding",
    )

    def contract(self, *, object: str) -> Contract:
        """Return that the object is held, and stays so."""
        return Contract(needs=(fact("holding", object),), keeps_hold=True)

    def run(self, ctx: SkillContext, *, object: str) -> SkillResult:
        """Stand still and weigh what the hand holds by the force that the wrist feels; it stays held.

        Args:
            object: Id of what is held.

        Raises:
            NotHoldingError: It is not held, or not lifted.
            UnsupportedError: The driver feels no force at the wrist.
        """
        arm = Mover(ctx)
        require(arm.driver, "wrist_wrench", "what is held is weighed")
        if stands(arm.start, object):
            raise NotHoldingError(
                f"{object} still stands on something, which bears some of its weight; lift it first", phase=Phase.CHECK
            )
        arm.driver.wait(_REST)
        felt = []
        end = arm.driver.time + _SECONDS
        while arm.driver.time < end:
            arm.driver.wait(arm.driver.control_timestep)
            felt.append(float(arm.force_on(object)[2]) / GRAVITY)
        # Beside the noise of the readings: how much they wander, three times over.
        mass, error = float(np.mean(felt)), float(3.0 * np.std(felt))
        return SkillResult(
            skill=self.name,
            detail={"object": object, "mass_kg": mass, "error_kg": error},
            found=f"{object} weighs {1e3 * mass:.0f} g, give or take {max(1e3 * error, 1.0):.0f} g",
        )
