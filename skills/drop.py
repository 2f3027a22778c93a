"""Drop: let a thing fall from a height."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from robosandbox.errors import GraspError, Phase
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.hand_move import Mover
from robosandbox.skills.primitives.manipulator import HOVER_HEIGHT
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import A_LITTLE, Slot, Words
from robosandbox.types import DetectedObject, ObservedScene, Pose, SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.relations import bottom, bounds, top


class Drop(Skill):
    """Let a thing fall."""

    name = "drop"
    words = Words(
        verbs=("drop", "let {} fall", "let {} drop"),
        object="object",
        slots=(
            Slot(
                argument="height",
                kind="length",
                prepositions=("from", "from a height of", "from about", "from just", "from only"),
                phrases=tuple(
                    (f"from {just}a {little} height", A_LITTLE)
                    for just in ("", "just ", "only ")
                    for little in ("small", "little", "low", "tiny", "short")
                ),
                endings=(
                    ("up", 1.0),
                    ("above the table", 1.0),
                    ("high", 1.0),
                    ("height", 1.0),
                    ("of height", 1.0),
                    ("over the table", 1.0),
                ),
            ),
        ),
        hand="holding",
    )

    def contract(self, *, object: str, **others: Any) -> Contract:
        """Return that the object is held before."""
        del others
        return Contract(needs=(fact("holding", object),))

    def run(
        self, ctx: SkillContext, *, object: str, height: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    ) -> SkillResult:
        """Let what is held fall, and wait until it lies; nothing is promised of where.

        Args:
            object: Id of what is held.
            height: From what is below to the object's underside, metres; from where it is held when left out.

        Raises:
            NotHoldingError: It is not held.
            GraspError: It is still in the hand.
            UnreachableError: The hand cannot go to that height in a straight line.
            CollisionError: Something is in the way.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        held = arm.find(object)
        if height is not None:
            here = arm.state.tcp_pose
            rise = _below(held, arm.start) + height - bottom(held)
            goal = Pose(xyz=(here.xyz[0], here.xyz[1], here.xyz[2] + rise), quat_xyzw=here.quat_xyzw)
            arm.arrive(arm.kept_level(arm.motion.plan_line(arm.q, goal, speed=arm.speed)), goal)
        before = bottom(arm.find(object, arm.look()))
        ctx.enter(Phase.RELEASE)
        arm.open()
        seen = arm.watch(object)
        if seen.held == object:
            raise GraspError(f"{object} did not leave the hand", phase=Phase.RELEASE)
        there = seen.find(object)
        detail: dict[str, float | str | bool] = {"object": object}
        if there is not None:
            x, y, _ = there.pose.xyz
            if top(there) > arm.state.tcp_pose.xyz[2]:
                # It lies between the fingers, which go up past it.
                arm.use(seen)
                arm.motion.allow(object)
                arm.rise(HOVER_HEIGHT, Phase.RETREAT, speed=arm.tempo.leave)
            detail |= {"fell_mm": 1e3 * (before - bottom(there)), "x": x, "y": y}
        return SkillResult(skill=self.name, detail=detail)


def _below(held: DetectedObject, scene: ObservedScene) -> float:
    """Return the height of the highest thing under what is held, metres in the world."""
    least, most = bounds(held)
    tops = [scene.table_height]
    for item in scene.objects:
        low, high = bounds(item)
        if item.id != held.id and bool(np.all(low[:2] < most[:2]) and np.all(high[:2] > least[:2])):
            tops.append(top(item))
    return max(one for one in tops if one <= max(bottom(held), scene.table_height))
