"""Ways out from under something fixed: of what stands on a shelf's board, in a cupboard, or on the table under a board."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from robosandbox.shapes.compound import Geometry
from robosandbox.types import Array, DetectedObject
from robosandbox.world.relations import support

# Metres by which a thing is outside that came out.
OUTSIDE = 0.03
# Metres by which what is over a thing may seem to be lower than its top, and what it stands on higher than its foot.
_SEEN_WITHIN = 0.01


def ways_out(item: DetectedObject, objects: Iterable[DetectedObject], within: float) -> list[Array]:
    """Return the level ways (3,) on which a thing comes out from under what is fixed over it, metres, the shortest first.

    Walls between the boards of a thing of several are known; whether anything else stands in a way is not looked at.

    Args:
        item: What stands there.
        objects: What is seen.
        within: Metres over its top in which there has to be something over it.

    Returns:
        None of them where the room over it is free.
    """
    found = list[Array]()
    for cover in objects:
        if cover.is_fixed and cover.id != item.id and cover.geometry is not None:
            found += _out_from(item, cover, cover.geometry, within)
    return sorted(found, key=lambda way: round(float(np.linalg.norm(way)), 3))


def _out_from(item: DetectedObject, cover: DetectedObject, geometry: Geometry, within: float) -> list[Array]:
    """Return the ways out from under one fixed thing; none where it is not over the other."""
    rotation, origin = cover.pose.rotation, cover.pose.position
    high = support(item, rotation.T) - rotation.T @ origin
    low = -support(item, -rotation.T) - rotation.T @ origin
    over = [
        points
        for points in geometry.corners
        if (points.min(axis=0)[:2] < high[:2]).all()
        and (points.max(axis=0)[:2] > low[:2]).all()
        and -_SEEN_WITHIN < points[:, 2].min() - high[2] < within
    ]
    if not over:
        return []
    middle, half, board = (low + high)[:2] / 2.0, (high - low)[:2] / 2.0, np.vstack(over)[:, :2]
    faces = [
        face for face in geometry.surfaces if abs(face.height - low[2]) < _SEEN_WITHIN and face.margin(middle) > 0.0
    ]
    ways = np.vstack([np.eye(2), -np.eye(2)])
    if faces and len(faces[0].ways_out):
        ways, board = faces[0].ways_out, np.vstack([board, faces[0].points])
    lengths = [float((board @ way).max() - middle @ way) + float(np.hypot(*half)) + OUTSIDE for way in ways]
    return [length * (rotation[:, :2] @ way) for way, length in zip(ways, lengths, strict=True)]
