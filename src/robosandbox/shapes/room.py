"""The inside of what holds things: walls, floor and rim, in the frame of the object's pose."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from robosandbox.spatial import Array
from robosandbox.values import frozen

# Walls and floors of all containers, metres: as of household plastic and crockery.
CONTAINER_WALL = 0.004

_AROUND = 16  # Number of places around a round rim. Chosen.
# Places along each side of a square rim, shares of its half-length, the middle first. Chosen.
_ALONG = (0.0, 0.5, -0.5)


@frozen(kw_only=True)
class Room:
    """The inside of a container.

    Attributes:
        middle: Of the floor, x and y, metres, shape (2,).
        half: Half-extents along x and y, shape (2,); the radius twice where it is round.
        floor: Height of the floor, metres.
        rim: Height of the rim, metres.
        is_round: Whether its wall is a ring.
    """

    middle: Array
    half: Array
    floor: float
    rim: float
    is_round: bool = False

    def margin(self, point: Array) -> float:
        """Return how deep a point, x and y in the frame of the pose, lies within the walls, metres; negative outside."""
        if self.is_round:
            return float(self.half[0]) - math.hypot(point[0] - self.middle[0], point[1] - self.middle[1])
        return float(np.min(self.half - np.abs(point[:2] - self.middle)))

    def to_wall(self, direction: Array) -> float:
        """Return how far the wall is from the middle along a unit vector, x and y in the frame of the pose, metres."""
        if self.is_round:
            return float(self.half[0])
        return float(np.min(self.half / np.maximum(np.abs(direction[:2]), np.finfo(float).tiny)))

    @property
    def square(self) -> Array:
        """Half-extents (2,) of the largest rectangle in the plan of the inside, metres."""
        return self.half / np.sqrt(2.0) if self.is_round else self.half

    def rim_places(self) -> Iterator[tuple[Array, Array]]:
        """Yield points (3,) in the middle of the wall's top, and the outward directions there (3,)."""
        half_wall = CONTAINER_WALL / 2.0
        top = np.array([*self.middle, self.rim])
        if self.is_round:
            for angle in np.arange(_AROUND) * 2.0 * np.pi / _AROUND:
                outward = np.array([np.cos(angle), np.sin(angle), 0.0])
                yield (self.half[0] + half_wall) * outward + top, outward
            return
        for side in range(4):
            across, along = side % 2, 1 - side % 2
            outward, edge = np.zeros(3), np.zeros(3)
            outward[across] = 1.0 if side < 2 else -1.0
            edge[along] = self.half[along]
            for share in _ALONG:
                yield (self.half[across] + half_wall) * outward + share * edge + top, outward

    def lip(self, direction: Array) -> Array:
        """Return the outer point (3,) of the rim in a level direction, a unit vector in the frame of the pose."""
        if self.is_round:
            return np.array([*(self.middle + (self.half[0] + CONTAINER_WALL) * direction[:2]), self.rim])
        half = self.half + CONTAINER_WALL
        reach = float(np.min(half / np.maximum(np.abs(direction[:2]), 1e-9)))
        return np.array([*(self.middle + reach * direction[:2]), self.rim])
