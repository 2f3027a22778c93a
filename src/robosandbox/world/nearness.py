"""Distance test of two things against a threshold: a bound first, which settles most pairs, then exactly."""

from __future__ import annotations

import math

from robosandbox.types import DetectedObject
from robosandbox.world.relations import extent, gap


def nearer(a: DetectedObject, b: DetectedObject, distance: float) -> bool:
    """Tell whether the gap between two objects seen from above is less than a distance, metres.

    Among many things most are so far away that the circles around both say so.
    """
    one, other = extent(a), extent(b)
    if math.hypot(one.x - other.x, one.y - other.y) - one.radius - other.radius >= distance:
        return False
    return gap(a, b) < distance
