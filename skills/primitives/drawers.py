"""Opening and closing of drawers: grip, sliding direction, and the forces that the hand feels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from robosandbox.driver import require
from robosandbox.errors import (
    CollisionError,
    DrawerError,
    GraspError,
    Phase,
    SkillError,
    UnreachableError,
)
from robosandbox.evidence import DrawerEvidence, GraspEvidence
from robosandbox.shapes.drawer import DrawerParts
from robosandbox.skills.primitives.gripping import empty_aperture
from robosandbox.skills.primitives.guarded import follow_free, follow_until
from robosandbox.skills.primitives.manipulator import (
    HOVER_HEIGHT,
    Manipulator,
    most_telling,
    withdrawn,
)
from robosandbox.types import Array, DetectedObject, Pose, Trajectory
from robosandbox.types.robot import GripperGeometry
from robosandbox.world.nearness import nearer
from robosandbox.world.relations import bottom, contents, top

# Share of its way by which a drawer has to come out; chosen so that the seeds' task, which asks for 80 mm of 120, is
# passed (halved nothing changes, at more than the way no drawer is open).
OPEN_SHARE = 0.75
# Share of the joints' speed limits at which a drawer is slid; chosen so that it stops within millimetres where it
# resists (halved, drawer tasks take 21 % longer, doubled 11 % less; all succeed).
SLIDE_SPEED = 0.12
# Likewise where it meets its stop; chosen so that what a servo trails by, 1.8 N for each mm/s as measured on the bundled
# arm, stays below MOST_FORCE.
_STOP_SPEED = 0.012
# Metres to a drawer within which a thing stands against it; chosen above perception's error.
_AGAINST = 0.005
# A drawer that runs takes a few newtons; one that resists more than this is stuck, and more might break it or drag its cabinet along.
MOST_FORCE = 20.0
# Metres within which a pulled drawer has not moved; chosen above perception's error.
LOCKED_WITHIN = 0.003
# Metres that the hand goes at first; chosen as the least that perception tells from nothing (halved and doubled, drawer
# tasks take as long within 1 %).
_TRIAL = 0.005
# Share of these first metres that a drawer has to follow; chosen for the play of a grip between two fingers.
_FOLLOWS = 0.4
# N above which a drawer resists; chosen above the friction of a drawer that runs and far below MOST_FORCE.
RESISTED = 5.0
_PITCHES = tuple(np.radians([0.0, 25.0, 50.0, 75.0, 90.0]))
# Metres between each finger and the grip before they close; chosen as ten times perception's error (halved or doubled,
# 2 % of an episode's time).
_PRESHAPE = 0.012
_HOVERS = (HOVER_HEIGHT, 0.05, 0.035)
_UP = np.array([0.0, 0.0, 1.0])


def box_of(drawer: DetectedObject) -> str:
    """Return what the world calls the drawer's sliding box, its grip included."""
    return f"{drawer.id}/box"


def opening_of(drawer: DetectedObject) -> float:
    """Return how far a drawer is open, metres; closed where that is not seen."""
    return drawer.opening or 0.0


def find_drawer(arm: Manipulator, name: str) -> DetectedObject:
    """Return a seen drawer.

    Raises:
        ObjectNotFoundError: Nothing seen has this id.
        UnsupportedError: The driver does not tell how hard the hand pulls.
    """
    require(arm.driver, "wrist_wrench", "a drawer that is locked or blocked is told by how hard the hand pulls at it")
    found = arm.find(name)
    return found


def outwards(drawer: DetectedObject) -> Array:
    """Return the unit vector (3,) along which it opens."""
    direction: Array = -drawer.pose.rotation[:, 0]
    return direction


def grip_point(drawer: DetectedObject) -> Array:
    """Return the middle of its grip in the world, shape (3,)."""
    shape = DrawerParts.of(drawer.size)
    point: Array = (
        drawer.pose.position + drawer.pose.rotation @ shape.grip_centre + opening_of(drawer) * outwards(drawer)
    )
    return point


def hand_rotations(drawer: DetectedObject, hand: Array, pitches: tuple[float, ...] = _PITCHES) -> list[Array]:
    """Return TCP rotations (3, 3) that close across the slide: pointing down first, then pitched towards the front.

    Args:
        drawer: Which.
        hand: The TCP's rotation now (3, 3); of two opposite hands the one that turns less comes first.
        pitches: From straight down, radians.
    """
    across, inwards = drawer.pose.rotation[:, 1], -outwards(drawer)
    found = []
    for pitch in pitches:
        approach = np.sin(pitch) * inwards - np.cos(pitch) * _UP
        both = [np.column_stack([np.cross(y, approach), y, approach]) for y in (across, -across)]
        found += sorted(both, key=lambda rotation: -float(np.trace(hand.T @ rotation)))
    return found


def grip_width(drawer: DetectedObject) -> float:
    """Return how wide its grip is between the fingers, metres."""
    return 2.0 * float(DrawerParts.of(drawer.size).grip[1])


def grip_aperture(geometry: GripperGeometry, drawer: DetectedObject) -> float:
    """Return how far apart the fingers come to its grip, metres."""
    return min(geometry.max_aperture, grip_width(drawer) + 2.0 * _PRESHAPE)


def grip_poses(geometry: GripperGeometry, drawer: DetectedObject, hand: Array) -> list[Pose]:
    """Return the TCP poses that take its grip between the fingers, the first to be tried first.

    Args:
        geometry: The gripper's figures.
        drawer: As it is seen now.
        hand: The TCP's rotation now (3, 3).
    """
    point, aside = grip_point(drawer), geometry.centre(grip_width(drawer))
    return [Pose.from_matrix(point - aside * rotation[:, 1], rotation) for rotation in hand_rotations(drawer, hand)]


@dataclass(frozen=True, slots=True)
class GripWay:
    """The ways to a drawer's grip: to over it, and down to it."""

    approach: Trajectory
    descent: Trajectory


def take_grip(arm: Manipulator, drawer: DetectedObject, travel: float) -> None:
    """Close the fingers on the drawer's grip.

    Args:
        arm: Whose fingers; they are open and empty.
        drawer: As it is seen now.
        travel: How far the hand is then to go outwards, metres; grasps that cannot are left out.

    Raises:
        UnreachableError: Its grip, or the end of its way, is out of reach.
        CollisionError: Something is in the way.
        GraspError: The fingers are too narrow for it, or met nothing.
    """
    geometry = arm.geometry
    width = grip_width(drawer)
    if not geometry.min_aperture + 0.001 < width < geometry.max_aperture - 0.004:
        raise _missed(arm, drawer, "none_found", width, Phase.PLAN)
    arm.ctx.enter(Phase.PLAN)
    arm.use(arm.look())
    aperture = grip_aperture(geometry, drawer)
    arm.motion.open_to(aperture)
    way = plan_pull(arm, drawer, travel)
    arm.open_for(way.approach, aperture)
    follow_free(arm, way.approach, Phase.APPROACH)
    follow_free(arm, way.descent, Phase.DESCEND)
    arm.ctx.enter(Phase.GRASP)
    closed = arm.close_on(width)
    if closed < empty_aperture(geometry, width):
        raise _missed(arm, drawer, "missed", closed, Phase.GRASP)


def plan_pull(arm: Manipulator, drawer: DetectedObject, travel: float) -> GripWay:
    """Return the first way to a drawer's grip from which the hand can pull it outwards by `travel` metres.

    Raises:
        UnreachableError: Its grip, or the end of its way, is out of reach.
        CollisionError: Something is in the way.
    """
    q, hand, away = arm.q, arm.state.tcp_pose.rotation, outwards(drawer)
    failures: list[SkillError] = []
    for tcp in grip_poses(arm.geometry, drawer, hand):
        for height in _HOVERS:
            try:
                arm.motion.allow(box_of(drawer))
                descent = arm.line_to(tcp, withdrawn(tcp, height), speed=arm.tempo.near)
                arm.motion.allow()
                approach = arm.motion.plan_joints(q, descent.q[0], speed=arm.tempo.free)
                arm.motion.allow(box_of(drawer))
                end = moved_by(tcp, travel * away)
                pull = arm.motion.plan_line(descent.q[-1], end, speed=SLIDE_SPEED)
                arm.motion.ik(withdrawn(end, _HOVERS[-1]), pull.q[-1])
            except (UnreachableError, CollisionError) as error:
                failures.append(error)
                continue
            return GripWay(approach, descent)
    raise most_telling(failures)


def slide(
    arm: Manipulator, drawer: DetectedObject, free: float, travel: float, direction: Array, *, stop: float = 0.0
) -> float:
    """Move the hand along while the drawer gives way; return the most that the hand pressed with, N.

    A few millimetres are tried first: a drawer that has not followed them would only drag its cabinet along.

    Args:
        arm: Its hand is at the drawer's grip.
        drawer: As it was seen last.
        free: How far the hand goes before it meets the grip, metres.
        travel: How far it goes from there.
        direction: The way that the drawer is to go, a unit vector (3,).
        stop: How far before the end the drawer may meet a stop, metres: from there the hand goes slowly.

    Raises:
        UnreachableError: The way leads out of reach.
        CollisionError: Something is in the way.
    """
    force = 0.0

    def felt() -> bool:
        nonlocal force
        now = float(arm.force_on(drawer.id) @ direction)
        force = max(force, now)
        return now > MOST_FORCE

    arm.ctx.enter(Phase.SLIDE)
    observation = arm.state
    trial = min(_TRIAL, travel)
    ways = [(free + trial, SLIDE_SPEED), (free + travel - stop, SLIDE_SPEED), (free + travel, _STOP_SPEED)]
    for distance, speed in ways if trial < travel - stop and stop else (ways[0], (free + travel, SLIDE_SPEED)):
        goal = moved_by(observation.tcp_pose, distance * direction)
        stopped = follow_until(arm, arm.motion.plan_line(arm.q, goal, speed=speed), Phase.SLIDE, felt)
        gone = abs(opening_of(arm.find(drawer.id, arm.look())) - opening_of(drawer))
        if stopped or gone < _FOLLOWS * trial:
            break
    return force


def let_go(arm: Manipulator, drawer: DetectedObject) -> None:
    """Open the fingers and withdraw the hand from the grip, as far as it goes."""
    arm.ctx.enter(Phase.RELEASE)
    aperture = arm.gripper.width + 2.0 * _PRESHAPE
    arm.open(aperture)
    withdraw(arm, drawer)


def withdraw(arm: Manipulator, drawer: DetectedObject) -> None:
    """Move the hand back along its approach, away from the grip; failing that, up.

    Raises:
        UnreachableError: It cannot.
        CollisionError: Something is in the way.
    """
    arm.use(arm.look())
    arm.motion.allow(box_of(drawer))
    observation = arm.state
    for distance in _HOVERS:
        try:
            back = arm.motion.plan_line(observation.q, withdrawn(observation.tcp_pose, distance), speed=arm.tempo.free)
        except (UnreachableError, CollisionError):
            continue
        arm.follow(back, Phase.RETREAT)
        return
    arm.rise(HOVER_HEIGHT, Phase.RETREAT)


def moved_by(pose: Pose, offset: Array) -> Pose:
    """Return the pose shifted by an offset (3,) in the world."""
    return Pose.from_matrix(pose.position + offset, pose.rotation)


def stuck(arm: Manipulator, drawer: DetectedObject, before: DetectedObject, wanted: float, force: float) -> DrawerError:
    """Return the error for a drawer that is not as far open as wanted.

    Args:
        arm: Whose hand was at it.
        drawer: As it is seen now.
        before: As it was seen when the hand began.
        wanted: The opening asked for, metres.
        force: The most that the hand felt, N.
    """
    opening, gone = opening_of(drawer), abs(opening_of(drawer) - opening_of(before))
    verb = "pulled" if wanted > opening else "pushed"
    blocking = _in_the_way(arm, drawer, inside=verb == "pushed")
    reason: Literal["locked", "blocked", "slipped"] = "slipped"
    if force > RESISTED:
        reason = "blocked" if blocking or gone > LOCKED_WITHIN else "locked"
    figures = f"{verb} with {force:.0f} N it is {opening * 1000:.0f} mm open, {wanted * 1000:.0f} mm was wanted"
    said = {
        "locked": f"{drawer.id} is locked: {figures}; unlock it, or leave it",
        "blocked": f"{drawer.id} is blocked: {figures}; clear "
        + (f"{', '.join(blocking)} away" if blocking else "what is in its way"),
        "slipped": f"the hand slipped off {drawer.id}: {figures}; try again",
    }
    return DrawerError(
        said[reason],
        phase=Phase.SLIDE,
        evidence=DrawerEvidence(
            drawer=drawer.id, reason=reason, wanted=wanted, opening=opening, force=force, blocking=blocking
        ),
    )


def _in_the_way(arm: Manipulator, drawer: DetectedObject, *, inside: bool) -> tuple[str, ...]:
    """Return what keeps a drawer from sliding: what lies in it and stands out over its rim, or what stands against it."""
    shape = DrawerParts.of(drawer.size)
    rim = drawer.pose.xyz[2] + shape.rim
    scene = arm.look()
    within = {name for name, _ in contents(scene.objects, drawer)}
    others = [item for item in scene.objects if item.id != drawer.id]
    if inside:
        return tuple(item.id for item in others if item.id in within and top(item) > rim)
    return tuple(
        item.id for item in others if item.id not in within and bottom(item) < rim and nearer(drawer, item, _AGAINST)
    )


def _missed(
    arm: Manipulator, drawer: DetectedObject, reason: Literal["none_found", "missed"], aperture: float, phase: str
) -> GraspError:
    width = grip_width(drawer)
    geometry = arm.geometry
    said = (
        f"the fingers open {geometry.min_aperture * 1000:.0f}..{geometry.max_aperture * 1000:.0f} mm and the grip of "
        f"{drawer.id} is {width * 1000:.0f} mm wide"
        if reason == "none_found"
        else f"the fingers closed to {aperture * 1000:.1f} mm and missed the grip of {drawer.id}; look again"
    )
    return GraspError(
        said,
        phase=phase,
        evidence=GraspEvidence(
            object=drawer.id,
            reason=reason,
            object_width=width,
            aperture=arm.gripper.width,
            max_aperture=geometry.max_aperture,
        ),
    )
