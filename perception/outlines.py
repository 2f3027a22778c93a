"""Pieces of a picture without depth: what has another colour than the table, cut where the colour changes."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.perception.frame import Image, Mask, PointCloudFrame, TablePrior, with_depth
from robosandbox.perception.frames import SegmentedFrame, segmented_by
from robosandbox.perception.raycast import depths_of
from robosandbox.perception.segments import LEAST_PIXELS, jumps, nearest_set, segment_of
from robosandbox.perception.table_colour import painted
from robosandbox.perception.thing import Thing

# Pixels at the table's edge, and around a piece's sure part, that are both colours at once, because of the kernel that finds
# steps and of what the picture is smoothed with before.
MIXED = 3


def outlined(frame: PointCloudFrame, table: TablePrior, robot: Mask, robot_near: Image) -> SegmentedFrame:
    """Return a frame of the bare table's plane cut into what stands on it, each a screen that stands where it begins.

    Args:
        frame: As `plane_frame` returns it.
        table: What things stand on; what is seen beyond it is not told.
        robot: Where the robot is.
        robot_near: How near its nearest part is there, metres.
    """
    on_table = frame.valid & table.within(frame.xyz[0], frame.xyz[1])
    room = np.ones((2 * MIXED + 1,) * 2, np.uint8)
    on_table = cv2.erode(on_table.view(np.uint8), room, borderValue=1).view(np.bool_)
    free = on_table & ~robot
    everything = np.s_[0 : free.shape[0], 0 : free.shape[1]]
    other = painted(frame, free, everything) & free
    core = other & ~jumps(frame, everything)
    count, found, stats, _ = cv2.connectedComponentsWithStats(core.view(np.uint8), connectivity=4)
    sizes = stats[:, cv2.CC_STAT_AREA].copy()
    sizes[0] = 0
    numbers = np.where(sizes >= LEAST_PIXELS, np.arange(count), 0)
    labels = numbers.astype(np.int32).take(np.asarray(found, dtype=np.int32))
    sure = labels > 0
    band = np.flatnonzero(other & ~sure & (cv2.dilate(sure.view(np.uint8), room) > 0))
    if sure.any():
        labels.reshape(-1)[band] = labels.reshape(-1)[nearest_set(sure, band)]
    # What ends at the table's edge, or beyond it, may go on there.
    hides, near = robot | ~on_table, np.where(on_table | robot, robot_near, np.float32(0.0))
    masks = [(labels == number) for number in np.flatnonzero(numbers)]
    depth = frame.depth.copy()
    for mask in masks:
        depth[mask] = depth[mask].min()
    return _cut(with_depth(frame, depth), table, hides, near, masks)


def filled(segmented: SegmentedFrame, table: TablePrior, things: list[Thing]) -> SegmentedFrame:
    """Return the frame with the depth of things where their pieces are; pieces keep their order."""
    depth = segmented.frame.depth.copy()
    for thing in things:
        for number, segment in enumerate(segmented.segments, start=1):
            if not any(segment is own for own in thing.group.segments):
                continue
            pixels = segmented.pieces == number
            rows, columns = np.nonzero(pixels)
            found = depths_of(thing, segmented.frame, rows, columns)
            hit = np.zeros(pixels.shape, dtype=bool)
            hit[rows, columns] = np.isfinite(found)
            if not hit.any():
                continue
            depth[rows, columns] = np.nan_to_num(found)
            missed = np.flatnonzero(pixels & ~hit)
            # Beside the shape's outline the nearest point of it is as good.
            depth.reshape(-1)[missed] = depth.reshape(-1)[nearest_set(hit, missed)]
    return redrawn(segmented, table, depth)


def redrawn(segmented: SegmentedFrame, table: TablePrior, depth: Image) -> SegmentedFrame:
    """Return the frame with other depths, (height, width), metres; pieces keep their order."""
    masks = [segmented.pieces == number for number in range(1, len(segmented.segments) + 1)]
    return _cut(with_depth(segmented.frame, depth), table, segmented.robot, segmented.robot_near, masks)


def _cut(
    frame: PointCloudFrame, table: TablePrior, robot: Mask, robot_near: Image, masks: list[NDArray[np.bool_]]
) -> SegmentedFrame:
    segments = []
    for mask in masks:
        rows, columns = np.nonzero(mask)
        box = (int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1)
        inside = mask[box[1] : box[3], box[0] : box[2]]
        segment = segment_of(frame, inside, inside, box)
        assert segment is not None, "a piece has as many pixels as `segment_of` asks for"
        segments.append(segment)
    return segmented_by(frame, table, robot, robot_near, tuple(segments))
