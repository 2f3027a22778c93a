"""Stir: go down into what holds things with what is held, and round in it."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from robosandbox.errors import Phase, PlacementError
from robosandbox.evidence import PlacementEvidence
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import ROUNDS, Slot, Words
from robosandbox.types import Pose, SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.relations import bottom, centre, contents, extent

# Metres that what is held keeps from the walls and, at its lowest, from the floor.
_OFF_WALLS, _OFF_FLOOR = 0.006, 0.008
# Metres above the rim from which it goes straight down.
_OVER = 0.02
# Metres of a circle below which nothing is stirred.
_LEAST = 0.004
# Places of a round.
_PLACES = 12


class Stir(HandMove):
    """Stir what is in a container."""

    name = "stir"
    words = Words(
        verbs=("stir", "stir in", "stir around in", "stir about in", "swirl around in", "mix"),
        object="container",
        slots=(
            Slot(argument="held", kind="object", prepositions=("with", "using", "by means of")),
            Slot(
                argument="times",
                kind="number",
                prepositions=("", "for"),
                endings=(("times", 1.0), ("rounds", 1.0), ("turns", 1.0)),
                bare=False,
                phrases=ROUNDS,
            ),
        ),
        required=("held",),
        hand="any",
        holds=False,
    )

    def contract(self, *, container: str, held: str, **others: Any) -> Contract:
        """Return that what it is stirred with is held and stays so, and that the container stands and is another."""
        del others
        needs = (fact("holding", held), fact("distinct", held, container), fact("upright", container))
        return Contract(needs=needs, keeps_hold=True)

    def run(
        self,
        ctx: SkillContext,
        *,
        container: str,
        held: str,
        times: Annotated[int, Field(ge=1, le=50)] = 3,
    ) -> SkillResult:
        """Go down into a container with what is held, go round in it, and come up over it again.

        Args:
            container: Id of what holds things.
            held: Id of what is held.
            times: How often it goes round.

        Raises:
            NotHoldingError: It is not held.
            PlacementError: The container holds nothing, or is too narrow for what is held.
            UnreachableError: The hand cannot be there.
            CollisionError: Hand or arm would touch something.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        vessel, tool = arm.find(container), arm.find(held)
        room = vessel.shape.room(vessel.size, vessel.opening)
        radius = -1.0 if room is None else float(np.min(room.half)) - extent(tool).radius - _OFF_WALLS
        if room is None or radius < _LEAST:
            why = "holds nothing" if room is None else f"is too narrow to stir in with {held}"
            raise PlacementError(
                f"{container} {why}; take something narrower, or another container",
                phase=Phase.PLAN,
                evidence=PlacementEvidence(object=held, target=container, reason="unsuitable"),
            )
        upright = vessel.pose.position + vessel.pose.rotation @ np.array([*room.middle, room.floor])
        rim = float((vessel.pose.position + vessel.pose.rotation @ np.array([*room.middle, room.rim]))[2])
        here = arm.state.tcp_pose
        # Where the tool centre point is when the middle of what is held is over the middle, and its lower end at a height.
        aside = here.position[:2] - centre(tool)[:2]
        up = here.xyz[2] - bottom(tool)

        def at(angle: float, out: float, height: float) -> Pose:
            x, y = upright[:2] + aside + out * np.array([math.cos(angle), math.sin(angle)])
            return Pose(xyz=(float(x), float(y), height + up), quat_xyzw=here.quat_xyzw)

        arm.arrive(arm.way_to(arm.standing_at(at(0.0, 0.0, rim + _OVER))), at(0.0, 0.0, rim + _OVER))
        arm.motion.allow(*arm.carries, *(name for name, _ in contents(arm.start.objects, vessel)))
        lowest = float(upright[2]) + _OFF_FLOOR
        angles = 2.0 * math.pi * np.arange(_PLACES * times + 1) / _PLACES
        round_ = [at(float(angle), radius, lowest) for angle in angles]
        for way in ([at(0.0, 0.0, lowest)], [*round_, at(0.0, 0.0, lowest)], [at(0.0, 0.0, rim + _OVER)]):
            arm.arrive(arm.kept_level(arm.motion.plan_through(arm.q, way, speed=arm.tempo.lower)), way[-1])
        return SkillResult(
            skill=self.name,
            detail={
                "container": container,
                "times": float(times),
                "radius_mm": 1e3 * radius,
                "under_rim_mm": 1e3 * (rim - lowest),
            },
        )
