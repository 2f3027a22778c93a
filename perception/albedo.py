"""Albedo: the colour of an object under any light, read against the table beside it."""

from __future__ import annotations

import numpy as np

from robosandbox.perception.evidence import SurfacePoints
from robosandbox.perception.fit import Fit
from robosandbox.perception.frame import TablePrior
from robosandbox.perception.frames import BARE_STRIDE, FrameSet, SegmentedFrame
from robosandbox.perception.quantiles import median
from robosandbox.perception.segments import Segment
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.shapes import CONTAINER_WALL
from robosandbox.types import Array

# Light is read off the table so many pixels around, or farther where there is none, as within a bin. Chosen.
_AROUND = (40, 120)
_LEAST_TABLE = 12  # Number of the table's pixels that tell its light. Chosen.
_ON_TABLE = 2.0 * TOLERANCES.depth  # Metres from top or floor within which a point faces up.
_FACING_UP = 0.8  # Least upward part of a unit normal that faces up, a cosine. Chosen: within 37 degrees.
_LEAST = 8  # Number of upward pixels from which they alone tell the colour, because sides are darker. Chosen.
# A face that is turned from the light sends about this share of what the same colour lying flat sends. Chosen for the lights
# of sim/world.py.
SIDE_LIGHT = 0.62


def albedo_of(segments: tuple[Segment, ...], found: Fit, frames: FrameSet, *, hollow: bool = False) -> Array:
    """Return the colour (3,), channels 0..1, that a thing would have in plain light.

    The table's colour is known, so that pixels of the table near the thing tell the light; only surfaces that face up as
    the table does get the same. Where none does, the sides are taken and their shade is guessed.
    """
    readings, weights = [], []
    for segment in segments:
        light = _light(segment, frames.table, frames.by_camera[segment.frame.camera])
        if light is None:
            continue
        normals = found.normals_on(SurfacePoints(segment.points, segment.frame.position, 1.0))
        up = normals[:, 2] > _FACING_UP
        if hollow:
            # A container's rim and floor face up; between them are its walls.
            height = segment.points[:, 2]
            up = (height > found.top - _ON_TABLE) | (height < found.bottom + CONTAINER_WALL + _ON_TABLE)
        if up.sum() >= _LEAST:
            readings.append(median(segment.colours[up]) / light)
            weights.append(float(up.sum()))
        else:
            readings.append(median(segment.colours) / light / SIDE_LIGHT)
            weights.append(1e-3 * len(segment.points))
    if not readings:
        return np.asarray(segments[0].rgb / 255.0)
    return np.clip(np.average(readings, axis=0, weights=weights), 0.0, 1.0)


def _light(segment: Segment, table: TablePrior, segmented: SegmentedFrame) -> Array | None:
    """Return what a white table would send here, 0..255 per channel, (3,)."""
    rgb = segment.frame.rgb[::BARE_STRIDE, ::BARE_STRIDE]
    left, top, right, bottom = segment.box
    for around in _AROUND:
        rows = slice(max(top - around, 0) // BARE_STRIDE, (bottom + around) // BARE_STRIDE)
        columns = slice(max(left - around, 0) // BARE_STRIDE, (right + around) // BARE_STRIDE)
        seen = rgb[rows, columns][segmented.bare[rows, columns]]
        if len(seen) >= _LEAST_TABLE:
            return np.asarray(median(seen.astype(np.float64)) / np.array(table.rgb))
    return None
