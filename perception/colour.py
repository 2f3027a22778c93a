"""English names for colours: the nearest named one in CIELAB, where distance follows what people see."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from robosandbox.types import Array

# What people mean by the plain words, as sRGB; several samples where a word covers a wide range.
COLOURS: dict[str, tuple[tuple[float, float, float], ...]] = {
    "red": ((0.85, 0.2, 0.2), (0.9, 0.05, 0.05), (0.6, 0.08, 0.08)),
    "green": ((0.2, 0.7, 0.25), (0.1, 0.5, 0.1), (0.3, 0.85, 0.3)),
    "blue": ((0.2, 0.3, 0.85), (0.1, 0.15, 0.6), (0.25, 0.5, 0.9)),
    "yellow": ((0.95, 0.85, 0.15), (0.85, 0.75, 0.1)),
    "orange": ((0.95, 0.55, 0.1), (0.85, 0.4, 0.1)),
    "purple": ((0.5, 0.2, 0.7), (0.6, 0.3, 0.8)),
    "pink": ((0.95, 0.6, 0.75), (0.9, 0.4, 0.65)),
    "cyan": ((0.2, 0.8, 0.85), (0.1, 0.65, 0.7)),
    "brown": ((0.45, 0.28, 0.15), (0.55, 0.38, 0.22)),
    "white": ((0.97, 0.97, 0.97), (0.88, 0.88, 0.88)),
    "grey": ((0.5, 0.5, 0.5), (0.65, 0.65, 0.65), (0.35, 0.35, 0.35)),
    "black": ((0.05, 0.05, 0.05), (0.15, 0.15, 0.15)),
}

# XYZ of the white point D65, a fraction of its Y, as in the sRGB standard (IEC 61966-2-1).
_D65 = np.array([0.95047, 1.0, 1.08883])
# Linear sRGB to XYZ: coefficients (a fraction of Y each), as in the sRGB standard (IEC 61966-2-1).
_RGB_TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def lab_from_rgb(rgb: Array) -> Array:
    """Return CIELAB (..., 3) of sRGB values (..., 3) in 0..1 under D65 (CIE 15:2004)."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = linear @ _RGB_TO_XYZ.T / _D65
    f = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1)


_NAMES = [name for name, samples in COLOURS.items() for _ in samples]
_LABS = lab_from_rgb(np.array([sample for samples in COLOURS.values() for sample in samples]))


@lru_cache(maxsize=1024)
def _name(rgb: tuple[float, float, float]) -> str:
    distance = np.linalg.norm(_LABS - lab_from_rgb(np.array(rgb)), axis=1)
    return _NAMES[int(distance.argmin())]


def colour_name(rgba: Sequence[float]) -> str:
    """Return the English name nearest to a colour, channels 0..1."""
    return _name((float(rgba[0]), float(rgba[1]), float(rgba[2])))
