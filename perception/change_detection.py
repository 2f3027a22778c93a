"""Change detection for a fixed camera: two pictures compared by the noise that they have."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.perception.frame import LEAST_DEPTH, MOST_DEPTH, Image, Mask, TablePrior, as_image, as_picture
from robosandbox.perception.quantiles import MAD, median
from robosandbox.types import Array, Intrinsics, PictureWindow, RgbdFrame

# Standard deviations of the noise beyond which a pixel has changed: of a million normal numbers none is so far off. Chosen.
_BEYOND = 6.0
_LEAST_COLOUR = (
    10.0  # Levels of a channel, of 255, by which a pixel has changed at least. Chosen: rounding, compression.
)
# Difference of disparity, 1/m, by which a pixel has changed at least. Chosen: 3 mm at 1 m, what the fitted table is off.
_LEAST_DISPARITY = 0.003
_COLOUR_PATCH = (
    5  # Pixels a side within which `_COLOUR_COUNT` must have another colour. Chosen: a thing's edge is a line.
)
_COLOUR_COUNT = 4  # Number of them; single pixels flicker at edges. Chosen.
_DEPTH_PATCH = 7  # Pixels a side over which depth is averaged. Chosen: twice the window of stereo matching.
_DEPTH_COUNT = 12  # Number of pixels whose averaged depth must differ. Chosen: a quarter of what averages share.
_STRIDE = 5  # Pixels between those of which the noise is measured. Chosen.
_LEAST_SAMPLES = 40  # Number of pixels from which the noise is told. Chosen.
# Standard deviation of averaged disparity, 1/m, where too few pixels tell it. Chosen: twice that of `realsense`.
_USUAL_DISPARITY_NOISE = 0.002
_USUAL_COLOUR_NOISE = 4.0  # The same of a channel, of 255 levels. Chosen likewise.


@dataclass(slots=True, eq=False)
class Reference:
    """Reference picture of a fixed camera, where nothing hid it.

    Attributes:
        rgbd: The frame that it was last perceived in.
        rgb: As the camera delivers it, (height, width, 3).
        disparity: 1 / depth, 1/m, (height, width); 0 where it was not measured.
        known: Where the colour counts: it was seen.
    """

    rgbd: RgbdFrame
    rgb: NDArray[np.uint8]
    disparity: Image
    known: Mask

    def forget(self, hidden: Mask) -> None:
        """Take what it saw there to tell nothing any more."""
        self.known &= ~hidden
        self.disparity[hidden] = 0.0

    def learn(self, rgbd: RgbdFrame, hidden: Mask, window: PictureWindow) -> None:
        """Take over what this part of a frame shows for the first time."""
        part = np.s_[window.rows, window.columns]
        rgb, known = rgbd.rgb[part], self.known[part]
        new = ~(known | hidden[part])
        if new.any():
            brightness = 1.0 / _gain(self.rgb[part], rgb, known & ~hidden[part])
            self.rgb[part][new] = cv2.convertScaleAbs(rgb, alpha=brightness)[new]
            self.disparity[part][new] = disparity_of(rgbd.depth[part])[new]
            known |= new


def disparity_of(depth: Image) -> Image:
    """Return 1 / depth, 1/m, where depth (height, width) is measured; 0 elsewhere."""
    measured = (depth > LEAST_DEPTH) & (depth < MOST_DEPTH)
    return np.divide(1.0, depth, out=np.zeros_like(depth), where=measured)


def changed(reference: Reference, rgbd: RgbdFrame, hidden: Mask, window: PictureWindow) -> bool:
    """Tell whether a frame shows something else than was seen before.

    Args:
        reference: Of the same camera.
        rgbd: A frame of it now.
        hidden: Where the robot, or what it holds, stands before the scene, (height, width).
        window: The part to compare.
    """
    part = np.s_[window.rows, window.columns]
    visible = ~hidden[part]
    known = reference.known[part] & visible
    if _colour_differs(reference.rgb[part], rgbd.rgb[part], known):
        return True
    return _depth_differs(reference.disparity[part], disparity_of(rgbd.depth[part]), visible)


def _colour_differs(before: NDArray[np.uint8], now: NDArray[np.uint8], known: Mask) -> bool:
    if not known.any():
        return False
    expected = as_picture(cv2.convertScaleAbs(before, alpha=_gain(before, now, known)))
    first, second, third = cv2.split(cv2.absdiff(now, expected))
    largest = as_picture(cv2.max(cv2.max(first, second), third))
    green = now[..., 1].astype(np.float32) - expected[..., 1]
    noise = _noise(green, known, 1, _USUAL_COLOUR_NOISE)
    off = as_picture(cv2.threshold(largest, max(_BEYOND * noise, _LEAST_COLOUR), 1.0, cv2.THRESH_BINARY)[1])
    off &= known.view(np.uint8)
    counts = cv2.boxFilter(off, cv2.CV_8U, (_COLOUR_PATCH, _COLOUR_PATCH), normalize=False)
    return int(counts.max()) >= _COLOUR_COUNT


def _depth_differs(before: Image, now: Image, visible: Mask) -> bool:
    both = visible & (before > 0.0) & (now > 0.0)
    off = now - before
    off[~both] = 0.0
    averaged = as_image(cv2.blur(off, (_DEPTH_PATCH, _DEPTH_PATCH)))
    noise = _noise(averaged, both, _DEPTH_PATCH, _USUAL_DISPARITY_NOISE)
    limit = max(_BEYOND * noise, _LEAST_DISPARITY)
    return int(np.count_nonzero(np.abs(averaged) > limit)) >= _DEPTH_COUNT


def _noise(off: Image, valid: Mask, apart: int, usual: float) -> float:
    """Return the standard deviation of the noise in differences of two pictures, whatever part of them has changed.

    Pixels beside each other change alike; those that are `apart` pixels apart in a row have a noise of their own each.
    """
    pairs = valid[::_STRIDE, apart::_STRIDE] & valid[::_STRIDE, :-apart:_STRIDE]
    steps = (off[::_STRIDE, apart::_STRIDE] - off[::_STRIDE, :-apart:_STRIDE])[pairs]
    if len(steps) < _LEAST_SAMPLES:
        return usual
    return MAD * float(median(np.abs(steps).astype(np.float64))) / math.sqrt(2.0)


def _gain(before: NDArray[np.uint8], now: NDArray[np.uint8], known: Mask) -> float:
    """Return by how much the exposure makes one picture brighter than the other."""
    mask = known.view(np.uint8)
    dark, bright = (max(sum(cv2.mean(picture, mask)[:3]), 1.0) for picture in (before, now))
    return bright / dark


def table_disparity(lens: Intrinsics, rotation: Array, position: Array, table: TablePrior, pixels: Mask) -> Image:
    """Return the disparity, 1/m, of the bare table in these pixels as a lens delivers them, (n,); 0 beside the table.

    Args:
        lens: The camera's.
        rotation: Its axes in the world, (3, 3).
        position: Its place in the world, (3,).
        table: Where it is.
        pixels: Which of its picture, (height, width); n of them.
    """
    x, y = (rays[pixels] for rays in raw_rays(lens))
    along = [turn[0] * x + turn[1] * y + turn[2] for turn in rotation.astype(np.float32)]
    # The depth at which a pixel's ray meets the table's plane is (height - z) / slope.
    disparity = along[2] / np.float32(table.height - position[2])
    depth = np.divide(1.0, disparity, out=np.full_like(disparity, np.inf), where=disparity > 1.0 / MOST_DEPTH)
    with np.errstate(invalid="ignore"):
        on = table.within(*(along[k] * depth + np.float32(position[k]) for k in (0, 1)))
    return as_image(np.where(on, disparity, np.float32(0.0)))


@lru_cache(maxsize=8)
def raw_rays(lens: Intrinsics) -> tuple[Image, Image]:
    """Return the directions at depth 1 of the pixels as a lens delivers them: x and y, (height, width) each."""
    matrix = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
    columns, rows = np.meshgrid(np.arange(lens.width, dtype=np.float32), np.arange(lens.height, dtype=np.float32))
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 1, 2)
    rays = as_image(cv2.undistortPoints(pixels, matrix, np.array(lens.distortion))).reshape(lens.height, lens.width, 2)
    return np.ascontiguousarray(rays[..., 0]), np.ascontiguousarray(rays[..., 1])


@lru_cache(maxsize=8)
def bent(lens: Intrinsics) -> int:
    """Return by how many pixels a lens moves any pixel at most, rounded up."""
    x, y = raw_rays(lens)
    columns, rows = np.arange(lens.width), np.arange(lens.height)
    across = np.abs(lens.fx * x + np.float32(lens.cx) - columns[None, :]).max()
    down = np.abs(lens.fy * y + np.float32(lens.cy) - rows[:, None]).max()
    return int(np.ceil(max(float(across), float(down))))
