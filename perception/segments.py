"""Pieces of a picture that belong to one thing each: what stands out of the table, cut where depth or colour jumps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.perception.frame import Image, Mask, PointCloudFrame, TablePrior
from robosandbox.perception.quantiles import median
from robosandbox.perception.table_colour import painted
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.types import Array

Labels = NDArray[np.int32]

# Metres beyond the table's edge where things are still looked for. Chosen: half of a small cube; nothing changes at 0.01 or
# 0.04 (benchmarks/sensitivity.py).
_EDGE = 0.02
# Height over the table, metres, from which a pixel belongs to a thing; three times the frame's noise where that is more.
# Nothing is found or lost at 0.003 or 0.012 (benchmarks/sensitivity.py).
_LEAST_HEIGHT = 2.0 * TOLERANCES.depth
# Height over the table, metres, up to which something belongs to the scene. Chosen: above the reach of a tabletop arm.
_HEADROOM = 1.2
# Step of depth between neighbouring pixels, metres, at which pieces part. With 0.009 three detections of nothing in place of
# one, with 0.036 none more (benchmarks/sensitivity.py).
_DEPTH_JUMP = 0.018
_CHROMA_JUMP = 0.07  # Step in a colour's shares of red and green at which pieces part. Chosen.
# What noise adds to a difference of shares, summed over both, times the sum of the channels (0 to 765): a dark pixel's share
# says little. Chosen.
_CHROMA_NOISE = 10.0
# The same of one share, at a colour step. Chosen half of `_CHROMA_NOISE`, because it is one share of two.
_SHARE_NOISE = 5.0
_BLACK = 110.0  # Sum of the channels, of 765 levels, below which a pixel is too dark to have a colour. Chosen.
# Factor of brightness, next to black, that is no shade but another thing. With half of it one more detection of nothing, with
# twice none (benchmarks/sensitivity.py).
_BLACK_STEP = 3.2
_CELL = 12  # Pixels a side of the cells in which parts of a frame are found. Chosen about as wide as the least thing.
_STRAY = 3  # Number of pixels in a cell that may be noise. Chosen: 2 % of the cell.
LEAST_PIXELS = 14  # Number of raised pixels that a piece has at least. Chosen.
# Number of pixels from which the mean height of a flat piece counts, because it is known better than one pixel's. Chosen.
_WIDE = 120
_BUMP = 60  # Number of pixels below which a raised piece may be noise in the table. Chosen.
_LEAST_PAINT = 0.2  # Share of such a piece that must have another colour than the table. Chosen.
# Mean height over the table, metres, from which a wide flat piece is a thing's floor. Chosen below the 4 mm of a container's
# floor.
_LEAST_FLOOR = 0.0025
# Pixels around a piece that it may grow by where depth ends raggedly. Chosen: twice the `edge_dropout` of `realsense` in
# sim/sensors.py.
_BAND = 4
# Difference of colours, summed over channels of 255 levels, below which depth decides and not colour. Chosen: 10 levels a
# channel.
_ALIKE = 30.0
_REACH = 14  # Pixels around a piece that it may grow by over pixels which are surely not the table. Chosen.
_POINTS = 220  # Number of surface points that are kept of a piece, up to twice as many. Chosen so that fits stay fast.


@dataclass(frozen=True, eq=False)
class Segment:
    """Part of one view that shows one thing.

    Attributes:
        frame: Where it is seen.
        mask: Its pixels by colour and depth, within `box`.
        box: Left, top, right, bottom in the picture, pixels; right and bottom are outside.
        points: Some of its surface points in the world, (n, 3).
        colours: Their colours, channels 0..255, (n, 3).
        rgb: Its median colour, channels 0..255, (3,).
        chroma: Its colour without brightness: shares of red and green, (2,).
    """

    frame: PointCloudFrame
    mask: Mask
    box: tuple[int, int, int, int]
    points: Array
    colours: Array
    rgb: Array
    chroma: Array

    @property
    def crop(self) -> tuple[slice, slice]:
        """Rows and columns of its box in the picture."""
        left, top, right, bottom = self.box
        return slice(top, bottom), slice(left, right)

    @cached_property
    def outline(self) -> Array:
        """The pixels of its outlines in the picture, (n, 2)."""
        contours, _ = cv2.findContours(self.mask.view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        pixels = np.concatenate([np.zeros((0, 2)), *(contour.reshape(-1, 2) for contour in contours)])
        return np.asarray(pixels + self.box[:2], dtype=np.float64)


def find_segments(frame: PointCloudFrame, table: TablePrior, robot: Mask, robot_near: Image) -> list[Segment]:
    """Return the pieces that stand on or over the table and are not the robot.

    Args:
        frame: A view.
        table: Where things can be.
        robot: Where the robot covers the picture.
        robot_near: How near its nearest part is there; what is nearer stands before it.
    """
    free = frame.valid & (~robot | (frame.depth < robot_near))
    height = frame.xyz[2] - np.float32(table.height)
    low = max(_LEAST_HEIGHT, 3.0 * frame.noise)
    free &= table.within(frame.xyz[0], frame.xyz[1], -_EDGE) & (height > -low) & (height < _HEADROOM)
    raised = free & (height > low)
    box = _box_around(raised, 4 * _BAND)
    if box is None:
        return []
    left, top, right, bottom = box
    crop = np.s_[top:bottom, left:right]
    # Low pixels of another colour than the table's are no table either, as the floor of a bin.
    # Pixels without depth are judged by colour alone, except beside the robot and beyond the table.
    beyond = cv2.dilate((frame.valid[crop] & (height[crop] < -low)).astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
    blind = ~frame.valid[crop] & ~beyond & ~robot[crop]
    coloured = painted(frame, free & ~raised, crop) & (free[crop] | blind)
    standing = raised[crop] | (free[crop] & coloured)
    segments = []
    for part in _parts(standing):
        inside = _within(crop, part)
        if np.count_nonzero(standing[part]) < _WIDE and np.count_nonzero(raised[inside]) < LEAST_PIXELS:
            continue
        segments += _cut(frame, standing[part], coloured[part], raised[inside], height[inside], inside)
    return segments


def _cut(
    frame: PointCloudFrame, standing: Mask, coloured: Mask, raised: Mask, height: Image, crop: tuple[slice, slice]
) -> list[Segment]:
    """Return the pieces in a part of the picture, cut where depth or colour jumps."""
    count, found, stats, _ = cv2.connectedComponentsWithStats(
        (standing & ~jumps(frame, crop)).view(np.uint8), connectivity=4
    )
    labels: Labels = found.astype(np.int32, copy=False)
    area = stats[:, cv2.CC_STAT_AREA]
    small = np.bincount(labels[raised], minlength=count) < LEAST_PIXELS
    # A floor of a few millimetres is lost in the noise of a pixel, but not in that of hundreds.
    for number in np.flatnonzero(small & (area >= _WIDE)):
        small[number] = float(height[labels == number].mean(dtype=np.float64)) < _LEAST_FLOOR
    # Noise makes a bump in the table here and there, of the table's colour.
    bumps = ~small & (area < _BUMP)
    if bumps.any():
        small |= bumps & (np.bincount(labels[coloured], minlength=count) < _LEAST_PAINT * area)
    small[0] = False
    if small[1:].all():
        return []
    labels = np.where(small, 0, np.arange(count)).astype(np.int32).take(labels)
    masks = _grown(labels, standing, coloured, frame, crop)
    corner = (crop[1].start, crop[0].start)
    pieces = (_segment(frame, labels, masks, n, stats[n], corner) for n in range(1, count) if not small[n])
    return [piece for piece in pieces if piece is not None]


def _parts(standing: Mask) -> list[tuple[slice, slice]]:
    """Return the parts of a picture that hold something, with room around it; no two overlap."""
    height, width = standing.shape
    cells = -(-height // _CELL), -(-width // _CELL)
    padded = np.zeros((cells[0] * _CELL, cells[1] * _CELL), dtype=np.uint8)
    padded[:height, :width] = standing
    counts = cv2.resize(255 * padded, (cells[1], cells[0]), interpolation=cv2.INTER_AREA)
    full = (counts > 255 * _STRAY // _CELL**2).astype(np.uint8)
    _, _, stats, _ = cv2.connectedComponentsWithStats(cv2.dilate(full, np.ones((3, 3), np.uint8)), connectivity=8)
    boxes = [(int(x) - 1, int(y) - 1, int(x + w) + 1, int(y + h) + 1) for x, y, w, h, _ in stats[1:]]
    merged = True
    while merged:
        merged = False
        for a, b in combinations(boxes, 2):
            if a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]:
                boxes = [box for box in boxes if box is not a and box is not b]
                boxes.append((min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])))
                merged = True
                break
    return [
        (
            slice(max(top, 0) * _CELL, min(bottom * _CELL, height)),
            slice(max(left, 0) * _CELL, min(right * _CELL, width)),
        )
        for left, top, right, bottom in boxes
    ]


def _within(crop: tuple[slice, slice], part: tuple[slice, slice]) -> tuple[slice, slice]:
    """Return a part of a crop as a part of the whole picture."""
    rows, columns = (
        slice(outer.start + inner.start, outer.start + inner.stop) for outer, inner in zip(crop, part, strict=True)
    )
    return rows, columns


def jumps(frame: PointCloudFrame, crop: tuple[slice, slice]) -> Mask:
    """Return the pixels beside a step in depth or in colour; shading is no colour."""
    depth = frame.depth[crop]
    kernel = np.ones((3, 3), np.uint8)
    far = cv2.dilate(depth, kernel)
    near = cv2.erode(np.where(depth > 0.0, depth, np.float32(9.0)), kernel)
    steps = (far - near) > _DEPTH_JUMP
    rgb = cv2.blur(frame.rgb[crop], (3, 3)).astype(np.float32)
    ones = np.ones((1, 3), np.float32)
    total = np.maximum(cv2.transform(rgb, ones), 1.0)
    # The darker, the less a share says.
    step = np.float32(_CHROMA_JUMP) + np.float32(_SHARE_NOISE) / cv2.erode(total, kernel)
    sharp = cv2.transform(frame.rgb[crop].astype(np.float32), ones)
    dark, light = np.maximum(cv2.erode(sharp, kernel), 12.0), cv2.dilate(sharp, kernel)
    # Black has no colour to tell from others; no shade makes a face of another thing so dark.
    steps |= (light > _BLACK_STEP * dark) & (dark < _BLACK)
    for channel in (0, 1):
        share = rgb[..., channel] / total
        steps |= (cv2.dilate(share, kernel) - cv2.erode(share, kernel)) > step
    return np.asarray(steps)


def _grown(labels: Labels, standing: Mask, coloured: Mask, frame: PointCloudFrame, crop: tuple[slice, slice]) -> Labels:
    """Return the labels grown to the things' outlines in the colour picture.

    Depth ends ragged at edges. Each pixel near a piece goes to it if its colour is nearer to that of the piece's nearest
    sure pixel than to that of the nearest pixel which is surely of something else. What is surely not the table is
    shared out farther, among pieces of its colour.
    """
    sure = labels > 0
    near = cv2.dilate(sure.view(np.uint8), np.ones((2 * _BAND + 1,) * 2, np.uint8)) > 0
    reach = cv2.dilate(sure.view(np.uint8), np.ones((2 * _REACH + 1,) * 2, np.uint8)) > 0
    other = ~(near | (reach & (standing | coloured)))
    band = ~other & ~sure
    pixels = np.flatnonzero(band)
    source = nearest_set(sure, pixels)
    piece = labels.reshape(-1)[source]
    if other.any():
        channels = cv2.split(frame.rgb[crop])
        here, nearest, away = (
            np.array([channel.take(chosen) for channel in channels], dtype=np.float32)
            for chosen in (pixels, source, nearest_set(other, pixels))
        )
        mine = _apart(here, nearest) < _apart(here, away)
        # Where colours say nothing, depth does.
        mine = np.where(_apart(nearest, away) < _ALIKE, standing.reshape(-1)[pixels], mine)
        hue = _chroma(here)
        shares = _apart(hue, _chroma(nearest))
        dark = np.maximum(np.minimum(here.sum(axis=0), nearest.sum(axis=0)), 1.0)
        same = (shares < _apart(hue, _chroma(away))) & (shares < 1.4 * _CHROMA_JUMP + _CHROMA_NOISE / dark)
        mine = np.where(coloured.reshape(-1)[pixels], same, mine)
    else:
        mine = np.ones(len(pixels), dtype=bool)
    grown = labels.copy()
    grown.reshape(-1)[pixels[mine]] = piece[mine]
    return grown


def _apart(a: Image, b: Image) -> Image:
    """Return how far colours (k, n) are apart, the sum over their channels."""
    return np.asarray(np.abs(a - b).sum(axis=0))


def _chroma(rgb: NDArray[Any]) -> NDArray[Any]:
    """Return the shares of red and green (2, n) of colours (3, n): colour without brightness."""
    return np.asarray(rgb[:2] / np.maximum(rgb.sum(axis=0), 1.0))


def nearest_set(mask: Mask, pixels: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the flat set pixel (n,) that is nearest to each of these flat pixels (n,)."""
    _, numbers = cv2.distanceTransformWithLabels((~mask).view(np.uint8), cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL)
    labels: Labels = np.asarray(numbers, dtype=np.int32).reshape(-1)
    zeros = np.flatnonzero(mask)
    # Each set pixel has a label of its own.
    positions = np.zeros(len(zeros) + 1, dtype=np.int64)
    positions[labels[zeros]] = zeros
    return np.asarray(positions[labels[pixels]])


def _segment(
    frame: PointCloudFrame,
    labels: Labels,
    grown: Labels,
    number: int,
    stats: NDArray[np.int32],
    corner: tuple[int, int],
) -> Segment | None:
    left, top = max(int(stats[0]) - _REACH, 0), max(int(stats[1]) - _REACH, 0)
    right = min(int(stats[0] + stats[2]) + _REACH, labels.shape[1])
    bottom = min(int(stats[1] + stats[3]) + _REACH, labels.shape[0])
    inside = np.s_[top:bottom, left:right]
    box = (left + corner[0], top + corner[1], right + corner[0], bottom + corner[1])
    return segment_of(frame, _largest(grown[inside] == number), labels[inside] == number, box)


def segment_of(frame: PointCloudFrame, mask: Mask, core: Mask, box: tuple[int, int, int, int]) -> Segment | None:
    """Return a piece of a picture; None where too little of it is sure.

    Args:
        frame: Where it is seen.
        mask: Its pixels within `box`.
        core: Those of which depth and colour are sure.
        box: Left, top, right, bottom in the picture; right and bottom are outside.
    """
    picture = np.s_[box[1] : box[3], box[0] : box[2]]
    core = core & frame.valid[picture]
    points = frame.xyz[:, picture[0], picture[1]][:, core].T.astype(np.float64)
    if len(points) < LEAST_PIXELS:
        return None
    colours = frame.rgb[picture][core].astype(np.float64)
    rgb = median(colours)
    step = max(1, len(points) // _POINTS)
    return Segment(
        frame=frame,
        mask=mask,
        box=box,
        points=points[::step],
        colours=colours[::step],
        rgb=rgb,
        chroma=_chroma(rgb),
    )


def _largest(mask: Mask) -> Mask:
    """Return the mask's largest part; parts with a gap of a pixel or two between them count as one."""
    closed = cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(closed, connectivity=4)
    if count <= 2:
        return mask
    return np.asarray(mask & (labels == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())))


def _box_around(mask: Mask, margin: int) -> tuple[int, int, int, int] | None:
    left, top, wide, high = cv2.boundingRect(mask.view(np.uint8))
    if not wide:
        return None
    height, width = mask.shape
    return (
        max(left - margin, 0),
        max(top - margin, 0),
        min(left + wide + margin, width),
        min(top + high + margin, height),
    )
