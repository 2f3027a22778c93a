"""Noise drawn once and laid over pictures at random places: as good as drawn anew for each, at a tenth of the time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

_Pixel = TypeVar("_Pixel", np.float32, np.uint8, np.uint16)

# Pixels a side of the tables. Chosen: a picture of 640 x 480 has 200,000 places in them, and they take 11 MB.
_SIDE = 1024
# Pixels a side of what falls into one matching window of stereo, whose depth errs alike. Chosen.
_WINDOW = 3
# Factor of what each pixel errs by itself, so that about half of the variance is that of its window. Chosen.
_OWN = 0.7
# Levels of a byte to a standard deviation of colour noise: four standard deviations fit in.
_LEVELS = 32


@dataclass(frozen=True, slots=True)
class NoiseTables:
    """What is drawn once for a seed.

    Attributes:
        stereo: Errors of disparity as stereo matching makes them, in parts of their standard deviation, (side, side).
        colour: Errors of three channels, 128 and `_LEVELS` to a standard deviation, (side, side, 3).
        uniform: Evenly distributed over all 16-bit numbers, (side, side).
    """

    stereo: NDArray[np.float32]
    colour: NDArray[np.uint8]
    uniform: NDArray[np.uint16]

    def lost(self, share: float, shape: tuple[int, int], rng: np.random.Generator) -> NDArray[np.bool_]:
        """Return a mask of this shape with a share of its pixels set, at random."""
        return np.asarray(_patch(self.uniform, shape, rng) < round(share * 65536))

    def disparity(self, shape: tuple[int, int], rng: np.random.Generator) -> NDArray[np.float32]:
        """Return errors of disparity of a picture of this shape, in parts of their standard deviation."""
        return np.asarray(_patch(self.stereo, shape, rng))

    def coloured(
        self, rgb: NDArray[np.uint8], gain: float, deviation: float, rng: np.random.Generator
    ) -> NDArray[np.uint8]:
        """Return a picture made brighter by a factor, with noise of this standard deviation in each channel, of 255."""
        height, width = rgb.shape[:2]
        patch = _patch(self.colour, (height, width), rng)
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


def _patch(table: NDArray[_Pixel], shape: tuple[int, int], rng: np.random.Generator) -> NDArray[_Pixel]:
    """Return a part of a table, at a random place; of what is larger than the table, the table again and again."""
    if max(shape) > _SIDE:
        repeats = tuple(-(-size // _SIDE) for size in shape)
        table = np.tile(table, (*repeats, *(1,) * (table.ndim - 2)))
    top, left = (int(rng.integers(have - size + 1)) for have, size in zip(table.shape, shape, strict=False))
    return table[top : top + shape[0], left : left + shape[1]]
