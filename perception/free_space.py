"""Free space: a frame that shows what lies behind an object's old place proves that the object has left it."""

from __future__ import annotations

import numpy as np

from robosandbox.perception.frames import FrameSet
from robosandbox.perception.thing import Thing

# Metres behind a thing's front at which something is seen where it was, if it is gone; less for small things. Chosen.
_SEEN_THROUGH = 0.03
_SHARE_THROUGH = 0.6  # Share of a thing's pixels that must be seen through. Chosen.
_ALL_THROUGH = 0.95  # The same share of a container, because one sees between its walls. Chosen.


def seen_through(thing: Thing, frames: FrameSet) -> bool:
    """Tell whether some view shows what lies behind the place where a thing was."""
    centre, axes, sizes = thing.fit.centre, thing.fit.axes, thing.fit.sizes
    half = np.array([sizes[0], sizes[min(1, len(sizes) - 1)], sizes[-1]])
    if thing.fit.shape in ("cylinder", "lying"):
        half = np.array([sizes[0], sizes[0], sizes[1]])
    # One looks into a container, and at no more than two of its walls.
    walls = thing.shape.holds_things
    across, heights = ((-0.97, 0.0, 0.97), (0.3,)) if walls else ((-0.5, 0.0, 0.5), (-0.3, 0.3))
    corners = np.array([[x, y, z] for x in across for y in across for z in heights if x or y or not walls])
    points = centre + (corners * half) @ axes.T
    for segmented in frames.by_camera.values():
        pixels, expected = segmented.frame.project(points)
        columns, rows = np.rint(pixels).astype(int).T
        height, width = segmented.frame.depth.shape
        inside = (columns >= 0) & (rows >= 0) & (columns < width) & (rows < height) & (expected > 0.0)
        columns, rows = columns[inside], rows[inside]
        measured = segmented.frame.depth[rows, columns]
        clear = segmented.frame.valid[rows, columns] & ~segmented.robot[rows, columns]
        if clear.sum() < len(points) // 2:
            continue
        # The table is as far behind as the thing is high, along the ray.
        behind = measured[clear] - expected[inside][clear] > min(_SEEN_THROUGH, 0.7 * float(half.min()))
        if behind.mean() > (_ALL_THROUGH if walls else _SHARE_THROUGH):
            return True
    return False
