"""Noise drawn once and laid over pictures at random places: as good as drawn anew for each, at a tenth of the time."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.types import PictureWindow
from robosandbox.values import frozen

_Pixel = TypeVar("_Pixel", np.float32, np.uint8, np.uint16)

# Pixels a side of the tables. Chosen: a picture of 640 x 480 has 200,000 places in them, and they take 11 MB.
_SIDE = 1024
# Pixels a side of what falls into one matching window of stereo, whose depth errs alike. Chosen.
_WINDOW = 3
# Factor of what each pixel errs by itself, so that about half of the variance is that of its window. Chosen.
_OWN = 0.7
# Levels of a byte to a standard deviation of colour noise: four standard deviations fit in.
_LEVELS = 32


@frozen
class NoiseTables:
    """Noise tables, drawn once for a seed.

    Attributes:
        stereo: Errors of disparity as stereo matching makes them, in parts of their standard deviation, (side, side).
        colour: Errors of three channels, 128 and `_LEVELS` to a standard deviation, (side, side, 3).
        uniform: Evenly distributed over all 16-bit numbers, (side, side).
    """

    stereo: NDArray[np.float32]
    colour: NDArray[np.uint8]
    uniform: NDArray[np.uint16]

    def lost(
        self, share: float, size: tuple[int, int], window: PictureWindow, rng: np.random.Generator
    ) -> NDArray[np.bool_]:
        """Return a mask of a window of a picture of this size with a share of its pixels set, at random."""
        return np.asarray(_patch(self.uniform, size, window, rng) < round(share * 65536))

    def disparity(self, size: tuple[int, int], window: PictureWindow, rng: np.random.Generator) -> NDArray[np.float32]:
        """Return errors of disparity in a window of a picture of this size, in parts of their standard deviation."""
        return np.asarray(_patch(self.stereo, size, window, rng))

    def coloured(
        self,
        rgb: NDArray[np.uint8],
        gain: float,
        deviation: float,
        size: tuple[int, int],
        window: PictureWindow,
        rng: np.random.Generator,
    ) -> NDArray[np.uint8]:
        """Return a window of a picture of this size made brighter by a factor, with noise in each channel.

        Args:
            rgb: The window, (height, width, 3).
            gain: The factor.
            deviation: Standard deviation of the noise, of 255.
            size: (height, width) of the whole picture.
            window: Where in it.
            rng: Tells which part of the noise that was drawn.
        """
        patch = _patch(self.colour, size, window, rng)
        scale = deviation / _LEVELS
        return np.asarray(cv2.addWeighted(rgb, gain, patch, scale, -128.0 * scale), dtype=np.uint8)


@lru_cache(maxsize=2)
def noise_tables(seed: int) -> NoiseTables:
    """Return the tables of a seed."""
    rng = np.random.default_rng([seed, 3])
    coarse = rng.standard_normal((-(-_SIDE // _WINDOW),) * 2, dtype=np.float32)
    stereo = np.asarray(cv2.resize(coarse, (_SIDE, _SIDE), interpolation=cv2.INTER_CUBIC), dtype=np.float32)
    stereo += np.float32(_OWN) * rng.standard_normal((_SIDE, _SIDE), dtype=np.float32)
    normal = rng.standard_normal((_SIDE, _SIDE, 3), dtype=np.float32)
    colour = np.clip(np.rint(128.0 + _LEVELS * normal), 0.0, 255.0).astype(np.uint8)
    return NoiseTables(stereo, colour, rng.integers(0, 65536, (_SIDE, _SIDE), dtype=np.uint16))


def _patch(
    table: NDArray[_Pixel], size: tuple[int, int], window: PictureWindow, rng: np.random.Generator
) -> NDArray[_Pixel]:
    """Return a window of what lies over a picture: a part of a table, at a random place; over a larger one it is repeated."""
    if max(size) > _SIDE:
        down, across = (-(-each // _SIDE) for each in size)
        table = np.tile(table, (down, across, 1) if table.ndim == 3 else (down, across))
    top, left = (int(rng.integers(have - each + 1)) for have, each in zip(table.shape[:2], size, strict=True))
    return table[top + window.top : top + window.bottom, left + window.left : left + window.right]
