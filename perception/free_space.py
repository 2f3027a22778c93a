"""Free space: what a frame shows behind a place proves that the place is empty."""

from __future__ import annotations

import numpy as np

from robosandbox.perception.fit import Fit
from robosandbox.perception.frames import FrameSet
from robosandbox.perception.thing import Thing
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.types import Array

_BEHIND = 4.0 * TOLERANCES.depth  # Metres behind a shape's surface from which a point is seen through it.
_MAY_SHOW = 0.03  # Share of a shape's points that may be seen through. Chosen.
# Places over a hull, a fraction of its half-extents each, at which it is seen through or not. Chosen short of edges.
_ACROSS = np.linspace(-0.8, 0.8, 9)
_GRID = np.array([[x, y, z] for x in _ACROSS for y in _ACROSS for z in (-0.8, 0.0, 0.8)])
# Metres behind a thing's front at which something is seen where it was, if it is gone; less for small things. Chosen.
_SEEN_THROUGH = 0.03
_SHARE_THROUGH = 0.6  # Share of a thing's pixels that must be seen through. Chosen.
_ALL_THROUGH = 0.95  # The same share of a container, because one sees between its walls. Chosen.


def has_left(thing: Thing, frames: FrameSet) -> bool:
    """Tell whether some view shows what lies behind the place where a thing was."""
    half = thing.fit.half
    # One looks into a container, and at no more than two of its walls.
    walls = thing.shape.holds_things
    across, heights = ((-0.97, 0.0, 0.97), (0.3,)) if walls else ((-0.5, 0.0, 0.5), (-0.3, 0.3))
    corners = np.array([[x, y, z] for x in across for y in across for z in heights if x or y or not walls])
    points = thing.fit.centre + (corners * half) @ thing.fit.axes.T
    for segmented in frames.by_camera.values():
        beyond = segmented.beyond(points)
        beyond = beyond[np.isfinite(beyond)]
        if len(beyond) < len(points) // 2:
            continue
        # The table is as far behind as the thing is high, along the ray.
        behind = beyond > min(_SEEN_THROUGH, 0.7 * float(half.min()))
        if behind.mean() > (_ALL_THROUGH if walls else _SHARE_THROUGH):
            return True
    return False


def seen_through(hull: Fit, frames: FrameSet, places: Array = _GRID, most: float = _MAY_SHOW) -> bool:
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
        if float((segmented.beyond(points) > _BEHIND).sum()) > most * len(points):
            return True
    return False
