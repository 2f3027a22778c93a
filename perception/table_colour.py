"""Pixels whose colour is clearly not the table's."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import cv2
import numpy as np

from robosandbox.perception.frame import Mask, PointCloudFrame
from robosandbox.perception.quantiles import median
from robosandbox.types import Array

# Pixels between the rows and columns to which the table's colour is fitted. Chosen: 4800 points of a frame, enough for six
# terms.
_COARSE = 8
# Number of the table's coarse pixels below which its colour is not known. Chosen: over 30 for each of the fit's six terms.
_LEAST_TABLE = 200
# Difference from the table's colour, summed over channels of 255 levels, that is another colour. Chosen: 12 levels a channel,
# six times the noise of `realsense`.
_OTHER_COLOUR = 36.0


def painted(frame: PointCloudFrame, bare: Mask, crop: tuple[slice, slice]) -> Mask:
    """Return the pixels whose colour is clearly not the table's.

    The table's picture is taken to vary slowly: a quadratic in the pixel's place for each channel.
    """
    height, width = bare.shape
    coarse = bare[::_COARSE, ::_COARSE]
    if np.count_nonzero(coarse) < _LEAST_TABLE:
        return np.zeros_like(bare[crop])
    seen = frame.rgb[::_COARSE, ::_COARSE][coarse].astype(np.float64)
    grid = _quadratic(height, width)
    design = grid[coarse.reshape(-1)]
    keep: Any = slice(None)
    shade, off = np.zeros((6, 3)), np.zeros(len(seen))
    for _ in range(2):
        kept = design[keep]
        shade = np.linalg.solve(kept.T @ kept + 1e-6 * np.eye(6), kept.T @ seen[keep])
        off = np.abs(seen - design @ shade) @ np.ones(3)
        keep = off < 3.0 * median(off) + 6.0
    plain = np.clip(grid @ shade, 0.0, 255.0).reshape(*coarse.shape, 3).astype(np.uint8)
    whole = cv2.resize(plain, (width, height), interpolation=cv2.INTER_LINEAR)
    noise = float(median(off))
    off_table = cv2.transform(cv2.absdiff(frame.rgb[crop], whole[crop]).astype(np.float32), np.ones((1, 3), np.float32))
    # An edge lies where half of its contrast is reached.
    half = 0.5 * cv2.dilate(off_table, np.ones((3, 3), np.uint8))
    return np.asarray(off_table > np.maximum(half, max(_OTHER_COLOUR, 6.0 * noise)))


@lru_cache(maxsize=8)
def _quadratic(height: int, width: int) -> Array:
    """Return the terms (n, 6) of a quadratic in the place of each `_COARSE`th row and column of a picture."""
    rows, columns = np.meshgrid(np.arange(0, height, _COARSE), np.arange(0, width, _COARSE), indexing="ij")
    v, u = rows.ravel() / height, columns.ravel() / width
    return np.column_stack([np.ones_like(u), u, v, u * u, u * v, v * v])
