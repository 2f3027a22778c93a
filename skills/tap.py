"""Tap: touch the top of an object, gently."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from robosandbox.driver import require
from robosandbox.errors import CollisionError, ErrorCode, Phase, SkillError, UnreachableError
from robosandbox.evidence import Evidence
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.guarded import follow_free, follow_until, touching_line
from robosandbox.skills.primitives.manipulator import (
    HOVER_HEIGHT,
    Manipulator,
    leaning,
    most_telling,
    raised,
)
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Array, DetectedObject, Pose, SkillResult, Trajectory
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.relations import centre, moved, top

FELT = 0.5
# Metres that a tapped object may move; chosen above perception's error, below what anybody calls moving it.
_MOST_MOVED = 0.004
# Metres above the top from which the hand goes slowly; chosen above a size's error (halved 4 % shorter episodes,
# doubled 10 % longer).
_NEAR = 0.006
# Metres below the top as seen that the hand may go, the most that is free first; chosen for a size that is seen too
# large.
_DEPTHS = (0.006, 0.003, 0.001)
# Number of headings of the hand, all around; chosen as every 45 degrees.
_YAWS = 8
# Rad by which the hand leans outwards; chosen in steps of 20 degrees for short arms (docs/arms.md).
_LEANS = (0.0, 0.35, 0.7)
# Places on a rim that are tried.
_RIM_TAPS = 4


class TapEvidence(Evidence):
    """Force of a touch, and what it moved.

    Attributes:
        object: Id.
        force: The largest felt, N.
        moved: How far the object went, metres.
    """

    object: str
    force: float
    moved: float


class TapError(SkillError):
    """The touch was not felt, or it moved the object."""

    code = ErrorCode.TAP
    evidence_type: ClassVar[type[Evidence] | None] = TapEvidence


class Tap(Skill):
    """Touch the top of an object, gently."""

    name = "tap"

    def contract(self, *, object: str) -> Contract:
        """Return what touching the top of an object needs and brings about."""
        return Contract(
            needs=(
                fact("touchable", object),
                fact("hand_empty"),
                fact("accessible", object),
                fact("clear", object),
                fact("may_press", FELT),
                fact("reachable", object),
            ),
            gives=(fact("tapped", object),),
        )

    def run(self, ctx: SkillContext, *, object: str) -> SkillResult:
        """Touch the top of an object from above and rise again.

        Args:
            object: Id of the object.

        Raises:
            ObjectNotFoundError: It is not seen.
            InvalidArgumentError: It has no top of its own, or something stands on it.
            AlreadyHoldingError: The gripper is full.
            UnsupportedError: The driver feels no touch.
            UnreachableError: Its top is out of reach.
            CollisionError: Something is in the way.
            TapError: Nothing was felt there, or the object was moved.
        """
        # Before the hand moves.
        require(ctx.driver, "wrist_wrench", "a tap ends where the object is felt")
        arm = Manipulator(ctx)
        before = arm.find(object)
        if arm.spec.gripper is not None:
            arm.open(0.0)
        force = _touch(arm, before)
        after = arm.find(object, arm.settle(object))
        gone = moved(before, after)
        if force < FELT or gone > _MOST_MOVED:
            said = (
                f"felt nothing at the top of {object}"
                if force < FELT
                else f"touched {object} with {force:.1f} N and moved it {gone * 1000:.1f} mm"
            )
            raise TapError(
                f"{said}; look again and tap it anew",
                phase=Phase.VERIFY,
                evidence=TapEvidence(object=object, force=force, moved=gone),
            )
        return SkillResult(
            skill=self.name,
            detail={"object": object, "force_n": force, "moved_mm": 1e3 * gone},
        )


def _touch(arm: Manipulator, target: DetectedObject) -> float:
    """Go down until the object is felt, and up again; return the most that was felt, N."""
    arm.ctx.enter(Phase.PLAN)
    arm.use(arm.look())
    failures: list[SkillError] = []
    q, hand = arm.q, arm.state.tcp_pose.rotation
    for tcp in _poses(arm, target, hand):
        try:
            arm.motion.allow()
            descent = arm.line_to(raised(tcp, _NEAR), raised(tcp, HOVER_HEIGHT), speed=arm.tempo.near)
            approach = arm.motion.plan_joints(q, descent.q[0], speed=arm.tempo.free)
            arm.motion.allow(target.id)
            touch = _deepest(arm, descent.q[-1], tcp)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
            continue
        follow_free(arm, approach, Phase.APPROACH)
        follow_free(arm, descent, Phase.DESCEND)
        return _feel(arm, target, touch)
    raise most_telling(failures)


def _deepest(arm: Manipulator, q: Array, tcp: Pose) -> Trajectory:
    """Return a slow way down, to a little below where the top is seen: as far below as is free."""
    for depth in _DEPTHS:
        try:
            return touching_line(arm, q, raised(tcp, -depth))
        except CollisionError as error:
            if depth == _DEPTHS[-1]:
                raise error
    raise AssertionError("no depth was tried")


def _feel(arm: Manipulator, target: DetectedObject, touch: Trajectory) -> float:
    most = 0.0

    def felt() -> bool:
        nonlocal most
        most = max(most, float(np.linalg.norm(arm.force_on(target.id))))
        return most >= FELT

    follow_until(arm, touch, Phase.TOUCH, felt)
    arm.use(arm.look())
    arm.motion.allow(target.id)
    arm.rise(HOVER_HEIGHT, Phase.RETREAT)
    return most


def _poses(arm: Manipulator, target: DetectedObject, hand: Array) -> Iterator[Pose]:
    """Yield TCP poses with the fingertips at the top of the object: straight down first, the least turned first."""
    robot = arm.spec
    tip = robot.gripper.geometry.tip_depth if robot.gripper else 0.0
    down = np.array([0.0, 0.0, -1.0])
    angles = target.pose.yaw + 2.0 * np.pi * np.arange(_YAWS) / _YAWS
    closing = [np.array([np.cos(angle), np.sin(angle), 0.0]) for angle in angles]
    rotations = [np.column_stack([np.cross(y, down), y, down]) for y in closing]
    rotations.sort(key=lambda rotation: -round(float(np.trace(hand.T @ rotation)), 6))
    for lean in _LEANS:
        for point in _tops(target):
            for rotation in rotations:
                upright = Pose.from_matrix(point, rotation)
                leant = leaning(upright, robot.base_position, lean)
                yield Pose.from_matrix(point - tip * leant.rotation[:, 2], leant.rotation)


def _tops(target: DetectedObject) -> list[Array]:
    """Return points (3,) of the object's top: its middle, or places on a container's rim."""
    height, room = top(target), target.shape.room(target.size)
    if room is None or target.shape.opens:
        points = [centre(target)]
    else:
        places = [place for place, _ in room.rim_places()]
        points = [target.pose.position + target.pose.rotation @ place for place in places[:: len(places) // _RIM_TAPS]]
    return [np.array([point[0], point[1], height]) for point in points]
