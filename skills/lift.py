"""Lift: raise or lower a thing by so much, in the hand."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from robosandbox.skills.base import Skill
from robosandbox.skills.pick import Pick
from robosandbox.skills.primitives.hand_move import Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import A_LITTLE, Slot, Words
from robosandbox.types import Pose, SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.relations import bottom

_UP = ("up", "off the table", "higher", "into the air")
_BY = Slot(
    argument="height",
    kind="length",
    prepositions=("", "by", "up", "up by"),
    phrases=tuple((f"{up}{some}", A_LITTLE) for up in ("", "up ") for some in ("a little", "a bit", "slightly")),
    endings=tuple((said, 1.0) for said in _UP),
)
# Metres that a thing is lifted which is to be held up. Chosen.
_HIGH = 0.2
_UP_HIGH = (
    "{} up high",
    "up high {}",
    "{} high up",
    "{} high in the air",
    "{} up in the air",
    "{} in the air",
    "{} high",
)
_UP_BY = Slot(
    argument="height",
    kind="length",
    prepositions=("", "by"),
    beginnings=(("up", 1.0), ("up by", 1.0), ("upwards", 1.0)),
    endings=(*((said, 1.0) for said in _UP), ("upwards", 1.0), ("upward", 1.0)),
    bare=False,
)
_DOWN_BY = Slot(argument="height", kind="length", beginnings=(("", -1.0), ("by", -1.0)), bare=False)


class Lift(Skill):
    """Lift a thing by so much."""

    name = "lift"
    words = (
        Words(
            verbs=("lift", "raise", "lift up", "lift {} up", "raise {} up"),
            object="object",
            slots=(_BY,),
            required=("height",),
            hand="any",
            holds=True,
        ),
        Words(
            verbs=("move", "bring", "pull", "pick", "take", "pick {} straight", "lift {} straight"),
            object="object",
            slots=(_UP_BY,),
            required=("height",),
            hand="any",
            holds=True,
        ),
        Words(
            verbs=("lower", "lower {} down", "lower {} again"),
            object="object",
            slots=(_DOWN_BY,),
            required=("height",),
            hand="holding",
        ),
        Words(
            verbs=(
                *(f"{verb} {up}" for verb in ("hold", "lift", "raise") for up in _UP_HIGH),
                *(f"show {{}} to {whom}" for whom in ("me", "us", "the camera", "everyone", "everybody")),
            ),
            object="object",
            hand="any",
            holds=True,
            means=(("height", _HIGH),),
        ),
    )

    def contract(self, *, object: str, **others: Any) -> Contract:
        """Return what lifting needs and brings about."""
        del others
        return Contract(needs=Pick().contract(object=object).needs, gives=(fact("holding", object),))

    def run(self, ctx: SkillContext, *, object: str, height: Annotated[float, Field(ge=-1.0, le=1.0)]) -> SkillResult:
        """Raise a thing straight by so much, picked up where it stands if it is not held; it stays in the hand.

        Args:
            object: Id of the object.
            height: By how much its underside is to rise from where it is, metres; it sinks where negative.

        Raises:
            SkillError: As pick raises them.
            UnreachableError: The hand cannot go there in a straight line.
            CollisionError: Something is in the way.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        before = bottom(arm.find(object))
        if arm.start.held != object:
            Pick().run(ctx, object=object)
            arm = Mover(ctx)
        here = arm.state.tcp_pose
        rise = before + height - bottom(arm.find(object))
        goal = Pose(xyz=(here.xyz[0], here.xyz[1], here.xyz[2] + rise), quat_xyzw=here.quat_xyzw)
        arm.arrive(arm.kept_level(arm.motion.plan_line(arm.q, goal, speed=arm.speed)), goal)
        risen = bottom(arm.find(object, arm.look())) - before
        return SkillResult(skill=self.name, detail={"object": object, "dz_mm": 1e3 * risen})
