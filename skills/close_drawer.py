"""Close drawer: push a drawer shut at its grip."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robosandbox.errors import CollisionError, Phase, SkillError, UnreachableError
from robosandbox.shapes.drawer import DrawerParts
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.drawers import (
    RESISTED,
    SLIDE_SPEED,
    box_of,
    find_drawer,
    grip_point,
    hand_rotations,
    moved_by,
    opening_of,
    outwards,
    slide,
    stuck,
    withdraw,
)
from robosandbox.skills.primitives.guarded import follow_free
from robosandbox.skills.primitives.manipulator import (
    HOVER_HEIGHT,
    Manipulator,
    most_telling,
    raised,
)
from robosandbox.skills.primitives.strokes import flange_depth
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Array, DetectedObject, Pose, SkillResult
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.relations import CLOSED_WITHIN

# Metres before the grip from which it is pushed; chosen as ten times perception's error.
_STAND_OFF = 0.012
# Metres beyond shut that the hand goes; chosen within CLOSED_WITHIN, and little enough for servos to give.
_PRESS = 0.002
# Metres before the end of a push within which the drawer meets its stop; chosen as perception's error beyond _PRESS.
_STOP_WITHIN = 0.006
# Pushes until it is given up; chosen as in `pick`.
_STROKES = 3
_PITCHES = tuple(np.radians([0.0, 25.0, 45.0]))


class CloseDrawer(Skill):
    """Push a drawer shut at its grip."""

    name = "close_drawer"

    def contract(self, *, drawer: str) -> Contract:
        """Return what pushing a drawer shut needs and brings about."""
        return Contract(
            needs=(
                fact("opens", drawer),
                fact("hand_empty"),
                fact("shuts", drawer),
                fact("may_press", RESISTED),
                fact("reachable", drawer),
            ),
            gives=(fact("closed", drawer),),
        )

    def alternatives(self, failed: FailedCall, *, drawer: str) -> Iterator[Alternative]:
        """Yield sliding it out first: what it presses on is free then."""
        if failed.had_begun and failed.met:
            why = f"{', '.join(failed.met)} jams {drawer} and is put aside first"
            yield Alternative(why=why, first=(fact("open", drawer),), cleared=failed.met, call=failed.call)

    def run(self, ctx: SkillContext, *, drawer: str) -> SkillResult:
        """Push a drawer shut.

        Args:
            drawer: Id of the drawer.

        Raises:
            ObjectNotFoundError: It is not seen.
            InvalidArgumentError: It is no drawer.
            AlreadyHoldingError: The gripper is full.
            UnreachableError: The grip, or where it would go, is out of reach.
            CollisionError: Something is in the way.
            DrawerError: It is locked, or something in it or behind it keeps it open.
        """
        arm = Manipulator(ctx)
        before = find_drawer(arm, drawer)
        now, force = before, 0.0
        for stroke in range(_STROKES):
            if opening_of(now) <= CLOSED_WITHIN:
                break
            force = _stroke(arm, now)
            pushed, now = now, arm.find(drawer, arm.settle(drawer))
            gone = opening_of(pushed) - opening_of(now)
            if opening_of(now) > CLOSED_WITHIN and (stroke == _STROKES - 1 or gone < CLOSED_WITHIN):
                raise stuck(arm, now, pushed, 0.0, force)
        return SkillResult(
            skill=self.name,
            detail={
                "drawer": drawer,
                "opening_mm": 1e3 * opening_of(now),
                "force_n": force,
                **({"already_closed": True} if now is before else {}),
            },
        )


def _stroke(arm: Manipulator, drawer: DetectedObject) -> float:
    """Put the closed fingers before the grip and push once; return the most force, N."""
    failures: list[SkillError] = []
    arm.ctx.enter(Phase.PLAN)
    arm.use(arm.look())
    gripper = arm.spec.gripper
    if gripper is not None:
        arm.motion.open_to(gripper.geometry.min_aperture)
    q, hand = arm.q, arm.state.tcp_pose.rotation
    inwards = -outwards(drawer)
    for rotation in (*hand_rotations(drawer, hand, _PITCHES), *_turned(drawer, hand)):
        start = _start(arm, drawer, rotation)
        end = moved_by(start, (opening_of(drawer) + _STAND_OFF + _PRESS) * inwards)
        try:
            arm.motion.allow()
            descent = arm.line_to(start, raised(start, HOVER_HEIGHT), speed=arm.tempo.near)
            approach = arm.motion.plan_joints(q, descent.q[0], speed=arm.tempo.free)
            arm.motion.allow(box_of(drawer))
            arm.motion.plan_line(descent.q[-1], end, speed=SLIDE_SPEED)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
            continue
        if gripper is not None:
            arm.open_for(approach, 0.0)
        follow_free(arm, approach, Phase.APPROACH)
        follow_free(arm, descent, Phase.DESCEND)
        force = slide(arm, drawer, _STAND_OFF, opening_of(drawer) + _PRESS, inwards, stop=_STOP_WITHIN)
        _step_back(arm, drawer)
        withdraw(arm, drawer)
        return force
    raise most_telling(failures)


def _step_back(arm: Manipulator, drawer: DetectedObject) -> None:
    """Take the hand off the grip the way that it came, if it can: one that rises while it presses pulls the drawer up."""
    arm.use(arm.look())
    arm.motion.allow(box_of(drawer))
    state = arm.state
    goal = moved_by(state.tcp_pose, _STAND_OFF * outwards(drawer))
    try:
        back = arm.motion.plan_line(state.q, goal, speed=SLIDE_SPEED)
    except (UnreachableError, CollisionError):
        return
    arm.follow(back, Phase.RETREAT)


def _turned(drawer: DetectedObject, hand: Array) -> list[Array]:
    """Return TCP rotations (3, 3) that point down and close along the slide, where a hand has less room aside."""
    down, out = np.array([0.0, 0.0, -1.0]), outwards(drawer)
    both = [np.column_stack([np.cross(y, down), y, down]) for y in (out, -out)]
    return sorted(both, key=lambda rotation: -float(np.trace(hand.T @ rotation)))


def _start(arm: Manipulator, drawer: DetectedObject, rotation: Array) -> Pose:
    """Return the TCP pose before the grip, from which it is pushed."""
    gripper, shape = arm.spec.gripper, DrawerParts.of(drawer.size)
    point = grip_point(drawer)
    if gripper is not None:
        along = abs(float(rotation[:, 1] @ outwards(drawer))) > 0.5
        depth = gripper.geometry.finger_thickness if along else gripper.geometry.finger_width / 2.0
    else:
        # A flange has no fingers to reach down with: what it pushes with lies above its TCP.
        depth = flange_depth(arm.spec.tool_bounds, -(rotation.T @ outwards(drawer)))
        point[2] -= shape.grip[2]
    distance = depth + float(shape.grip[0]) + _STAND_OFF
    return Pose.from_matrix(point + distance * outwards(drawer), rotation)
