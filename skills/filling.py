"""Where in a container something may go: low, and away from what is there already."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from robosandbox.skills.placing import Spot, about_z, levelled, turns, with_pose, yaw_to_align
from robosandbox.types import Array, DetectedObject, Pose
from robosandbox.world.relations import mouth_of, support, top

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
