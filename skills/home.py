"""Home: go to the robot's neutral configuration."""

from __future__ import annotations

import numpy as np

from robosandbox.errors import CollisionError, Phase, UnreachableError
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.carrying import carried_along, carry_speed
from robosandbox.skills.primitives.manipulator import HOVER_HEIGHT, Manipulator
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact


class Home(Skill):
    """Go to the neutral configuration."""

    name = "home"

    def contract(self) -> Contract:
        """Return what going home brings about; it needs nothing."""
        return Contract(gives=(fact("at_home"),))

    def run(self, ctx: SkillContext) -> SkillResult:
        """Move the arm to its home configuration; what it holds stays held.

        Raises:
            CollisionError: No free way home was found.
            TrackingError: The arm did not arrive.
        """
        arm = Manipulator(ctx)
        held = arm.start.held
        home = arm.spec.home_q
        arm.use(arm.start, held=held)
        speed = arm.tempo.free
        if held:
            speed = carry_speed(arm, arm.held, arm.start, speed)
            arm.motion.allow("table", *carried_along(arm.find(held), arm.start))
        try:
            trajectory = arm.motion.plan_joints(arm.q, home, speed=speed)
        except CollisionError as blocked:
            # Fingers beside an object touch it at the start of every way but the one straight up.
            try:
                arm.rise_out(HOVER_HEIGHT, Phase.RETREAT)
            except UnreachableError:
                raise blocked from None
            arm.use(arm.look(), held=held)
            trajectory = arm.motion.plan_joints(arm.q, home, speed=speed)
        arm.follow(trajectory, Phase.HOME)
        error = float(np.abs(arm.q - home).max())
        return SkillResult(skill=self.name, detail={"joint_error": error})
