"""Turn: turn an object about the vertical where it stands."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.skills.base import Skill
from robosandbox.skills.pick import Pick
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.placing import place
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import SENSES, TURNS, Slot, Words
from robosandbox.types import DetectedObject, ObservedScene, SkillCall, SkillResult
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.changes import TURN_TOLERANCE, turn_between
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.placement_sampling import turning_placement, yaw_to_align
from robosandbox.world.relations import MeasuredRelation, bottom, centre, inside, on_top
from robosandbox.world.standing import AT_TOLERANCE

# Number of grips that a turn may take; chosen because an arm's last joint goes about half a turn at a time, and what is
# asked may be a whole one.
_GRIPS = 4


_GERMAN = """
TURN
  turn = verb dreh, verb rotier
ROUND
  round = herum, um
ANGLE
  0.017453292519943295 = grad, °
  6.283185307179586 = umdrehung, umdrehungen, drehung, drehungen
SENSE
  -1 = in dem uhrzeigersinn, nach rechts, rechtsherum, rechts herum
  1 = gegen den uhrzeigersinn, entgegen dem uhrzeigersinn, nach links, linksherum, links herum
join ROUND VERBS
order : Command
  = verb=worded skill=turn simple(TURN turned)
  = verb=worded skill=turn parted(TURN ROUND turned)
gap : Command
  = objects slots+:turning
turned
  = objects slots+:turning
  = objects
turning : slot
  = angle:turned_angle
turned_angle : product
  = "um"? of+:count of+:ANGLE of+:SENSE?
  = of+:SENSE "um"? of+:count of+:ANGLE
"""
_SPANISH = """
TURN
  turn = ar gir, ar rot, gira(imp), gire(imp)
join TURN CLITIC
ANGLE
  0.017453292519943295 = grado, grados, °
  6.283185307179586 = vuelta, vueltas
SENSE
  -1 = a la derecha, hacia la derecha, en sentido horario, en el sentido de las agujas de el reloj
  1 = a la izquierda, hacia la izquierda, en sentido antihorario, en sentido contrario a las agujas de el reloj
order : Command
  = verb=worded skill=turn act(TURN turned)
gap : Command
  = objects slots+:turning
turned
  = objects slots+:turning
  = objects
turning : slot
  = angle:turned_angle
turned_angle : product
  = of+:count of+:ANGLE of+:SENSE?
  = of+:SENSE of+:count of+:ANGLE
"""
_ENGLISH = """
VTURN verb
  turn, rotate, verbd spin, swivel, twist, align, line up, square
ANGLE
  0.017453292519943295 = degree, degrees, deg
  1.0 = radian, radians, rad
SENSE
  -1 = clockwise, to the right, right
  1 = counterclockwise, counter clockwise, anticlockwise, to the left, left
SHARE
  1.5707963267948966 = a quarter turn
  3.141592653589793 = a half turn, half a turn, halfway, around, round
other
  = verb=worded skill=turn &VTURN objects slots+:turning
  = verb=worded skill=turn &VTURN objects slots+:aligning
  = verb=worded skill=turn &VTURN objects "around"? !
gap : Command
  = objects slots+:turning
turning : slot
  = angle:turned_angle
turned_angle : product
  = ("by" | "through")? of+:count of+:ANGLE of+:SENSE?
  = of+:SENSE ("by" | "through")? of+:count of+:ANGLE
  = ("by" | "through")? of+:SHARE of+:SENSE?
  = of+:SENSE of+:SHARE
aligning : slot
  = align_with:aligned
aligned : any
  = ("to" "align" "with" | "to" "match" | ("parallel" | "in" "line") ("to" | "with") | "with") is:thing
"""


class Turn(Skill):
    """Turn an object about the vertical."""

    name = "turn"
    words = Words(
        verbs=("turn", "rotate", "spin", "swivel", "twist", "turn {} around", "give", "align", "line {} up", "square"),
        object="object",
        slots=(
            Slot(
                argument="angle",
                kind="angle",
                prepositions=("by", "through", ""),
                phrases=(
                    *TURNS,
                    ("a quarter", math.pi / 2.0),
                    ("halfway", math.pi),
                    ("around", math.pi),
                    ("round", math.pi),
                ),
                endings=SENSES,
            ),
            Slot(
                argument="align_with",
                kind="object",
                prepositions=("to align with", "to match", "parallel to", "parallel with", "in line with", "with"),
            ),
        ),
        required=("angle", "align_with"),
        in_hand="turn_hand",
    )

    translations: ClassVar[Mapping[str, str]] = {"english": _ENGLISH, "german": _GERMAN, "spanish": _SPANISH}

    def check(self, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Return the arguments by keyword, converted to their types.

        Raises:
            InvalidArgumentError: One is wrong, or not exactly one of angle and align_with is given.
        """
        checked = super().check(arguments)
        if (checked["angle"] is None) == (checked["align_with"] is None):
            given = "both are given" if checked["angle"] is not None else "neither is given"
            raise InvalidArgumentError(f"{self.name}: give either angle or align_with; {given}", phase=Phase.CHECK)
        return checked

    def contract(self, *, object: str, angle: float | None, align_with: str | None) -> Contract:
        """Return what turning an object needs and brings about."""
        goal = fact("turned", object, angle or 0.0) if align_with is None else fact("aligned", object, align_with)
        other = () if align_with is None else (fact("distinct", object, align_with), fact("has_heading", align_with))
        room = (
            fact("room_to_turn", object, angle or 0.0)
            if align_with is None
            else fact("room_to_align", object, align_with)
        )
        return Contract(
            needs=(
                *other,
                fact("has_heading", object),
                fact("hand_empty"),
                *Pick().contract(object=object).needs,
                room,
            ),
            gives=(goal, fact("hand_empty")),
        )

    def alternatives(
        self, failed: FailedCall, *, object: str, angle: float | None, align_with: str | None
    ) -> Iterator[Alternative]:
        """Yield what is left of a turn by an angle."""
        before, now = failed.before.find(object), failed.scene.find(object)
        if angle is None or align_with is not None or before is None or now is None or not failed.had_begun:
            return
        left = math.remainder(angle - turn_between(before, now), math.tau)
        rest = SkillCall(skill=self.name, arguments={"object": object, "angle": left})
        yield Alternative(why="what is left of the turn", call=rest)

    def run(
        self,
        ctx: SkillContext,
        *,
        object: str,
        angle: Annotated[float, Field(ge=-2.0 * math.pi, le=2.0 * math.pi)] | None = None,
        align_with: str | None = None,
    ) -> SkillResult:
        """Turn an object about the vertical where it stands, by an angle or until its sides are parallel to another's.

        Args:
            object: Id of the object.
            angle: By how much, radians; counterclockwise seen from above is positive.
            align_with: Id of the object whose sides its own shall be parallel to, in place of an angle.

        Raises:
            SkillError: As pick and place_at raise them.
        """
        start = Manipulator(ctx)
        before = start.find(object)
        wanted = angle if angle is not None else yaw_to_align(before, start.find(align_with or ""))
        support = _under(before, start.start)
        left = math.remainder(wanted, math.tau)
        for _ in range(_GRIPS):
            if abs(left) < TURN_TOLERANCE / 2.0:
                break
            Pick().run(ctx, object=object)
            arm = Manipulator(ctx)
            held = arm.find(object)
            # The fingers may have turned it while they closed.
            left = math.remainder(wanted - turn_between(before, held), math.tau)
            place(
                arm,
                held,
                [turning_placement(before, left)],
                skill=self.name,
                target="table",
                allowed=support,
                check=lambda placed, scene: _stayed(before, placed),
            )
            after = Manipulator(ctx).find(object)
            left = math.remainder(wanted - turn_between(before, after), math.tau)
        return SkillResult(
            skill=self.name,
            detail={"object": object, "angle_deg": math.degrees(wanted), "off_deg": math.degrees(left)},
        )


def _under(item: DetectedObject, scene: ObservedScene) -> tuple[str, ...]:
    """Return what an object stands on or lies in, as motion planning calls it."""
    others = [other for other in scene.objects if other.id != item.id]
    below = [other.id for other in others if on_top(item, other) or (other.shape.holds_things and inside(item, other))]
    return ("table", *below)


def _stayed(before: DetectedObject, placed: DetectedObject) -> MeasuredRelation:
    """Tell whether an object stands where it stood."""
    off = math.dist(centre(before)[:2], centre(placed)[:2])
    lifted = abs(bottom(placed) - bottom(before))
    return MeasuredRelation(
        off < AT_TOLERANCE and lifted < AT_TOLERANCE, {"off_mm": 1e3 * off, "step_mm": 1e3 * lifted}
    )
