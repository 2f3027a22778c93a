"""Open containers of real wall thickness; their pose is the middle of their bottom face."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from robosandbox.shapes.body import Body, Piece, share_mass
from robosandbox.shapes.hull import BoxHull, CylinderHull
from robosandbox.shapes.room import CONTAINER_WALL, Room
from robosandbox.shapes.shape import Shape, Size, Solid, Written
from robosandbox.spatial import Array, Vec3

# Number of flat pieces of a round wall. Chosen: at the seams it is up to 1.3 % of the radius thicker outside, and nowhere
# inside.
_RING_PIECES = 20
_WALL = CONTAINER_WALL / 2.0


class Container(Shape):
    """A kind with a floor, a wall all around and an open top."""

    holds_things = True
    pours = True
    flat_top = False

    def size_of_hull(self, hull: Sequence[float]) -> Size:
        """Return the inner measures and the height of the container with this outer hull."""
        return (*(value - CONTAINER_WALL for value in hull[:-1]), 2.0 * hull[-1])

    def extents(self, size: Size) -> Array:
        """Return the inner width and length and the height, the smallest first, metres, shape (3,)."""
        return np.sort(np.array([2.0 * size[0], 2.0 * size[-2], size[-1]]))

    def centre(self, solid: Solid) -> Array:
        """Return the middle of its height, in the world, metres, shape (3,)."""
        middle: Array = solid.pose.position + solid.pose.rotation[:, 2] * (solid.size[-1] / 2.0)
        return middle


class SquareContainer(Container):
    """An open container with four flat walls."""

    size_fields = ("inner_half_x", "inner_half_y", "height")

    def hull(self, size: Size) -> BoxHull:
        """Return the box around its walls."""
        return BoxHull((size[0] + CONTAINER_WALL, size[1] + CONTAINER_WALL, size[2] / 2.0))

    def room(self, size: Size, opening: float | None = None) -> Room:
        """Return its inside."""
        del opening
        return Room(middle=np.zeros(2), half=np.array(size[:2]), floor=CONTAINER_WALL, rim=size[2])

    def bodies(self, item: Written) -> tuple[Body, ...]:
        """Return its one body: a floor and four walls."""
        half_x, half_y, height = item.size
        outer_x, middle = half_x + CONTAINER_WALL, height / 2.0
        pieces = (
            box_piece((outer_x, half_y + CONTAINER_WALL, _WALL), (0.0, 0.0, _WALL)),
            box_piece((_WALL, half_y, middle - _WALL), (half_x + _WALL, 0.0, middle + _WALL)),
            box_piece((_WALL, half_y, middle - _WALL), (-half_x - _WALL, 0.0, middle + _WALL)),
            box_piece((outer_x, _WALL, middle - _WALL), (0.0, half_y + _WALL, middle + _WALL)),
            box_piece((outer_x, _WALL, middle - _WALL), (0.0, -half_y - _WALL, middle + _WALL)),
        )
        return (Body(pieces=share_mass(pieces, item.mass)),)

    def describe(self, solid: Solid) -> str:
        """Return inner width and length, and height, millimetres."""
        x, y, height = solid.size
        return f"{2e3 * x:.0f} x {2e3 * y:.0f} x {1e3 * height:.0f}"


class RoundContainer(Container):
    """An open container with a ring for a wall."""

    size_fields = ("inner_radius", "height")

    def hull(self, size: Size) -> CylinderHull:
        """Return the cylinder around its wall."""
        return CylinderHull((size[0] + CONTAINER_WALL, size[1] / 2.0))

    def extents(self, size: Size) -> Array:
        """Return the inner diameter twice and the height, the smallest first, metres, shape (3,)."""
        return np.sort(np.array([2.0 * size[0], 2.0 * size[0], size[1]]))

    def room(self, size: Size, opening: float | None = None) -> Room:
        """Return its inside."""
        del opening
        return Room(middle=np.zeros(2), half=np.full(2, size[0]), floor=CONTAINER_WALL, rim=size[1], is_round=True)

    def bodies(self, item: Written) -> tuple[Body, ...]:
        """Return its one body: a round floor, and the flat pieces of its wall, whose inner faces touch the inner radius."""
        radius, height = item.size
        outer = radius + CONTAINER_WALL
        floor = Piece(hull=CylinderHull((outer, _WALL)), centre=(0.0, 0.0, _WALL))
        half = (_WALL, outer * math.tan(math.pi / _RING_PIECES), height / 2.0 - _WALL)
        ring = []
        for k in range(_RING_PIECES):
            angle = 2.0 * math.pi * k / _RING_PIECES
            middle = radius + _WALL
            centre = (middle * math.cos(angle), middle * math.sin(angle), height / 2.0 + _WALL)
            ring.append(box_piece(half, centre, angle))
        return (Body(pieces=share_mass((floor, *ring), item.mass)),)

    def describe(self, solid: Solid) -> str:
        """Return inner diameter and height, millimetres."""
        return f"diameter {2e3 * solid.size[0]:.0f}, height {1e3 * solid.size[1]:.0f}"


def box_piece(half: Vec3, centre: Vec3, yaw: float = 0.0) -> Piece:
    """Return a box with these half-extents, metres, turned by `yaw` radians about z, with its middle at `centre`."""
    turn = (0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))
    return Piece(hull=BoxHull(half), centre=centre, quat_xyzw=turn)
