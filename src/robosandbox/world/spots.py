"""Where an object may be put: on the table, beside something, in a container; by geometry alone, without an arm."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from robosandbox.types import SIDE_AXES, Array, DetectedObject, ObservedScene, Pose, Side
from robosandbox.world.relations import BESIDE_GAP, bottom, bounds, centre, gap, mouth_of, support, top

# Half of the table's edge, metres: design.md, section 3.
TABLE_HALF_EXTENT = 0.5
# How far over its support an object is let go, metres; the descent ends there.
_DROP = 0.0015
# Free space that is kept around an object on the table, metres; opening fingers need part of it.
_SPACING = 0.008
# Distances beside a neighbour, as shares of BESIDE_GAP, and shifts along it, metres, the best first.
_GAP_SHARES = (0.4, 0.55, 0.3, 0.7, 0.2)
_SHIFTS = (0.0, 0.02, -0.02, 0.04, -0.04)
_SHARES = np.array([0.0, 0.5, -0.5, 1.0, -1.0])
_WALL_ROOM = 0.004
_NEXT_ROOM = 0.004
_ENOUGH_ROOM = 0.04
_ABOVE = 0.001
# How far over its support the object is let go where the hand does not get lower; at last from over the rim.
_DROPS = (0.0, 0.007, 0.015, 0.03, 0.05)
_MOST_PER_DROP = 16
_STEP = 0.005


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


def table_spots(
    scene: ObservedScene, held: DetectedObject, points: Iterable[Array]
) -> tuple[list[Spot], tuple[str, ...]]:
    """Return the free ones of these points (2,) on the table, and the ids of what occupies the others."""
    others = [item for item in scene.objects if item.id != held.id]
    low, high = bounds(held)
    half = (high - low)[:2] / 2.0
    level = levelled(held.pose.rotation)
    spots, blocking = [], []
    for point in points:
        spot = Spot((float(point[0]), float(point[1])), scene.table_height, turns(0.0))
        if (np.abs(point) + half > TABLE_HALF_EXTENT).any():
            continue
        standing = with_pose(held, resting_pose(held, spot, level))
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


def yaw_to_align(held: Pose, target: Pose) -> float:
    """Return the turn about z, radians, that squares the held object's sides with the target's."""
    return _wrap_quarter(target.yaw - Pose.from_matrix(held.position, levelled(held.rotation)).yaw)


def with_pose(item: DetectedObject, pose: Pose) -> DetectedObject:
    """Return the object as if it stood at `pose`."""
    return replace(item, pose=pose)


def resting_pose(held: DetectedObject, spot: Spot, rotation: Array) -> Pose:
    """Return where the object stands on a spot, turned by `rotation` (3, 3)."""
    there = with_pose(held, Pose.from_matrix(np.array([*spot.xy, 0.0]), rotation))
    return Pose.from_matrix(np.array([*spot.xy, spot.height + _DROP - bottom(there)]), rotation)


def levelled(rotation: Array) -> Array:
    """Return the rotation turned by the least angle that makes its most vertical axis vertical."""
    column = int(np.abs(rotation[2]).argmax())
    axis = rotation[:, column] * np.sign(rotation[2, column])
    up = np.array([0.0, 0.0, 1.0])
    cross, cosine = np.cross(axis, up), float(axis @ up)
    skew = np.array([[0, -cross[2], cross[1]], [cross[2], 0, -cross[0]], [-cross[1], cross[0], 0]])
    levelled: Array = (np.eye(3) + skew + skew @ skew / (1.0 + cosine)) @ rotation
    return levelled


def about_z(angle: float) -> Array:
    """Return the rotation (3, 3) about the vertical by an angle, radians."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _wrap(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _wrap_quarter(angle: float) -> float:
    return float((angle + np.pi / 4.0) % (np.pi / 2.0) - np.pi / 4.0)


@dataclass(frozen=True, slots=True)
class _Place:
    xy: tuple[float, float]
    height: float
    yaw: float
    rank: tuple[float, float, float, float]


def spots_in(vessel: DetectedObject, held: DetectedObject, contents: Sequence[DetectedObject]) -> Iterator[Spot]:
    """Yield where the held object may be let go in a container: as low as can be, where there is most room.

    Args:
        vessel: What holds things; of a drawer the open part counts.
        held: What goes in, as it is held.
        contents: What lies in it already.
    """
    places = sorted(_places(vessel, held, contents), key=lambda place: place.rank)
    if not places:
        return
    rim = float(vessel.pose.xyz[2]) + _inside(vessel)[3] + _NEXT_ROOM
    for drop in _DROPS:
        for place in places[:_MOST_PER_DROP]:
            if place.height + drop < rim:
                yield Spot(place.xy, place.height + drop, (place.yaw,))
    for place in places:
        yield Spot(place.xy, max(rim, place.height), (place.yaw,))


def _inside(vessel: DetectedObject) -> tuple[Array, Array, float, float]:
    """Return middle (2,), half-extents (2,), floor and rim of the inside, in the frame of the vessel's pose, metres."""
    room = mouth_of(vessel)
    return room.middle, room.square, room.floor, room.rim


def _places(vessel: DetectedObject, held: DetectedObject, contents: Sequence[DetectedObject]) -> Iterator[_Place]:
    middle, half, floor, _ = _inside(vessel)
    rotation, origin = vessel.pose.rotation, vessel.pose.position
    axes = rotation[:, :2].T
    level = levelled(held.pose.rotation)
    there = [(*_span(item, axes, origin), top(item)) for item in contents]
    for rank, yaw in enumerate(turns(yaw_to_align(held.pose, vessel.pose))):
        upright = with_pose(held, Pose.from_matrix(held.pose.position, about_z(yaw) @ level))
        at, size = _span(upright, axes, origin)
        # The object's origin need not be its middle.
        offset = rotation.T[:2] @ (upright.pose.position - origin) - at
        room = half - size - _WALL_ROOM
        if (room < 0.0).any():
            continue
        for u in _SHARES:
            for v in _SHARES:
                point = middle + np.array([u, v]) * room
                gaps = [float((np.abs(point - other) - size - extent).max()) for other, extent, _ in there]
                under = [height for gap, (_, _, height) in zip(gaps, there, strict=True) if gap < _NEXT_ROOM]
                height = max([float(origin[2]) + floor, *under]) + _ABOVE
                free = min([_ENOUGH_ROOM, *gaps])
                x, y, _ = origin + rotation[:, :2] @ (point + offset)
                order = (round(height / _STEP), -round(free / _STEP), rank // 4, float(np.hypot(u, v)) + 0.01 * rank)
                yield _Place((float(x), float(y)), height, yaw, order)


def _span(item: DetectedObject, axes: Array, origin: Array) -> tuple[Array, Array]:
    """Return the middle and half-extents (2,) of an object along two axes (2, 3), from an origin (3,), metres."""
    high, low = support(item, axes) - axes @ origin, -support(item, -axes) - axes @ origin
    return (high + low) / 2.0, (high - low) / 2.0


def spots_beside(held: DetectedObject, neighbour: DetectedObject, side: Side) -> list[Array]:
    """Return points (2,) for the object's centre on one side of another, the best first."""
    axis = np.array([*SIDE_AXES[side], 0.0])
    across = np.array([-axis[1], axis[0]])
    edge = float(support(neighbour, axis[None])[0] - axis @ centre(neighbour))
    half = float(support(held, -axis[None])[0] + axis @ centre(held))
    middle = centre(neighbour)[:2]
    distances = [edge + half + share * BESIDE_GAP for share in _GAP_SHARES]
    return [middle + axis[:2] * d + across * shift for shift in _SHIFTS for d in distances]
