"""What silhouettes say of a shape: each tangent of a mask is a plane through the camera that the shape just touches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from robosandbox.perception.quantiles import median, percentiles
from robosandbox.perception.scenery import Look
from robosandbox.perception.segments import Segment
from robosandbox.perception.view import Mask, View
from robosandbox.types import Array

_DIRECTIONS = 32
_OUTSIDE = np.array([2.0, 3.0, 5.0, 7.0])
_OCCLUDES = 0.012
_BESIDE = 3.0
_ASIDE = 0.6
_BESIDE_REACH = 0.85
_WARY_REACH = 0.5
_UNDER = 0.006
_EDGE = 0.75
_FEW = 6
_LONG_CUT = 4
_AT_CUT = 4.0
_OUTER = 0.3
_AWAY = -0.2
_SIDES = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
# A pixel belongs to a shape when its centre does, so outlines of pixels lie inside of those of shapes; corners most.
_PIXEL_BIAS = 0.32
_PIXEL_SIGMA = 0.45
_CALIBRATION = 0.0007

_ANGLES = np.arange(_DIRECTIONS) * 2.0 * np.pi / _DIRECTIONS
_NORMALS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])


@dataclass(frozen=True, slots=True, eq=False)
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
        return Rows(
            np.vstack([part.normals for part in parts] or [np.zeros((0, 3))]),
            np.concatenate([part.values for part in parts] or [np.zeros(0)]),
            np.concatenate([part.weights for part in parts] or [np.zeros(0)]),
        )


def tangents(segments: Sequence[Segment], look: Look, kin: Sequence[Segment] = (), *, wary: bool = False) -> Rows:
    """Return the tangent planes of one view's segments together, without those where something nearer cuts them off.

    Args:
        segments: One thing's pieces in this view.
        look: The view.
        kin: Pieces that may be of the same thing, and so do not cut it off.
        wary: Leave out more of those near a place where something else begins; what is left still tells where a thing
            of known size is.

    For a pinhole with matrix K a line l in the picture is the plane K' l through the camera (Hartley and Zisserman,
    Multiple View Geometry, 8.1).
    """
    view = look.view
    outlines = []
    for segment in segments:
        contours, _ = cv2.findContours(segment.mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        outlines += [contour.reshape(-1, 2) + np.array(segment.box[:2]) for contour in contours]
    if not outlines:
        return Rows(np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    outline = np.vstack(outlines).astype(np.float64)
    points = np.vstack([segment.points for segment in segments])
    reach = outline @ _NORMALS.T
    # Of an edge that lies across a direction all pixels are extreme: its middle tells best against what it ends.
    last = (reach > reach.max(axis=0) - _EDGE).astype(np.float64)
    extreme = (last.T @ outline) / last.sum(axis=0)[:, None]
    own = {id(segment) for segment in (*segments, *kin)}
    others = np.array([False, *(id(segment) not in own for segment in look.segments)])
    free = _free_ends(look, others, extreme, points, wary=wary)
    if not free.any():
        return Rows(np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    normals, ends = _NORMALS[free], reach.max(axis=0)[free] + _PIXEL_BIAS
    planes = np.column_stack([normals, -ends]) @ view.matrix
    planes /= np.linalg.norm(planes, axis=1, keepdims=True)
    world = planes @ view.rotation.T
    distance = float(median(np.linalg.norm(points - view.position, axis=1)))
    sigma = np.hypot(_PIXEL_SIGMA * distance / view.focal, _CALIBRATION)
    return Rows(world, world @ view.position, np.full(len(world), 1.0 / sigma))


def _free_ends(look: Look, others: Mask, extreme: Array, points: Array, *, wary: bool) -> Mask:
    """Return which extreme pixels (k, 2) end against the table or something clearly farther away.

    Args:
        look: The view.
        others: Which pieces are of something else, by their number in `look.pieces`.
        extreme: The pixels.
        points: Surface points of the thing in the world, (n, 3).
        wary: As for `tangents`.
    """
    view = look.view
    height, width = view.depth.shape
    here = _depth_at(view, extreme - 2.0 * _NORMALS)
    usual = float(median((points - view.position) @ view.rotation[:, 2]))
    here = np.where(np.abs(here - usual) < 0.15, here, usual)
    low = float(percentiles(points[:, 2], [3.0])[0])
    # All steps outwards at once: (steps, k).
    pixels = np.rint(extreme + _OUTSIDE[:, None, None] * _NORMALS).astype(int)
    columns, rows = np.clip(pixels[..., 0], 0, width - 1), np.clip(pixels[..., 1], 0, height - 1)
    close = (_OUTSIDE <= _BESIDE)[:, None]
    out = (columns != pixels[..., 0]) | (rows != pixels[..., 1])
    depth, valid = view.depth[rows, columns], view.valid[rows, columns]
    strange = others[look.pieces[rows, columns]]
    lower = view.xyz[2, rows, columns] < low + _UNDER
    hidden = (out & close) | (look.robot[rows, columns] & (look.robot_near[rows, columns] < here + 0.02))
    # The table before a thing is nearer than it is, and covers nothing.
    hidden |= valid & (depth < here - _OCCLUDES) & (strange | ~lower)
    covered: Mask = hidden.any(axis=0)
    # Beside another thing nobody can tell which of the two ends there, unless it is clearly behind.
    # What lies lower is stood upon, as the table is. Where depth is missing the next pixel that has it tells.
    level = valid & ~((depth > here + _OCCLUDES) | lower)
    beside = np.zeros(len(extreme), dtype=bool)
    unknown = np.zeros(len(extreme), dtype=bool)
    for step in range(len(_OUTSIDE)):
        asked = strange[step] & (unknown | close[step])
        beside |= asked & level[step]
        unknown = (unknown | asked) & ~(asked & valid[step])
    beside |= unknown
    if wary:
        beside |= _next_to_others(look, others, extreme, here, low)
    # A corner where a cut begins is no end of the thing either, whichever way it points.
    pixels = np.rint(extreme[:, None] + _AT_CUT * _NORMALS[::2]).astype(int)
    columns, rows = np.moveaxis(np.clip(pixels, 0, [width - 1, height - 1]), -1, 0)
    covered |= (look.robot[rows, columns] & (look.robot_near[rows, columns] < here[:, None] + 0.02)).any(axis=1)
    # What is cut off may reach farther than what is left, and not only straight across the cut.
    free = sure = ~covered & ~beside
    for cut, reach in (
        (covered, 0.0 if covered.sum() >= _LONG_CUT else _ASIDE),
        (beside, _WARY_REACH if wary else _BESIDE_REACH),
    ):
        if cut.any():
            free = free & ((_NORMALS @ _NORMALS[cut].T).max(axis=1) < reach)
    if free.sum() < _FEW:
        free = sure
    for side, at_border in zip(_SIDES, _borders(extreme, width, height), strict=True):
        if at_border:
            free &= _NORMALS @ side < _AWAY
    return free


def _next_to_others(look: Look, others: Mask, extreme: Array, here: Array, low: float) -> Mask:
    """Return which extreme pixels (k, 2) have something else as near close to them, on the outer side: depth ends before edges do."""
    view = look.view
    height, width = view.depth.shape
    ways = _AT_CUT * _NORMALS[::2]
    outer = _NORMALS @ ways.T > _OUTER * _AT_CUT
    pixels = np.rint(extreme[:, None] + ways).astype(int)
    columns, rows = np.moveaxis(np.clip(pixels, 0, [width - 1, height - 1]), -1, 0)
    valid, strange = view.valid[rows, columns], others[look.pieces[rows, columns]]
    behind = valid & (
        (view.depth[rows, columns] > here[:, None] + _OCCLUDES) | (view.xyz[2, rows, columns] < low + _UNDER)
    )
    return np.asarray((outer & strange & ~behind).any(axis=1))


def _borders(extreme: Array, width: int, height: int) -> tuple[bool, ...]:
    """Return whether the left, right, upper and lower border of the picture cuts the mask."""
    left, upper = extreme.min(axis=0)
    right, lower = extreme.max(axis=0)
    return left <= 2, right >= width - 3, upper <= 2, lower >= height - 3


def _depth_at(view: View, pixels: Array) -> Array:
    height, width = view.depth.shape
    columns, rows = np.clip(np.rint(pixels).astype(int), 0, [width - 1, height - 1]).T
    return np.asarray(view.depth[rows, columns], dtype=np.float64)
