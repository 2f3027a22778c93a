"""Depths at which a camera would see fitted shapes: rays through pixels, met with boxes, cylinders and spheres."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robosandbox.perception.fit import Fit
from robosandbox.perception.frame import Image, PointCloudFrame
from robosandbox.perception.thing import Thing
from robosandbox.types import Array

_TINY = 1e-9  # Share of a direction that is along an axis at the least, so that it can be divided by.


def depths_of(thing: Thing, frame: PointCloudFrame, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Image:
    """Return the depth (n,), metres, at which a frame's pixels show a thing; NaN where they miss it.

    Args:
        thing: Which; into an open container one looks as far as its walls and floor.
        frame: Straight.
        rows: Of the pixels, (n,).
        columns: Of the pixels, (n,).
    """
    matrix = frame.matrix
    flat = np.column_stack(
        [(columns - matrix[0, 2]) / matrix[0, 0], (rows - matrix[1, 2]) / matrix[1, 1], np.ones(len(rows))]
    )
    rays = flat @ frame.rotation.T
    near, far = span(thing.fit, frame.position, rays)
    depth = np.where((near < far) & (near > 0.0), near, np.nan)
    room = thing.shape.room(thing.size, None) if thing.shape.is_open_container else None
    if room is not None:
        # The hollow goes on over the rim, so that a ray which comes in through it leaves through a wall or the floor.
        half = thing.fit.half.copy()
        half[:2], half[2] = room.half, thing.fit.half[2] + room.rim
        sizes = half if thing.fit.shape == "box" else half[[0, 2]]
        above = thing.fit.bottom + room.floor + half[2]
        hollow = replace(thing.fit, centre=np.array([*thing.fit.centre[:2], above]), sizes=sizes)
        enters, leaves = span(hollow, frame.position, rays)
        depth = np.where((enters < depth) & (leaves > depth), leaves, depth)
    return np.asarray(depth, dtype=np.float32)


def span(shape: Fit, origin: Array, rays: Array) -> tuple[Array, Array]:
    """Return where rays enter and leave a shape, (n,) each, in their lengths; the first is larger where they miss it.

    Args:
        shape: Box, cylinder or sphere.
        origin: Where all rays begin, world, (3,).
        rays: Directions, world, (n, 3).
    """
    start = (origin - shape.centre) @ shape.axes
    along = rays @ shape.axes
    if shape.shape == "box":
        return _between(start, along, shape.sizes)
    across = slice(0, 3) if shape.shape == "sphere" else slice(0, 2)
    # A ray along the axis meets no side: as good as one that hardly leans.
    a = np.maximum((along[:, across] ** 2).sum(axis=1), _TINY)
    b = along[:, across] @ start[across]
    inside = b * b - a * (start[across] @ start[across] - shape.sizes[0] ** 2)
    root = np.sqrt(np.maximum(inside, 0.0))
    near, far = (-b - root) / a, (-b + root) / a
    if shape.shape != "sphere":
        low, high = _between(start[2:], along[:, 2:], shape.sizes[1:])
        near, far = np.maximum(near, low), np.minimum(far, high)
    return np.where(inside > 0.0, near, np.inf), far


def _between(start: Array, along: Array, half: Array) -> tuple[Array, Array]:
    """Return where rays enter and leave what lies between pairs of planes, (n,) each."""
    steps = np.where(np.abs(along) < _TINY, _TINY, along)
    ends = np.stack([(-half - start) / steps, (half - start) / steps])
    return ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
