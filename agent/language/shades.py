"""Light blue, dark green: which of the things seen such a shade means, by how far apart people see colours."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from robosandbox.perception.colour import COLOURS, lab_from_rgb
from robosandbox.types import Array, DetectedObject

_MIXED = {"light": 1.0, "dark": 0.0}
"""Half of a light shade is white, half of a dark one black."""


def shade_distance(item: DetectedObject, colours: Sequence[str], shade: str) -> float:
    """Return how far an object's colour is from a shade of some colours, in CIELAB units; from white or black for none.

    Args:
        item: What is seen.
        colours: Names of the colours whose shade was asked for.
        shade: light or dark.
    """
    if not colours:
        red, green, blue, _ = item.rgba
        # Luminance by the weights of Rec. 709.
        return 100 * abs(_MIXED[shade] - (0.2126 * red + 0.7152 * green + 0.0722 * blue))
    return _nearest(item, _shades(tuple(colours), shade))


def is_rather(item: DetectedObject, colours: Sequence[str], shade: str) -> bool:
    """Say whether an object's colour is rather the light or rather the dark shade, as asked."""
    other = "dark" if shade == "light" else "light"
    return shade_distance(item, colours, shade) < shade_distance(item, colours, other)


def has_shade(item: DetectedObject, colours: Sequence[str], shade: str) -> bool:
    """Say whether an object's colour is nearer to a shade of some colours than to any other plain colour."""
    others = tuple(name for name in COLOURS if name not in colours)
    return shade_distance(item, colours, shade) < _nearest(item, _plain(others))


def _nearest(item: DetectedObject, samples: Array) -> float:
    red, green, blue, _ = item.rgba
    return float(np.linalg.norm(samples - _lab(red, green, blue), axis=1).min()) if len(samples) else float("inf")


@lru_cache(maxsize=256)
def _lab(red: float, green: float, blue: float) -> Array:
    return lab_from_rgb(np.array([red, green, blue]))


@lru_cache(maxsize=64)
def _shades(colours: tuple[str, ...], shade: str) -> Array:
    samples = [sample for name in colours for sample in COLOURS.get(name, ())]
    return lab_from_rgb(0.5 * np.array(samples) + 0.5 * _MIXED[shade]) if samples else np.empty((0, 3))


@lru_cache(maxsize=64)
def _plain(colours: tuple[str, ...]) -> Array:
    return lab_from_rgb(np.array([sample for name in colours for sample in COLOURS[name]]))
