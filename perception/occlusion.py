"""Occlusion of containers: contents that are seen where they lay before tell that their container has not moved."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from robosandbox.perception.fit import Fit
from robosandbox.perception.thing import Thing
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.perception.track import Track
from robosandbox.shapes import CONTAINER_WALL
from robosandbox.types import Array

_STAYED = 2.5 * TOLERANCES.position  # Metres that a thing may seem to move and have stayed.
_INTO_THE_WALL = 0.006  # Metres that contents may reach into a wall that is seen amiss. Chosen: one wall and a half.


def lies_in(place: Array, hull: Fit) -> bool:
    """Tell whether a place (3,) is within a container's outer hull, seen from above."""
    return _reach(place, hull) < 0.0


def is_its_contents(track: Track, thing: Thing, pairs: Iterable[tuple[Track, Thing]]) -> bool:
    """Tell whether a known container, where a look shows it, would have a wall in what lies in it, which has not moved.

    Args:
        track: The container as it is known.
        thing: What a look shows of it.
        pairs: What else is known, each with what the same look shows of it.
    """
    hollow = thing.kind == track.thing.kind and thing.shape.is_open_container
    if not hollow or track.confidence <= TOLERANCES.seen:
        return False
    for other, seen in pairs:
        before, now = other.thing.fit.centre, seen.fit.centre
        if other is track or not lies_in(before, track.thing.fit) or float(np.linalg.norm(now - before)) > _STAYED:
            continue
        radius = float(seen.fit.sizes[:2].min()) if seen.fit.shape == "box" else float(seen.fit.sizes[0])
        room = radius + CONTAINER_WALL
        deeper = _reach(now, thing.fit) + room - max(_reach(before, track.thing.fit) + room, 0.0)
        if deeper > _INTO_THE_WALL and _reach(now, thing.fit) + room > _INTO_THE_WALL:
            return True
    return False


def _reach(place: Array, hull: Fit) -> float:
    """Return how far a place (3,) is outside of a hull seen from above, metres; below 0 within."""
    local = hull.axes.T @ (place - hull.centre)
    if hull.shape == "box":
        return float((np.abs(local[:2]) - hull.sizes[:2]).max())
    return float(np.hypot(local[0], local[1]) - hull.sizes[0])
