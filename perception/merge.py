"""Merging of groups that turn out to be one object: two solid objects are never in the same place."""

from __future__ import annotations

from itertools import product

import numpy as np

from robosandbox.perception.fit import Fit
from robosandbox.perception.frame import Image
from robosandbox.perception.frames import FrameSet, SegmentedFrame
from robosandbox.perception.groups import Group, alike
from robosandbox.perception.segments import Segment
from robosandbox.types import Array

# Metres from a shape within which it explains a point. Chosen: three times the 95th percentile of position errors
# (docs/measured.md).
_AT_IT = 0.006
_MOST_OF_IT = 0.6  # Share of points that are most of a group. Chosen.
# Metres between two groups that may be one thing with something before it. Chosen: a finger or a cube hides as much.
_APART = 0.06
_STEPS = 24  # Number of points between two pieces at which the frame is looked at. Chosen.
_NEARER = 0.004  # Metres by which something must be nearer to hide what is between. Chosen above the depth noise.
_BEHIND = 0.012  # Metres behind a shape's surface from which a point is seen through it. Chosen.
_SEEN_THROUGH = 0.03  # Share of a shape's points that may be seen through. Chosen.
# Places over a hull, a fraction of its half-extents each, at which it is seen through or not. Chosen short of edges.
_ACROSS = np.linspace(-0.8, 0.8, 9)
_GRID = np.array([[x, y, z] for x in _ACROSS for y in _ACROSS for z in (-0.8, 0.0, 0.8)])


def same_colour(a: Group, b: Group) -> bool:
    """Tell whether two groups may have the same colour."""
    return any(alike(one, other) for one, other in product(a.segments, b.segments))


def explains(known: Fit, members: Group, within: float = _AT_IT) -> bool:
    """Tell whether most of a group's points are in a fitted shape or so near to it, metres."""
    return float((known.distances(members.points) < within).mean()) > _MOST_OF_IT


def may_be_one(a: Group, b: Group, frames: FrameSet) -> bool:
    """Tell whether two groups near one another may be of one thing: no view shows both without something before the gap."""
    (low_a, high_a), (low_b, high_b) = a.bounds, b.bounds
    if (low_a - _APART > high_b).any() or (low_b - _APART > high_a).any():
        return False
    return all(
        any(_hidden_between(one, other, segmented) for one, other in product(first, second))
        for segmented in frames.by_camera.values()
        if (first := [each for each in a.segments if each.frame is segmented.frame])
        and (second := [each for each in b.segments if each.frame is segmented.frame])
    )


def _hidden_between(a: Segment, b: Segment, segmented: SegmentedFrame) -> bool:
    """Tell whether all that lies between two pieces in the picture is something nearer than they are."""
    start, end = _middle(a), _middle(b)
    columns, rows = np.rint(start + np.linspace(0.0, 1.0, _STEPS)[:, None] * (end - start)).astype(int).T
    own = [k for k, one in enumerate(segmented.segments, start=1) if one is a or one is b]
    between = ~np.isin(segmented.pieces[rows, columns], own)
    if not between.any():
        return False
    depth = segmented.frame.depth
    near = min(_median_depth(one, depth) for one in (a, b)) - _NEARER
    hidden = (segmented.pieces[rows, columns] > 0) & (depth[rows, columns] < near) | segmented.robot[rows, columns]
    return bool(hidden[between].mean() > _MOST_OF_IT)


def _middle(segment: Segment) -> Array:
    rows, columns = np.nonzero(segment.mask)
    return np.array([columns.mean() + segment.box[0], rows.mean() + segment.box[1]])


def _median_depth(segment: Segment, depth: Image) -> float:
    left, top, right, bottom = segment.box
    values = depth[top:bottom, left:right][segment.mask]
    return float(np.median(values[values > 0.0])) if (values > 0.0).any() else 0.0


def seen_through(hull: Fit, frames: FrameSet, places: Array = _GRID, most: float = _SEEN_THROUGH) -> bool:
    """Tell whether a view shows what lies behind places that a shape would fill.

    Args:
        hull: The shape.
        frames: The views.
        places: Where in it to look, as shares of its half-extents along its own axes, (n, 3).
        most: Share of the places behind which a view may well show something.
    """
    local = hull.half * places
    points = hull.centre + local @ hull.axes.T
    points = points[hull.distances(points) < 0.0]
    for segmented in frames.by_camera.values():
        pixels, expected = segmented.frame.project(points)
        height, width = segmented.frame.depth.shape
        inside = (expected > 0.0) & (pixels >= 0.0).all(axis=1) & (pixels < [width - 0.5, height - 0.5]).all(axis=1)
        columns, rows = np.rint(pixels[inside]).astype(int).T
        clear = segmented.frame.valid[rows, columns] & ~segmented.robot[rows, columns]
        behind = segmented.frame.depth[rows, columns] - expected[inside] > _BEHIND
        if float((behind & clear).sum()) > most * len(points):
            return True
    return False
