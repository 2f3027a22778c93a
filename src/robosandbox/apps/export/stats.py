"""Statistics as training code normalizes with: extremes, mean, deviation and quantiles per feature."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}

Stats = dict[str, list[Any]]


def of_values(values: NDArray[Any]) -> Stats:
    """Return the statistics of each feature.

    Args:
        values: Shape (samples, features).
    """
    numbers = values.astype(np.float64)
    found = {
        "min": numbers.min(axis=0),
        "max": numbers.max(axis=0),
        "mean": numbers.mean(axis=0),
        "std": numbers.std(axis=0),
        **{name: np.quantile(numbers, q, axis=0) for name, q in QUANTILES.items()},
    }
    return {**{name: value.tolist() for name, value in found.items()}, "count": [len(numbers)]}


class PictureStats:
    """Statistics of the three channels over pictures, exact and without keeping one: colours have 256 values.

    Attributes:
        count: How many pictures were added.
    """

    def __init__(self) -> None:
        self.count: int = 0
        self.histogram = np.zeros((3, 256), dtype=np.int64)

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Add a picture, RGB (height, width, 3) uint8."""
        self.count += 1
        for channel in range(3):
            self.histogram[channel] += np.bincount(picture[..., channel].ravel(), minlength=256)

    def merge(self, other: PictureStats) -> None:
        """Add the pictures of another."""
        self.count += other.count
        self.histogram += other.histogram

    def stats(self) -> Stats:
        """Return the statistics with colours scaled to 0..1, each shape (3, 1, 1)."""
        levels = np.arange(256) / 255.0
        total = self.histogram.sum(axis=1)
        mean = self.histogram @ levels / total
        found = {
            "min": [levels[np.flatnonzero(row)[0]] for row in self.histogram],
            "max": [levels[np.flatnonzero(row)[-1]] for row in self.histogram],
            "mean": mean,
            "std": np.sqrt(np.maximum(0.0, self.histogram @ levels**2 / total - mean**2)),
        }
        below = np.cumsum(self.histogram, axis=1) / total[:, None]
        for name, q in QUANTILES.items():
            found[name] = [levels[np.searchsorted(row, q)] for row in below]
        shaped: Stats = {name: [[[float(value)]] for value in values] for name, values in found.items()}
        return {**shaped, "count": [self.count]}
