"""Squeeze: press a thing between the fingers where it stands."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Field

from robosandbox.errors import Phase
from robosandbox.skills.gripper import FORCE, check_force_is_felt, squeeze
from robosandbox.skills.pick import Pick, take_hold
from robosandbox.skills.primitives.grasping import plan_grasp
from robosandbox.skills.primitives.guarded import follow_free
from robosandbox.skills.primitives.hand_move import LIGHT, HandMove
from robosandbox.skills.primitives.manipulator import HOVER_HEIGHT, Manipulator
from robosandbox.skills.primitives.sensing import check_open
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact

# Metres wider than a thing, from which on the fingers press with no more than they are to: those of an SO-101, sent to 4 mm, touched it.
_LAST = 0.01


class _Pressing(Manipulator):
    """A manipulator whose fingers close with no more than what a thing is to be pressed with.

    Args:
        ctx: What the skill may use.
        most: N of each side; as hard as a pick holds where it is infinite.
    """

    def __init__(self, ctx: SkillContext, most: float) -> None:
        super().__init__(ctx)
        self._most = most

    def close_on(self, width: float) -> float:
        """Close the fingers on something of this width, metres; return the gap between them."""
        if not math.isfinite(self._most):
            return super().close_on(width)
        # Weak motors creep: they are left the last of the way alone.
        self.open(width + _LAST)
        squeeze(self, self._most, on_nothing=True, gently=True)
        return self.gripper.width


class Squeeze(HandMove):
    """Press a thing between the fingers where it stands."""

    name = "squeeze"
    words = Words(
        verbs=(
            *("squeeze", "pinch", "clamp", "compress", "press {} between your fingers", "press {} between the fingers"),
        ),
        nouns=("squeeze", "pinch"),
        object="object",
        hand="any",
        slots=(FORCE, Slot(argument="seconds", kind="duration", prepositions=("for", "for about"))),
    )

    def contract(self, *, object: str, keep: bool = False, **others: Any) -> Contract:
        """Return what coming to grips needs; what stands stays where it stands, and in the hand where it is kept."""
        del others
        needs = Pick().contract(object=object).needs
        return Contract(needs=needs, gives=(fact("holding", object),) if keep else ())

    def run(
        self,
        ctx: SkillContext,
        *,
        object: str,
        force: Annotated[float, Field(gt=0.0, le=200.0)] | None = None,
        seconds: Annotated[float, Field(ge=0.0, le=3600.0)] = 0.0,
        keep: bool = False,
    ) -> SkillResult:
        """Close the fingers on a thing where it stands, press, and let go of it again; what is held already is squeezed in the hand.

        Args:
            object: Id of the thing.
            force: With which each side is to press, N; lightly when left out, where the driver feels it.
            seconds: How long.
            keep: Whether the fingers stay closed on it.

        Raises:
            SkillError: As pick raises them before it lifts.
            UnsupportedError: The robot does not feel or limit its force, and one is asked for.
            GraspError: The force is not reached.
        """
        if force is not None:
            check_force_is_felt(ctx.driver)
        abilities = ctx.driver.capabilities
        asked = (LIGHT if force is None else force) if abilities.gripper_force and abilities.grip_limit else math.inf
        arm = _Pressing(ctx, asked)
        target = arm.find(object)
        plan = None
        if arm.start.held != object:
            plan = plan_grasp(arm, target, arm.start)
            arm.open_for(plan.approach, plan.aperture)
            follow_free(arm, plan.approach, Phase.APPROACH)
            check_open(arm, plan.grasp, plan.aperture)
            take_hold(arm, target, plan)
        elif math.isfinite(asked):
            squeeze(arm, asked)
        detail: dict[str, float | str | bool] = {"object": object, "width_mm": 1e3 * arm.gripper.width}
        if abilities.gripper_force:
            detail["force_n"] = arm.hand.grip_on(None)
        if seconds > 0.0:
            ctx.enter(Phase.WAIT)
            arm.driver.wait(seconds)
        if plan is not None and not keep:
            ctx.enter(Phase.RELEASE)
            arm.open(plan.aperture)
            arm.use(arm.look())
            arm.motion.allow(object)
            arm.rise_out(HOVER_HEIGHT, Phase.RETREAT)
        return SkillResult(skill=self.name, detail=detail)
