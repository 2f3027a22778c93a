"""Medians and percentiles along the first axis: NumPy's own spend most of their time on cases that do not arise here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robosandbox.types import Array

MAD = 1.4826  # Ratio of a standard deviation to the median of absolute deviations, as of a normal distribution.


def median(values: Array) -> Array:
    """Return the median (...) of values (n, ...) as `numpy.median` along the first axis; n is 1 or more, none of them NaN."""
    last = len(values) - 1
    low, high = last // 2, (last + 1) // 2
    ordered = np.partition(values, high if low == high else (low, high), axis=0)
    return np.asarray(ordered[low] if low == high else (ordered[low] + ordered[high]) / 2.0, dtype=np.float64)


def percentiles(values: Array, percents: Sequence[float]) -> list[Any]:
    """Return a percentile (...) of values (n, ...) for each percentage, as `numpy.percentile` along the first axis.

    Between two values it is interpolated linearly; n is 1 or more, none of them NaN.
    """
    places = [percent / 100.0 * (len(values) - 1) for percent in percents]
    neighbours = [(int(place), min(int(place) + 1, len(values) - 1)) for place in places]
    ordered = np.partition(values, sorted({each for pair in neighbours for each in pair}), axis=0)
    return [
        ordered[low] + (place - low) * (ordered[high] - ordered[low])
        for place, (low, high) in zip(places, neighbours, strict=True)
    ]
