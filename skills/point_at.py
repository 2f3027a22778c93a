"""Point at: turn the hand so that it shows at a thing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from robosandbox.errors import CollisionError, UnreachableError
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import SkillResult
from robosandbox.world.relations import centre

# Distances from the middle of a thing to the tool centre point that are tried, metres, and slants of the hand from straight down,
# rad: near enough to tell neighbours apart, and so far that no hand touches what stands there.
_DISTANCES, _SLANTS = (0.15, 0.2, 0.25), (0.7, 0.5, 0.3, 0.0)

_GERMAN = """
POINT
  point = verb zeig, verb deut
LOOK
  look = verb schau, verb blick
order : Command
  = verb=worded skill=point_at simple(POINT pointed_at)
  = verb=worded skill=point_at simple(LOOK pointed_at)
pointed_at
  = "auf" objects
"""
_SPANISH = """
POINT
  point = ar señal, apunta(imp), apunte(imp), apuntar(inf), mira(imp), mire(imp), mirar(inf)
order : Command
  = verb=worded skill=point_at act(POINT pointed_at)
pointed_at
  = ("a" | "hacia")? objects
"""


class PointAt(HandMove):
    """Point at a thing."""

    name = "point_at"
    words = Words(
        verbs=(
            "point at",
            "point to",
            "point your hand at",
            "point the hand at",
            "show me",
            "look at",
            "have a look at",
            "take a look at",
            "face",
        ),
        object="object",
        hand="any",
    )

    translations: ClassVar[Mapping[str, str]] = {"german": _GERMAN, "spanish": _SPANISH}

    def run(self, ctx: SkillContext, *, object: str) -> SkillResult:
        """Bring the hand before a thing and point it there; nothing is touched, and what is held stays held.

        Args:
            object: Id of the thing.

        Raises:
            ObjectNotFoundError: It is not seen.
            UnreachableError: The hand cannot point there.
            CollisionError: Something is in the way.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        at = centre(arm.find(object))
        base = arm.start.base_xy
        towards = float(np.arctan2(at[1] - base[1], at[0] - base[0]))
        failure: UnreachableError | CollisionError | None = None
        for slant in _SLANTS:
            along = np.array([np.sin(slant) * np.cos(towards), np.sin(slant) * np.sin(towards), -np.cos(slant)])
            for distance in _DISTANCES:
                x, y, z = at - distance * along
                try:
                    detail = arm.bring((float(x), float(y), float(z)), tilt=slant, towards=towards)
                except (UnreachableError, CollisionError) as error:
                    failure = failure or error
                    continue
                shown = arm.state.tcp_pose.rotation[:, 2]
                line = at - arm.state.tcp_pose.position
                off = float(np.degrees(np.arccos(np.clip(shown @ line / np.linalg.norm(line), -1.0, 1.0))))
                return SkillResult(skill=self.name, detail={**detail, "object": object, "points_off_deg": off})
        assert failure is not None
        raise failure
