"""Putting down what is held: where it may stand, how the hand gets there, and whether it stayed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from robosandbox.errors import (
    CollisionError,
    Phase,
    PlacementError,
    PlacementEvidence,
    SkillError,
    UnreachableError,
)
from robosandbox.perception.relations import Relation, bottom, bounds, gap
from robosandbox.skills.manipulator import CARRY_SPEED, FINE_SPEED, HOVER_HEIGHT, Manipulator, raised
from robosandbox.types import Array, DetectedObject, ObservedScene, Pose, SkillResult, Trajectory

_DROP = 0.0015
_RELEASE_CLEARANCE = 0.012
_RELEASE_SECONDS = 0.1
_TABLE_HALF_EXTENT = 0.5
_SPACING = 0.008
_HIGHER_HOVERS = (HOVER_HEIGHT, 0.05)
_LOWEST_HOVER = 0.03


@dataclass(frozen=True, slots=True)
class Spot:
    """Where the held object may go.

    Attributes:
        xy: The object's origin, metres.
        height: Its lowest point, metres.
        yaws: Headings to try, radians about world z from its present one, best first.
    """

    xy: tuple[float, float]
    height: float
    yaws: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _Way:
    goal: Pose
    transfer: Trajectory
    descent: Trajectory


def place(
    arm: Manipulator,
    held: DetectedObject,
    spots: Sequence[Spot],
    *,
    skill: str,
    target: str,
    allowed: Iterable[str],
    check: Callable[[DetectedObject, ObservedScene], Relation],
) -> SkillResult:
    """Put the held object on the first spot that can be reached, let go, and check where it is.

    Args:
        arm: The skill's manipulator.
        held: What the gripper holds.
        spots: In order of preference.
        skill: Name for the result.
        target: Name for the evidence.
        allowed: What the object or the fingers may touch: the support.
        check: Whether the settled object is where it should be.

    Raises:
        PlacementError: It ended elsewhere or was not let go.
        UnreachableError: No spot can be reached.
        CollisionError: All that can be reached touch something.
    """
    allowed = tuple(allowed)
    if arm.sim.observe().tcp_pose.xyz[2] < _clear_height(arm):
        arm.use(arm.look(), held=held.id)
        arm.motion.allow("table", *(item.id for item in arm.start.objects))
        arm.rise(HOVER_HEIGHT, Phase.LIFT, speed=CARRY_SPEED)
    scene = arm.look()
    held = arm.find(held.id, scene)
    way = _find_way(arm, held, scene, spots, allowed)
    arm.follow(way.transfer, Phase.TRANSFER)
    arm.follow(way.descent, Phase.LOWER, yielding=True)
    _release(arm, held.id, allowed)
    after = arm.settle(held.id)
    placed = arm.find(held.id, after)
    relation = check(placed, after)
    if after.held == held.id or not relation.holds:
        reason: Literal["stuck", "toppled", "missed"] = (
            "stuck" if after.held == held.id else "toppled" if _toppled(way.goal, placed.pose) else "missed"
        )
        figures = ", ".join(f"{name} {value:.1f}" for name, value in relation.detail.items())
        raise PlacementError(
            f"{held.id} is not where it was placed ({target}): {reason}, {figures}; look again and place it anew",
            phase=Phase.VERIFY,
            evidence=PlacementEvidence(
                object=held.id, target=target, reason=reason, expected=way.goal, actual=placed.pose
            ),
        )
    return SkillResult(
        skill=skill,
        detail={"object": held.id, "target": target, **relation.detail},
        side_effects=arm.disturbed(held.id),
    )


def _find_way(
    arm: Manipulator, held: DetectedObject, scene: ObservedScene, spots: Sequence[Spot], allowed: tuple[str, ...]
) -> _Way:
    arm.ctx.enter(Phase.PLAN)
    observation = arm.sim.observe()
    object_in_tcp = observation.tcp_pose.inverse() @ held.pose
    tcp_in_object = object_in_tcp.inverse()
    level = _levelled(held.pose.rotation)
    arm.use(scene, held=held.id)
    failures: list[SkillError] = []
    for spot in spots:
        for yaw in spot.yaws:
            goal = _resting_pose(held, spot, _about_z(yaw) @ level)
            tcp_goal = goal @ tcp_in_object
            try:
                hover = _hover(arm, tcp_goal, observation.q)
                arm.motion.allow()
                transfer = arm.motion.plan_joints(observation.q, hover, speed=CARRY_SPEED)
                arm.motion.allow(*allowed)
                descent = arm.motion.plan_line(hover, tcp_goal, speed=FINE_SPEED)
            except (UnreachableError, CollisionError) as error:
                failures.append(error)
                continue
            return _Way(goal, transfer, descent)
    collisions = [error for error in failures if isinstance(error, CollisionError)]
    raise (collisions or failures)[0].at(Phase.PLAN)


def _hover(arm: Manipulator, tcp_goal: Pose, q: Array) -> Array:
    """Return a configuration over the goal: high if it can be reached, else lower.

    Raises:
        UnreachableError: Not even just above it.
    """
    for height in _HIGHER_HOVERS:
        try:
            return arm.motion.ik(raised(tcp_goal, height), q)
        except UnreachableError:
            continue
    return arm.motion.ik(raised(tcp_goal, _LOWEST_HOVER), q)


def _release(arm: Manipulator, object_id: str, allowed: tuple[str, ...]) -> None:
    arm.ctx.enter(Phase.RELEASE)
    arm.sim.step(_RELEASE_SECONDS)
    arm.open(arm.gripper.width + 2.0 * _RELEASE_CLEARANCE)
    arm.use(arm.look())
    arm.motion.allow(object_id, *allowed)
    try:
        arm.rise(HOVER_HEIGHT, Phase.RETREAT, speed=CARRY_SPEED)
    except CollisionError:
        # The fingers opened against a neighbour; straight up is still the way that disturbs it least.
        arm.motion.allow("table", *(item.id for item in arm.start.objects))
        arm.rise(HOVER_HEIGHT, Phase.RETREAT, speed=FINE_SPEED)


def table_spots(arm: Manipulator, held: DetectedObject, points: Iterable[Array]) -> tuple[list[Spot], tuple[str, ...]]:
    """Return the free ones of these points (2,) on the table, and the ids of what occupies the others."""
    scene = arm.look()
    others = [item for item in scene.objects if item.id != held.id]
    low, high = bounds(held)
    half = (high - low)[:2] / 2.0
    level = _levelled(held.pose.rotation)
    spots, blocking = [], []
    for point in points:
        spot = Spot((float(point[0]), float(point[1])), scene.table_height, turns(0.0))
        if (np.abs(point) + half > _TABLE_HALF_EXTENT).any():
            continue
        standing = with_pose(held, _resting_pose(held, spot, level))
        near = [item.id for item in others if gap(standing, item) < _SPACING and bottom(item) < bounds(standing)[1][2]]
        blocking += near
        if not near:
            spots.append(spot)
    return spots, tuple(dict.fromkeys(blocking))


def turns(first: float) -> tuple[float, ...]:
    """Return headings to try: `first`, the other square ones from it, then the ones between, radians."""
    quarters = sorted((_wrap(first + k * np.pi / 2.0) for k in range(4)), key=abs)
    eighths = sorted((_wrap(first + np.pi / 4.0 + k * np.pi / 2.0) for k in range(4)), key=abs)
    return (*quarters, *eighths)


def occupied(held: str, target: str, blocking: Sequence[str]) -> PlacementError:
    """Return the error for a place that has no room."""
    by = f"occupied by {', '.join(blocking)}" if blocking else "off the table or too small"
    return PlacementError(
        f"no room for {held} at {target}: {by}; clear it or choose another place",
        phase=Phase.PLAN,
        evidence=PlacementEvidence(object=held, target=target, reason="occupied", blocking=tuple(blocking)),
    )


def yaw_to_align(held: Pose, target: Pose) -> float:
    """Return the turn about z, radians, that squares the held object's sides with the target's."""
    return _wrap_quarter(target.yaw - Pose.from_matrix(held.position, _levelled(held.rotation)).yaw)


def with_pose(item: DetectedObject, pose: Pose) -> DetectedObject:
    """Return the object as if it stood at `pose`."""
    return replace(item, pose=pose)


def _resting_pose(held: DetectedObject, spot: Spot, rotation: Array) -> Pose:
    there = with_pose(held, Pose.from_matrix(np.array([*spot.xy, 0.0]), rotation))
    return Pose.from_matrix(np.array([*spot.xy, spot.height + _DROP - bottom(there)]), rotation)


def _levelled(rotation: Array) -> Array:
    """Return the rotation turned by the least angle that makes its most vertical axis vertical."""
    column = int(np.abs(rotation[2]).argmax())
    axis = rotation[:, column] * np.sign(rotation[2, column])
    up = np.array([0.0, 0.0, 1.0])
    cross, cosine = np.cross(axis, up), float(axis @ up)
    skew = np.array([[0, -cross[2], cross[1]], [cross[2], 0, -cross[0]], [-cross[1], cross[0], 0]])
    levelled: Array = (np.eye(3) + skew + skew @ skew / (1.0 + cosine)) @ rotation
    return levelled


def _clear_height(arm: Manipulator) -> float:
    tops = [bounds(item)[1][2] for item in arm.start.objects if item.id != arm.start.held]
    return float(max([arm.start.table_height, *tops]) + HOVER_HEIGHT)


def _toppled(goal: Pose, actual: Pose) -> bool:
    return bool((goal.rotation[2] @ actual.rotation[2]) < 0.9)


def _about_z(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _wrap(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _wrap_quarter(angle: float) -> float:
    return float((angle + np.pi / 4.0) % (np.pi / 2.0) - np.pi / 4.0)
