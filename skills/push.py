"""Push, push to: slide an object along the table with closed fingers, so far or to a point."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from robosandbox.errors import CollisionError, ErrorCode, Phase, SkillError, UnreachableError
from robosandbox.evidence import Evidence
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.guarded import MetError, back_off, follow_free
from robosandbox.skills.primitives.manipulator import HOVER_HEIGHT, Manipulator
from robosandbox.skills.primitives.pressing import Pressed, press_along
from robosandbox.skills.primitives.strokes import STAND_OFF, Stroke, plan_push_to, plan_stroke
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import (
    DIRECTION_AXES,
    Array,
    DetectedObject,
    Direction,
    ObservedScene,
    SkillCall,
    SkillResult,
)
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.changes import push_allowance
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import TABLE, fact
from robosandbox.world.nearness import nearer
from robosandbox.world.relations import centre, displacement, on_table, top
from robosandbox.world.standing import AT_TOLERANCE

# Share of what an object stands above the fingertips by which the hand may rise; chosen: at the whole of it the hand passes over.
_PASSES = 0.7
# Strokes of a straight push; chosen: most take one, and one passed by the object is turned for the next.
_STROKES = 4
# Strokes of a push to a point; chosen as twice as many: a bent way has two legs.
_STROKES_TO = 2 * _STROKES
# Metres that a stroke has to move the object not to count as missed; chosen as perception's error.
_PROGRESS = 0.002
# Metres to a thing within which the object stands against it; chosen above perception's error.
_AGAINST = 0.005


class PushEvidence(Evidence):
    """Distance that the object went.

    Attributes:
        object: Id.
        wanted: Metres along the direction.
        along: Metres gone along it.
        across: Metres gone beside it.
        reason: It went elsewhere ("missed"), or did not give way to as much force as is allowed ("resisted").
        force: The most that the hand pressed on it with in the last stroke, N; None where the driver does not tell.
        blocking: What it stands against on the side that it was to go to.
        spent: Joint whose servo gave all that it can, and the object did not give way to that.
    """

    object: str
    wanted: float
    along: float
    across: float
    reason: Literal["missed", "resisted"] = "missed"
    force: float | None = None
    blocking: tuple[str, ...] = ()
    spent: str | None = None

    @property
    def is_too_heavy(self) -> bool:
        """Tell whether nothing holds it but its weight: what does not slide under the force that is allowed is not lifted with it."""
        return self.reason == "resisted" and self.force is not None and not self.blocking and not self.spent

    def met(self) -> tuple[str, ...]:
        """Return what the object stands against."""
        return self.blocking


class PushError(SkillError):
    """The object did not go where it was pushed."""

    code = ErrorCode.PUSH
    evidence_type: ClassVar[type[Evidence] | None] = PushEvidence


class Push(Skill):
    """Slide an object along the table."""

    name = "push"

    def contract(self, *, object: str, direction: Direction, distance: float) -> Contract:
        """Return what sliding an object along needs and brings about."""
        return Contract(
            needs=(
                fact("slides", object),
                fact("hand_empty"),
                fact("accessible", object),
                fact("on_the_open", object),
                fact("way_on_table", object, direction, distance),
                fact("reachable", object),
                fact("reachable_after", object, direction, distance),
                fact("room_behind", object, direction, distance),
            ),
            gives=(fact("displaced", object, direction, distance),),
        )

    def alternatives(
        self, failed: FailedCall, *, object: str, direction: Direction, distance: float
    ) -> Iterator[Alternative]:
        """Yield the rest of the way, and carrying it there in place of pushing."""
        before, now = failed.before.find(object), failed.scene.find(object)
        if before is None or now is None:
            return
        evidence = failed.error.evidence
        measured = evidence.along if isinstance(evidence, PushEvidence) else None
        gone = displacement(before, now, direction).detail["along_mm"] / 1000.0 if measured is None else measured
        left = round(distance - gone, 4)
        if failed.had_begun and left > _PROGRESS:
            rest = SkillCall(skill=self.name, arguments={"object": object, "direction": direction, "distance": left})
            yield Alternative(why="what is left of the way", call=rest)
        if isinstance(evidence, PushEvidence) and evidence.is_too_heavy:
            return
        x, y = centre(now)[:2] + left * np.array(DIRECTION_AXES[direction])
        there = fact("at", object, round(float(x), 4), round(float(y), 4))
        yield Alternative(why="carried there in place of pushed", first=(there,))

    def run(
        self,
        ctx: SkillContext,
        *,
        object: str,
        direction: Direction,
        distance: Annotated[float, Field(gt=0.0, le=1.0)] = 0.1,
    ) -> SkillResult:
        """Slide an object along the table with the closed fingers.

        Args:
            object: Id of the object.
            direction: Where to; forward is away from the robot, left is its left.
            distance: How far, metres.

        Raises:
            ObjectNotFoundError: It is not seen.
            AlreadyHoldingError: The gripper is full.
            UnreachableError: The stroke leaves the robot's reach.
            CollisionError: Something is in the way.
            PushError: The object went elsewhere or not far enough.
            TrackingError: The hand met something on its way behind the object, each time.
        """
        arm = Manipulator(ctx)
        start = arm.find(object)
        allowance = push_allowance(distance)
        axis = np.array([*DIRECTION_AXES[direction], 0.0])

        def left(target: DetectedObject) -> float:
            return distance - float((centre(target) - centre(start)) @ axis)

        def plan(target: DetectedObject, scene: ObservedScene, missed: int) -> Stroke:
            return plan_stroke(arm, target, scene, axis, left(target), missed)

        pressed = _strokes(arm, object, lambda target: left(target) <= allowance / 2.0, plan, _STROKES)
        scene = arm.settle(object)
        after = arm.find(object, scene)
        relation = displacement(start, after, direction, distance - allowance)
        gone = relation.detail["along_mm"] / 1000.0
        if not relation.holds or gone > distance + 2.0 * allowance:
            evidence = PushEvidence(
                object=object,
                wanted=distance,
                along=gone,
                across=relation.detail["across_mm"] / 1000.0,
                reason="resisted" if pressed is not None and not pressed.arrived else "missed",
                force=None if pressed is None or pressed.force is None else round(pressed.force, 2),
                blocking=_ahead(scene, after, axis),
                spent=None if pressed is None else pressed.spent,
            )
            raise PushError(_why(evidence, direction, ctx.max_force_n), phase=Phase.VERIFY, evidence=evidence)
        force = {} if pressed is None or pressed.force is None else {"force_n": pressed.force}
        return SkillResult(
            skill=self.name, detail={"object": object, "direction": direction, **relation.detail, **force}
        )


class PushTo(Skill):
    """Slide an object along the table to a point of it."""

    name = "push_to"

    def contract(self, *, object: str, x: float, y: float) -> Contract:
        """Return what sliding an object to a point needs and brings about; what can be carried there is."""
        return Contract(
            needs=(
                fact("slides", object),
                fact("hand_empty"),
                fact("accessible", object),
                fact("on", object, TABLE),
                fact("on_the_open", object),
                fact("room_to_slide_to", object, x, y),
                fact("reachable", object),
                fact("reachable_at", object, x, y),
                fact("room_to_push_to", object, x, y),
            ),
            gives=(fact("at", object, x, y), fact("on", object, TABLE)),
            rank=1,
        )

    def alternatives(self, failed: FailedCall, *, object: str, x: float, y: float) -> Iterator[Alternative]:
        """Yield the rest of the way, and carrying it there in place of pushing."""
        before, now = failed.before.find(object), failed.scene.find(object)
        if before is None or now is None:
            return
        if failed.had_begun and _missing(before, x, y) - _missing(now, x, y) > _PROGRESS:
            yield Alternative(why="what is left of the way", call=failed.call)
        evidence = failed.error.evidence
        if isinstance(evidence, PushEvidence) and evidence.is_too_heavy:
            return
        yield Alternative(why="carried there in place of pushed", first=(fact("at", object, x, y),))

    def run(self, ctx: SkillContext, *, object: str, x: float, y: float) -> SkillResult:
        """Slide an object along the table to a point with the closed fingers, straight or around what is in the way.

        Args:
            object: Id of the object.
            x: World x, metres; forward from the robot.
            y: World y, metres; to the robot's left.

        Raises:
            ObjectNotFoundError: It is not seen.
            AlreadyHoldingError: The gripper is full.
            UnreachableError: A stroke leaves the robot's reach.
            CollisionError: Something is in the way.
            PushError: The object went elsewhere or not far enough.
            TrackingError: The hand met something on its way behind the object, each time.
        """
        arm = Manipulator(ctx)
        start, goal = arm.find(object), np.array([x, y])
        way = np.array([*(goal - centre(start)[:2]), 0.0])
        wanted = float(np.linalg.norm(way))

        def is_there(target: DetectedObject) -> bool:
            return _missing(target, x, y) < AT_TOLERANCE / 2.0

        def plan(target: DetectedObject, scene: ObservedScene, missed: int) -> Stroke:
            return plan_push_to(arm, target, scene, goal, missed)

        def is_enough(target: DetectedObject) -> bool:
            return _missing(target, x, y) < AT_TOLERANCE

        pressed = _strokes(arm, object, is_there, plan, _STROKES_TO, is_enough)
        scene = arm.settle(object)
        after = arm.find(object, scene)
        standing = on_table(after, scene.table_height)
        off = _missing(after, x, y)
        if not standing.holds or off >= AT_TOLERANCE:
            axis = way / wanted if wanted else np.array([1.0, 0.0, 0.0])
            gone = centre(after) - centre(start)
            evidence = PushEvidence(
                object=object,
                wanted=wanted,
                along=float(gone @ axis),
                across=abs(float(np.cross(axis, gone)[2])),
                reason="resisted" if pressed is not None and not pressed.arrived else "missed",
                force=None if pressed is None or pressed.force is None else round(pressed.force, 2),
                blocking=_ahead(scene, after, axis),
                spent=None if pressed is None else pressed.spent,
            )
            raise PushError(
                _why(evidence, f"towards ({x:.3f}, {y:.3f})", ctx.max_force_n), phase=Phase.VERIFY, evidence=evidence
            )
        force = {} if pressed is None or pressed.force is None else {"force_n": pressed.force}
        return SkillResult(
            skill=self.name, detail={"object": object, "off_mm": 1000.0 * off, **standing.detail, **force}
        )


def _missing(target: DetectedObject, x: float, y: float) -> float:
    """Return how far an object is from a point of the table, metres."""
    return math.dist(centre(target)[:2], (x, y))


def _strokes(
    arm: Manipulator,
    name: str,
    is_there: Callable[[DetectedObject], bool],
    plan: Callable[[DetectedObject, ObservedScene, int], Stroke],
    most: int,
    is_enough: Callable[[DetectedObject], bool] | None = None,
) -> Pressed | None:
    """Push an object until it is there, or resists, or the last stroke is done; return what the last one came to.

    Args:
        arm: Whose hand.
        name: Id of the object.
        is_there: Tells whether it has gone as far as it is to go.
        plan: Returns the next stroke, given how many have passed by the object.
        most: How many strokes there are at most.
        is_enough: Tells whether it has gone far enough where no stroke leads farther.
    """
    missed = 0
    pressed: Pressed | None = None
    last: Stroke | None = None
    for number in range(most):
        scene = arm.look()
        target = arm.find(name, scene)
        stayed = last is not None and last.distance - _missing(target, *last.end) < _PROGRESS
        if is_there(target) or (stayed and pressed is not None and not pressed.arrived):
            break
        # A hand that passed by the object, as between two fixed fingers, is turned for the next stroke.
        missed += stayed
        try:
            last = plan(target, scene, missed)
        except (UnreachableError, CollisionError):
            if pressed is None or is_enough is None or not is_enough(target):
                raise
            break
        try:
            pressed = _carried_out(arm, target, last)
        except MetError as met:
            back_off(arm, met)
            if number == most - 1:
                raise
    return pressed


def _why(evidence: PushEvidence, way: str, most: float) -> str:
    """Return the sentence of a push that did not do what was asked."""
    said = (
        f"{evidence.object} went {evidence.along * 1000:.0f} mm {way} and {evidence.across * 1000:.0f} mm aside in "
        f"place of {evidence.wanted * 1000:.0f} mm"
    )
    if evidence.reason == "missed":
        return f"{said}; look again and push the rest"
    if evidence.spent:
        return f"{said}: it resists {evidence.force:.0f} N, and the servo of {evidence.spent} gives no more; carry it, or clear its way"
    held = (
        f"{', '.join(evidence.blocking)} is in its way"
        if evidence.blocking
        else "it is too heavy or too rough to slide, or something that is not seen holds it"
    )
    if evidence.force is None:
        return f"{said}: the hand does not get on, and this arm feels no force: {held}; clear its way, or carry it"
    return (
        f"{said}: it resists {evidence.force:.0f} N, and limits.max_force_n allows {most:g}; {held}: clear its way, carry it, "
        "or allow more"
    )


def _ahead(scene: ObservedScene, target: DetectedObject, axis: Array) -> tuple[str, ...]:
    """Return what the object stands against on the side that it is pushed to."""
    others = (item for item in scene.objects if item.id not in {target.id, *scene.in_hands})
    return tuple(
        item.id
        for item in others
        if nearer(target, item, _AGAINST) and float((centre(item) - centre(target)) @ axis) > 0.0
    )


def _room_above(arm: Manipulator, target: DetectedObject) -> float:
    """Return how far the hand may rise from where it is and still have an object's side before it, metres."""
    gripper, height = arm.spec.gripper, float(arm.state.tcp_pose.xyz[2])
    tip = height if gripper is None else height - gripper.geometry.tip_depth
    return max(0.0, _PASSES * (top(target) - tip))


def _carried_out(arm: Manipulator, target: DetectedObject, stroke: Stroke) -> Pressed:
    """Put the fingers behind the object and push it once."""
    if arm.spec.gripper is not None:
        arm.open_for(stroke.approach, stroke.aperture)
    follow_free(arm, stroke.approach, Phase.APPROACH)
    follow_free(arm, stroke.descent, Phase.DESCEND)
    pressed = press_along(
        arm, stroke.push, target.id, most=arm.ctx.max_force_n, before=STAND_OFF, rise=_room_above(arm, target)
    )
    arm.use(arm.feel())
    # Pressed against the object, a hand of weak servos sinks onto the table.
    arm.motion.allow("table", target.id)
    arm.rise(HOVER_HEIGHT, Phase.RETREAT)
    return pressed
