"""Contents of a container of their own colour: what stands out of its floor, away from its walls."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from robosandbox.perception.fit import Fit
from robosandbox.perception.frame import Mask
from robosandbox.perception.frames import FrameSet, SegmentedFrame
from robosandbox.perception.segments import Segment, jumps, segment_of
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.shapes import CONTAINER_WALL
from robosandbox.types import Array

_LEAST_PIXELS = 40  # Number of pixels that a piece in a container has at least. Chosen.
_MIN_RISE = 0.008  # Metres over the floor from which a point is of something else. Chosen: twice a floor.
# Number of standard deviations of depth by which points must be off floor and walls, because it errs with the distance and
# noise must not make a thing of them. Chosen.
_ERRORS = 3.0
_LEAST_GAP = 2.0 * TOLERANCES.depth  # Metres from the walls from which a point is of something else.
# Metres from the walls that a piece must reach: a strip beside a wall is that wall, badly placed. Chosen.
_CLEAR_OF_WALLS = 0.022


def split_contents(
    hull: Fit, own: Sequence[Segment], frames: FrameSet
) -> tuple[list[Segment], list[Segment], FrameSet]:
    """Return a container's pieces without what lies in it, the pieces of that, and the frames with them.

    Args:
        hull: The container's outer one.
        own: Its pieces.
        frames: Where they are seen.
    """
    left: list[Segment] = []
    inside: list[Segment] = []
    by_camera = dict(frames.by_camera)
    for camera, segmented in frames.by_camera.items():
        mine = [segment for segment in own if segment.frame is segmented.frame]
        parts = {id(segment): _parts(hull, segment, segmented) for segment in mine}
        for segment in mine:
            rest: Segment | None = segment
            for part in parts[id(segment)]:
                inside.append(part)
                if rest is not None:
                    segmented, rest = segmented.divided(rest, part)
            if rest is not None:
                left.append(rest)
        by_camera[camera] = segmented
    return left, inside, FrameSet(by_camera, frames.table)


def _parts(hull: Fit, segment: Segment, segmented: SegmentedFrame) -> list[Segment]:
    """Return the parts of a container's piece that are things in it."""
    crop = segment.crop
    frame = segmented.frame
    sure = segment.mask & frame.valid[crop]
    if sure.sum() < _LEAST_PIXELS:
        return []
    points = frame.xyz[:, crop[0], crop[1]][:, sure].T
    within = np.zeros_like(sure)
    within[sure] = in_room(points.astype(np.float64), hull, _ERRORS * frame.noise)
    if within.sum() < _LEAST_PIXELS:
        return []
    cut = cv2.morphologyEx((within & ~jumps(frame, crop)).astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(cut, connectivity=4)
    found = []
    for number in range(1, count):
        if stats[number, cv2.CC_STAT_AREA] < _LEAST_PIXELS:
            continue
        core = labels == number
        # The piece gets back the pixels at its edge that depth jumps and noise removed.
        mask: Mask = (cv2.dilate(core.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0) & segment.mask
        part = segment_of(frame, mask, core, segment.box)
        if part is not None and float(np.percentile(_from_walls(part.points, hull), 80)) > _CLEAR_OF_WALLS:
            found.append(part)
    return found


def _from_walls(points: Array, hull: Fit) -> Array:
    """Return how far points (n, 3) in a hull are from its sides, (n,), metres."""
    local = (points - hull.centre) @ hull.axes
    if hull.shape == "box":
        return np.asarray((hull.sizes[:2] - np.abs(local[:, :2])).min(axis=1))
    return np.asarray(hull.sizes[0] - np.hypot(local[:, 0], local[:, 1]))


def in_room(points: Array, hull: Fit, error: float) -> Mask:
    """Return which points (n, 3) lie between a container's walls, over its floor, surely."""
    local = (points - hull.centre) @ hull.axes
    within = _from_walls(points, hull) > CONTAINER_WALL + max(_LEAST_GAP, error)
    over = local[:, 2] > -hull.sizes[-1] + CONTAINER_WALL + max(_MIN_RISE, error)
    return np.asarray(within & over)
