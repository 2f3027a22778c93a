"""Hand over: hold a thing out to a person, and let go when it is pulled at."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from robosandbox.driver import require
from robosandbox.errors import GraspError, Phase
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.hand_move import Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import ObservedScene, SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact

# Where a thing is held out when nobody says where: shares of the arm's reach from its base and above the table; there a person
# who stands at the far side takes it without reaching over the arm.
_SHARE, _ABOVE = 0.7, 0.35
# N beside its weight by which a thing is pulled at, and for how many seconds: more than a hand that brushes against it.
_PULL, _PULLED = 3.0, 0.1
# Seconds of standing still before what the thing weighs is felt, and over which it is.
_REST = 0.3
_GERMAN = """
GIVE
  give = gib(imp), geben(imp inf), gebe(imp), gebt(imp), verb reich
TO_ME
  me = mir, uns
order : Command
  = verb=worded skill=hand_over simple(GIVE handed)
handed
  = TO_ME objects
  = objects TO_ME
"""
_SPANISH = """
GIVE
  give = da, dar, dé, pasa, pase, pasar, alcanza, alcance, alcanzar, entrega, entregue, entregar
join GIVE CLITIC
order : Command
  = verb=worded skill=hand_over GIVE ME objects
"""
_TO_ME = ("hand", "give", "pass", "bring")


class HandOver(Skill):
    """Give a thing to a person."""

    name = "hand_over"
    words = Words(
        verbs=(
            *(f"{verb} {who} {{}}" for verb in _TO_ME for who in ("me", "us", "over")),
            *(
                f"{verb} {{}} {to}"
                for verb in _TO_ME
                for to in ("to me", "to us", "over", "over to me", "to the person")
            ),
            *(f"hold {{}} out{to}" for to in ("", " to me", " for me", " towards me", " to us")),
            *("hold out", "offer me {}", "offer {} to me", "present {} to me", "reach me {}"),
        ),
        object="object",
        slots=(Slot(argument="seconds", kind="duration", prepositions=("for", "within")),),
        hand="holding",
    )

    translations: ClassVar[Mapping[str, str]] = {"german": _GERMAN, "spanish": _SPANISH}

    def contract(self, *, object: str, **others: Any) -> Contract:
        """Return that the object is held before."""
        del others
        return Contract(needs=(fact("holding", object),))

    def run(
        self,
        ctx: SkillContext,
        *,
        object: str,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        seconds: Annotated[float, Field(gt=0.0, le=600.0)] = 20.0,
    ) -> SkillResult:
        """Hold what is held out to a person, wait until it is pulled at, and let go; without a pull it stays held.

        Args:
            object: Id of what is held.
            x: Where the tool centre point is to be, metres in the world; in front of the arm when left out.
            y: The same.
            z: The same.
            seconds: How long it waits for a pull.

        Raises:
            NotHoldingError: It is not held.
            GraspError: Nobody pulled at it; it is still held.
            UnsupportedError: The driver feels no force at the wrist, or what lies in it would fall out.
            UnreachableError: The hand cannot be there.
            CollisionError: Something is in the way.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        require(arm.driver, "wrist_wrench", "a pull is waited for")
        usual = _in_front(arm.start)
        place = tuple(given if given is not None else own for given, own in zip((x, y, z), usual, strict=True))
        arm.bring((place[0], place[1], place[2]))
        ctx.enter(Phase.WAIT)
        arm.driver.wait(_REST)
        tick, weight = arm.driver.control_timestep, []
        for _ in range(round(_REST / tick)):
            arm.driver.wait(tick)
            weight.append(arm.force_on(object))
        still, began, felt = np.mean(weight, axis=0), arm.driver.time, 0.0
        since: float | None = None
        while arm.driver.time - began < seconds:
            arm.driver.wait(tick)
            felt = float(np.linalg.norm(arm.force_on(object) - still))
            since = None if felt < _PULL else (arm.driver.time if since is None else since)
            if since is not None and arm.driver.time - since >= _PULLED:
                break
        else:
            raise GraspError(
                f"nobody pulled at {object} with {_PULL:.0f} N within {seconds:.0f} s; it is still held",
                phase=Phase.WAIT,
            )
        waited = arm.driver.time - began
        ctx.enter(Phase.RELEASE)
        arm.open()
        if arm.look().held == object:
            raise GraspError(f"{object} did not leave the hand", phase=Phase.RELEASE)
        return SkillResult(skill=self.name, detail={"object": object, "pulled_n": felt, "waited_s": waited})


def _in_front(scene: ObservedScene) -> tuple[float, float, float]:
    """Return a place before the arm, towards the middle of the table, metres in the world."""
    base = np.array(scene.base_xy)
    (left, right), (near, far) = scene.table_area
    away = np.array([left + right, near + far]) / 2.0 - base
    length = float(np.linalg.norm(away))
    ahead = away / length if length > 0.0 else np.array([1.0, 0.0])
    x, y = base + _SHARE * scene.reach[1] * ahead
    return float(x), float(y), scene.table_height + _ABOVE * scene.reach[1]
