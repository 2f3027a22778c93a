"""Silhouettes as measurements of a shape: each tangent of a mask is a plane through the camera that the shape touches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from robosandbox.perception.frame import Mask
from robosandbox.perception.frames import SegmentedFrame
from robosandbox.perception.quantiles import median, percentiles
from robosandbox.perception.segments import Segment
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.types import Array
from robosandbox.values import frozen

_DIRECTIONS = 32  # Number of directions in which an outline's tangents are taken. Chosen.
_OUTSIDE = np.array([2.0, 3.0, 5.0, 7.0])  # Pixels beyond a tangent point at which is looked what lies there. Chosen.
CUT_OFF = int(_OUTSIDE[-1])
"""Pixels beyond an outline up to which something nearer is taken to cut it off."""
_OCCLUDES = 4.0 * TOLERANCES.depth  # Metres nearer or farther from which something hides or is behind.
_BESIDE = 3.0  # Pixels within which something lies beside an outline. Chosen: `edge_dropout` of sim/sensors.py and one.
_ASIDE = 0.6  # Cosine from which a direction points at what an outline is cut by. Chosen.
_BESIDE_REACH = 0.85  # Fraction of an outline's reach that ends beside another thing. Chosen.
_WARY_REACH = 0.5
_UNDER = 2.0 * TOLERANCES.depth  # Metres below a piece's lowest point from which something is under it.
_EDGE = 0.75  # Pixels from the farthest one within which others lie on the same edge. Chosen.
_FEW = 6  # Number of free tangents below which those at a cut are used as well. Chosen.
_LONG_CUT = 4  # Number of outline points at a removed tag that make a long cut. Chosen.
_AT_CUT = 4.0  # Pixels around a point at which the side of a cut is told. Chosen.
_OUTER = 0.3  # Cosine from which a neighbour lies on the outer side. Chosen.
_AWAY = -0.2  # Cosine below which a direction points away from a cut. Chosen.
_SIDES = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
# Pixels that an outline is too small: a pixel belongs to a shape when its centre does, so outlines of pixels lie inside of
# those of shapes; corners most. Chosen.
_PIXEL_BIAS = 0.32
_PIXEL_SIGMA = 0.45  # Standard deviation of a tangent, pixels. Chosen.
# Standard deviation of a camera's pose at its distance, metres: `calibration_position` and `calibration_rotation` of
# `realsense` in sim/sensors.py.
_CALIBRATION = 0.0007

_ANGLES = np.arange(_DIRECTIONS) * 2.0 * np.pi / _DIRECTIONS
_NORMALS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])
_AGREE = _NORMALS @ _NORMALS.T
# Steps from an extreme pixel: inwards, straight outwards, (steps, k, 2), and all around, (ways, 2).
_INWARDS = -2.0 * _NORMALS
_OUTWARDS = _OUTSIDE[:, None, None] * _NORMALS
_CLOSE = (_OUTSIDE <= _BESIDE)[:, None]
_AROUND = _AT_CUT * _NORMALS[::2]
_OUTER_SIDE = _NORMALS @ _AROUND.T > _OUTER * _AT_CUT


@frozen(eq=False)
class Rows:
    """Values of a shape's support function: max over its points of normal . x equals value.

    Attributes:
        normals: Unit vectors in the world, (n, 3).
        values: Metres, (n,).
        weights: 1 / standard deviation, 1/m, (n,).
    """

    normals: Array
    values: Array
    weights: Array

    @staticmethod
    def stack(parts: list[Rows]) -> Rows:
        """Return all rows as one."""
        if not parts:
            return Rows(np.zeros((0, 3)), np.zeros(0), np.zeros(0))
        return Rows(
            np.concatenate([part.normals for part in parts]),
            np.concatenate([part.values for part in parts]),
            np.concatenate([part.weights for part in parts]),
        )


def tangents(
    segments: Sequence[Segment], segmented: SegmentedFrame, kin: Sequence[Segment] = (), *, wary: bool = False
) -> Rows:
    """Return the tangent planes of one view's segments together, without those where something nearer cuts them off.

    Args:
        segments: One thing's pieces in this view.
        segmented: The frame.
        kin: Pieces that may be of the same thing, and so do not cut it off.
        wary: Leave out more of those near a place where something else begins; what is left still tells where a thing
            of known size is.

    For a pinhole with matrix K a line l in the picture is the plane K' l through the camera (Hartley and Zisserman,
    Multiple View Geometry, 8.1).
    """
    own = {id(segment) for segment in (*segments, *kin)}
    others = np.array([False, *(id(segment) not in own for segment in segmented.segments)])
    key = (tuple(segments), others.tobytes(), wary)
    if key not in segmented.made:
        segmented.made[key] = _tangents(segments, segmented, others, wary=wary)
    rows: Rows = segmented.made[key]
    return rows


def _tangents(segments: Sequence[Segment], segmented: SegmentedFrame, others: Mask, *, wary: bool) -> Rows:
    frame = segmented.frame
    outline = np.concatenate([segment.outline for segment in segments])
    if not len(outline):
        return Rows(np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    points = np.concatenate([segment.points for segment in segments])
    reach = outline @ _NORMALS.T
    farthest = reach.max(axis=0)
    # All pixels of an edge that lies across a direction are extreme; the one in the middle shows best what lies beyond the edge.
    last = (reach > farthest - _EDGE).astype(np.float64)
    extreme = (last.T @ outline) / last.sum(axis=0)[:, None]
    free = _free_ends(segmented, others, extreme, points, wary=wary)
    if not free.any():
        return Rows(np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    normals, ends = _NORMALS[free], farthest[free] + _PIXEL_BIAS
    planes = np.column_stack([normals, -ends]) @ frame.matrix
    planes /= np.linalg.norm(planes, axis=1, keepdims=True)
    world = planes @ frame.rotation.T
    distance = float(median(np.linalg.norm(points - frame.position, axis=1)))
    sigma = np.hypot(_PIXEL_SIGMA * distance / frame.focal, _CALIBRATION)
    return Rows(world, world @ frame.position, np.full(len(world), 1.0 / sigma))


def _free_ends(segmented: SegmentedFrame, others: Mask, extreme: Array, points: Array, *, wary: bool) -> Mask:
    """Return which extreme pixels (k, 2) end against the table or something clearly farther away.

    Args:
        segmented: The frame.
        others: Which pieces are of something else, by their number in `segmented.pieces`.
        extreme: The pixels.
        points: Surface points of the thing in the world, (n, 3).
        wary: As for `tangents`.
    """
    frame = segmented.frame
    height, width = frame.depth.shape
    here = frame.depth.take(_places(extreme + _INWARDS, width, height)[0]).astype(np.float64)
    usual = float(median((points - frame.position) @ frame.rotation[:, 2]))
    here = np.where(np.abs(here - usual) < 0.15, here, usual)
    low = float(percentiles(points[:, 2], [3.0])[0])
    # All steps outwards at once: (steps, k).
    places, out = _places(extreme + _OUTWARDS, width, height)
    depth, valid = frame.depth.take(places), frame.valid.take(places)
    strange = others.take(segmented.pieces.take(places))
    lower = frame.xyz[2].take(places) < low + _UNDER
    hidden = (out & _CLOSE) | (segmented.robot.take(places) & (segmented.robot_near.take(places) < here + 0.02))
    # The table before a thing is nearer than it is, and covers nothing.
    hidden |= valid & (depth < here - _OCCLUDES) & (strange | ~lower)
    tags_removed: Mask = np.any(hidden, axis=0)
    # Beside another thing nobody can tell which of the two ends there, unless it is clearly behind.
    # Lower points are of what the thing stands on, as the table. Where depth is missing, the next pixel that has it decides.
    level = valid & ~((depth > here + _OCCLUDES) | lower)
    beside = np.zeros(len(extreme), dtype=bool)
    unknown = np.zeros(len(extreme), dtype=bool)
    for step in range(len(_OUTSIDE)):
        asked = strange[step] & (unknown | _CLOSE[step])
        beside |= asked & level[step]
        unknown = (unknown | asked) & ~(asked & valid[step])
    beside |= unknown
    around, _ = _places(extreme[:, None] + _AROUND, width, height)
    if wary:
        beside |= _next_to_others(segmented, others, around, here, low)
    # A corner where a cut begins is no end of the thing either, whichever way it points.
    tags_removed |= np.any(
        segmented.robot.take(around) & (segmented.robot_near.take(around) < here[:, None] + 0.02), axis=1
    )
    # The part that is cut off may reach farther than the part that is left, and not only straight across the cut.
    free = sure = ~tags_removed & ~beside
    for cut, reach in (
        (tags_removed, 0.0 if tags_removed.sum() >= _LONG_CUT else _ASIDE),
        (beside, _WARY_REACH if wary else _BESIDE_REACH),
    ):
        if cut.any():
            free = free & (_AGREE[:, cut].max(axis=1) < reach)
    if free.sum() < _FEW:
        free = sure
    for side, at_border in zip(_SIDES, _borders(extreme, width, height), strict=True):
        if at_border:
            free &= _NORMALS @ side < _AWAY
    return free


def _next_to_others(segmented: SegmentedFrame, others: Mask, around: NDArray[np.intp], here: Array, low: float) -> Mask:
    """Return which extreme pixels have something else as near close to them, on the outer side: depth ends before edges do.

    Args:
        segmented: The frame.
        others: As for `_free_ends`.
        around: The flat pixels around each extreme one, (k, ways).
        here: How far away the thing is at each, (k,), metres.
        low: How low it reaches, metres.
    """
    frame = segmented.frame
    valid, strange = frame.valid.take(around), others.take(segmented.pieces.take(around))
    behind = valid & (
        (frame.depth.take(around) > here[:, None] + _OCCLUDES) | (frame.xyz[2].take(around) < low + _UNDER)
    )
    return np.asarray((_OUTER_SIDE & strange & ~behind).any(axis=1))


def _places(pixels: Array, width: int, height: int) -> tuple[NDArray[np.intp], Mask]:
    """Return the flat pixels (...) of a picture that are nearest to places (..., 2), and which of these are outside of it."""
    nearest = np.rint(pixels).astype(np.intp)
    x, y = nearest[..., 0], nearest[..., 1]
    columns, rows = np.minimum(np.maximum(x, 0), width - 1), np.minimum(np.maximum(y, 0), height - 1)
    return rows * width + columns, (columns != x) | (rows != y)


def _borders(extreme: Array, width: int, height: int) -> tuple[bool, ...]:
    """Return whether the left, right, upper and lower border of the picture cuts the mask."""
    left, upper = extreme.min(axis=0)
    right, lower = extreme.max(axis=0)
    return left <= 2, right >= width - 3, upper <= 2, lower >= height - 3
