"""Beads: many small balls that start in a container, cheap enough to be poured by the dozen."""

from __future__ import annotations

import math

import numpy as np

from robosandbox.shapes.body import Body, Contact, Free, Piece
from robosandbox.shapes.hull import SphereHull
from robosandbox.shapes.room import Room
from robosandbox.shapes.shape import Shape, Size, Solid, Written
from robosandbox.spatial import Array

_SPACING = 1.02  # Distance of neighbours at the start over their diameter, a ratio. Chosen so that none overlap.
_WALL_CLEARANCE = 0.0005  # Metres that beads keep off a wall at the start. Chosen.
# Time constant of contacts, seconds: two physics steps. Chosen because a bead that falls a hand's breadth must not sink
# through a thin floor.
_STIFF_SECONDS = 0.004
# Glides stop within about half a second; falling is hardly slowed.
_DRAG_SECONDS = 0.5


class Beads(Shape):
    """Many balls of one radius; their pose is the middle of them all, unturned, their mass that of all of them.

    Their contacts carry no friction: one row of the solver each in place of four. What keeps them from gliding on for
    ever is the air's drag.
    """

    kind = "beads"
    size_fields = ("radius",)
    nouns = ("beads",)
    is_plural = True
    options = frozenset({"count", "inside"})
    flat_top = False
    stays_put = True
    is_granular = True

    def hull(self, size: Size) -> SphereHull:
        """Return one bead."""
        return SphereHull((size[0],))

    def centre(self, solid: Solid) -> Array:
        """Return the middle of them all in the world, metres, shape (3,)."""
        return np.asarray(np.mean(solid.grains, axis=0), dtype=np.float64) if solid.grains else solid.pose.position

    def support(self, solid: Solid, directions: Array) -> Array:
        """Return how far the farthest bead reaches, metres, shape (n,)."""
        extent = np.full(len(directions), solid.size[0])
        if solid.grains:
            return np.asarray((directions @ np.array(solid.grains).T).max(axis=1) + extent, dtype=np.float64)
        return np.asarray(directions @ self.centre(solid) + extent, dtype=np.float64)

    def bodies(self, item: Written) -> tuple[Body, ...]:
        """Return a body for each bead."""
        mass = item.mass / item.count
        return tuple(
            Body(
                suffix=f"/{k}",
                pieces=(Piece(hull=self.hull(item.size), mass=mass),),
                joint=Free(drag=mass / _DRAG_SECONDS),
                contact=Contact(frictionless=True, stiffness_seconds=_STIFF_SECONDS),
            )
            for k in range(item.count)
        )

    def describe(self, solid: Solid) -> str:
        """Return how many there are, and their diameter in millimetres."""
        return f"{len(solid.grains)} of diameter {2e3 * solid.size[0]:.0f}"


def stacked(radius: float, count: int, room: Room) -> Array:
    """Return where beads start in a container: square layers, each shifted by a radius against the one below.

    Args:
        radius: Of a bead, metres.
        count: How many.
        room: The container's inside.

    Returns:
        Their middles in the frame of the container's pose, metres, shape (k, 3); fewer than `count` where it is full.
    """
    pitch = 2.0 * radius * _SPACING
    half = room.half - radius - _WALL_CLEARANCE
    steps = pitch * np.arange(-math.ceil(half.max() / pitch) - 1, math.ceil(half.max() / pitch) + 2)
    points: list[tuple[float, float, float]] = []
    z, layer = room.floor + radius, 0
    while len(points) < count and z + radius <= room.rim:
        level = steps + (layer % 2) * radius
        for x in level:
            for y in level:
                fits = math.hypot(x, y) <= half[0] if room.is_round else abs(x) <= half[0]
                if fits and abs(y) <= half[1]:
                    points.append((float(x), float(y), z))
        z, layer = z + pitch, layer + 1
    return np.array(points[:count]).reshape(-1, 3)
