"""Drawers: a cabinet, a box that slides in it, and a grip to pull it by."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np

from robosandbox.shapes.body import Body, PartJoint, Piece, Rgba, Slide, share_mass
from robosandbox.shapes.container import box_piece
from robosandbox.shapes.hull import BoxHull
from robosandbox.shapes.room import CONTAINER_WALL, Room
from robosandbox.shapes.shape import Shape, Size, Solid, Written
from robosandbox.spatial import Array, Vec3, frozen_array
from robosandbox.values import frozen

# Width, depth and height, metres, at the least. Chosen: walls of cabinet and box, and something between.
LEAST_DRAWER = 0.03
SLIDE_CLEARANCE = 0.001  # Play of the sliding box on every side, metres. Chosen.
# Width and thickness of the grip, a bar, metres. Chosen: fits between the fingers of the arms in docs/arms.md.
GRIP_WIDTH = 0.014
# Distance of the grip's middle before the front, metres. Chosen with room for a finger behind it.
_GRIP_STAND_OFF = 0.04
_GRIP_HEIGHT = 0.03  # Height of the grip, metres. Chosen.
_GRIP_LEVEL = 0.6  # Height of its middle as a share of the cabinet's. Chosen.
_FRICTION_LOSS = 2.0  # Newtons that a pull takes. Chosen as of a wooden drawer on waxed runners.
_DAMPING = 8.0  # Newtons per m/s, so that it does not glide on. Chosen.
_LOCK_PLAY = 0.0003  # Play of a locked box, metres. Chosen.
_BOX_SHARE = 0.35  # The sliding box's share of the mass. Chosen.
_GRIP_SHARE = 0.05  # The grip's share of the box's mass. Chosen.
_GRIP_COLOUR: Rgba = (0.32, 0.32, 0.34, 1.0)  # Dark grey, each channel a fraction. Chosen.
_BOX_SHADE = 0.82  # Ratio of the box's colour channels to the cabinet's. Chosen so that people see where it opens.


@frozen(kw_only=True)
class DrawerParts:
    """A drawer's parts when it is closed; opening moves box and grip by that much towards local -x.

    The grip is a bar that stands upright before the front, as thick as it is wide, on a thinner arm.

    Attributes:
        cabinet: Half-extents of the cabinet (3,); its bottom face's middle is the origin.
        box: Outer half-extents of the sliding box (3,).
        box_centre: Its middle, shape (3,).
        grip: Half-extents of the grip (3,).
        grip_centre: Its middle, shape (3,).
        max_open: How far it slides, metres.
    """

    cabinet: Array
    box: Array
    box_centre: Array
    grip: Array
    grip_centre: Array
    max_open: float

    @classmethod
    def of(cls, size: Size) -> Self:
        """Return the parts of a drawer of size (width, depth, height, max_open), metres."""
        width, depth, height, max_open = size
        wall, clearance = CONTAINER_WALL, SLIDE_CLEARANCE
        cabinet = np.array([depth, width, height]) / 2.0
        box = cabinet - np.array([(wall + clearance) / 2.0, wall + clearance, wall + clearance])
        grip = np.array([GRIP_WIDTH, GRIP_WIDTH, min(_GRIP_HEIGHT, 0.6 * height)]) / 2.0
        return cls(
            cabinet=frozen_array(cabinet),
            box=frozen_array(box),
            box_centre=frozen_array([-(wall + clearance) / 2.0, 0.0, height / 2.0]),
            grip=frozen_array(grip),
            grip_centre=frozen_array([-depth / 2.0 - _GRIP_STAND_OFF, 0.0, _GRIP_LEVEL * height]),
            max_open=max_open,
        )

    @property
    def inner(self) -> Array:
        """Half-extents (2,) of the sliding box's inside along x and y."""
        room: Array = self.box[:2] - CONTAINER_WALL
        return room

    @property
    def floor(self) -> float:
        """Height of the sliding box's floor over the origin."""
        return float(self.box_centre[2] - self.box[2]) + CONTAINER_WALL

    @property
    def rim(self) -> float:
        """Height of the sliding box's rim over the origin."""
        return float(self.box_centre[2] + self.box[2])


class Drawer(Shape):
    """A drawer in its cabinet, depth along local x, width along y; its pose is the middle of the cabinet's bottom face.

    Width, depth and height are the cabinet's outer ones. It opens towards local -x.
    """

    kind = "drawer"
    size_fields = ("width", "depth", "height", "max_open")
    nouns = ("drawer",)
    options = frozenset({"open", "locked"})
    holds_things = True
    opens = True
    stays_put = True
    flat_top = False
    looks_like = frozenset({"box", "bin"})

    def check(self, size: Size) -> None:
        """Check that there is room between its walls.

        Raises:
            ValueError: There is none.
        """
        if min(size[:3]) < LEAST_DRAWER:
            raise ValueError(
                f"size: {min(size[:3]):g} leaves no room between a drawer's walls; at least {LEAST_DRAWER:g} m each way"
            )

    def hull(self, size: Size) -> BoxHull:
        """Return the cabinet."""
        width, depth, height, _ = size
        return BoxHull((depth / 2.0, width / 2.0, height / 2.0))

    def max_open(self, size: Size) -> float:
        """Return how far it opens, metres."""
        return size[3]

    def joint(self, solid: Solid) -> PartJoint:
        """Return the slide of its box."""
        x, y, z = (float(value) for value in -solid.pose.rotation[:, 0])
        return PartJoint(kind="slide", axis=(x, y, z), anchor=solid.pose.xyz, low=0.0, high=solid.size[3])

    def handles(self, solid: Solid) -> tuple[Piece, ...]:
        """Return its grip: the walls of its box are thin, and a camera sees only their outside."""
        parts = DrawerParts.of(solid.size)
        x, y, z = (float(value) for value in parts.grip_centre)
        half = (float(parts.grip[0]), float(parts.grip[1]), float(parts.grip[2]))
        return (Piece(hull=BoxHull(half), centre=(x - (solid.opening or 0.0), y, z)),)

    def centre(self, solid: Solid) -> Array:
        """Return the middle of the cabinet in the world, metres, shape (3,)."""
        middle: Array = solid.pose.position + solid.pose.rotation[:, 2] * (solid.size[2] / 2.0)
        return middle

    def support(self, solid: Solid, directions: Array) -> Array:
        """Return how far it reaches, open as far as it is, its grip included; metres, shape (n,)."""
        local = directions @ solid.pose.rotation
        extent = self.hull(solid.size).support(local)
        if solid.opening is not None:
            parts = DrawerParts.of(solid.size)
            offset = np.array([-solid.opening, 0.0, -solid.size[2] / 2.0])
            for middle, half in ((parts.box_centre, parts.box), (parts.grip_centre, parts.grip)):
                extent = np.maximum(extent, local @ (middle + offset) + np.abs(local) @ half)
        reach: Array = directions @ self.centre(solid) + extent
        return reach

    def room(self, size: Size, opening: float | None = None) -> Room:
        """Return the inside of the sliding box, as far open as it is; closed where that is not known."""
        parts = DrawerParts.of(size)
        middle = parts.box_centre[:2] - [opening or 0.0, 0.0]
        return Room(middle=middle, half=parts.inner, floor=parts.floor, rim=parts.rim)

    def mouth(self, solid: Solid) -> Room:
        """Return the part of the inside that lies before the cabinet, where one can reach in from above."""
        room = self.room(solid.size, solid.opening)
        front, back = room.middle[0] - room.half[0], min(room.middle[0] + room.half[0], -solid.size[1] / 2.0)
        middle = np.array([(front + back) / 2.0, room.middle[1]])
        return Room(middle=middle, half=np.array([(back - front) / 2.0, room.half[1]]), floor=room.floor, rim=room.rim)

    def bodies(self, item: Written) -> tuple[Body, ...]:
        """Return the cabinet, and the box that slides in it."""
        parts = DrawerParts.of(item.size)
        low, high = (item.open, item.open + _LOCK_PLAY) if item.locked else (0.0, parts.max_open)
        slide = Slide(axis=(-1.0, 0.0, 0.0), low=low, high=high, friction=_FRICTION_LOSS, damping=_DAMPING)
        cabinet = share_mass(_cabinet(parts), (1.0 - _BOX_SHARE) * item.mass)
        return Body(pieces=cabinet), Body(suffix="/box", pieces=_box(parts, item), joint=slide)

    def describe(self, solid: Solid) -> str:
        """Return depth, width and height, and how far it is open, millimetres."""
        width, depth, height = (1e3 * value for value in solid.size[:3])
        opened = "" if solid.opening is None else f", open {1e3 * solid.opening:.0f}"
        return f"{depth:.0f} x {width:.0f} x {height:.0f}{opened}"


def _cabinet(parts: DrawerParts) -> Sequence[Piece]:
    x, y, z = parts.cabinet
    wall = CONTAINER_WALL / 2.0
    panels = [
        ((x, y, wall), (0.0, 0.0, wall)),
        ((x, y, wall), (0.0, 0.0, 2.0 * z - wall)),
        ((x, wall, z - 2.0 * wall), (0.0, y - wall, z)),
        ((x, wall, z - 2.0 * wall), (0.0, -y + wall, z)),
        ((wall, y - 2.0 * wall, z - 2.0 * wall), (x - wall, 0.0, z)),
    ]
    return [_panel(half, centre) for half, centre in panels]


def _box(parts: DrawerParts, item: Written) -> tuple[Piece, ...]:
    x, y, z = parts.box
    cx, _, cz = parts.box_centre
    wall = CONTAINER_WALL / 2.0
    level = cz + wall
    panels = [
        ((x, y, wall), (cx, 0.0, cz - z + wall)),
        ((wall, y, z - wall), (cx - x + wall, 0.0, level)),
        ((wall, y, z - wall), (cx + x - wall, 0.0, level)),
        ((x - 2.0 * wall, wall, z - wall), (cx, y - wall, level)),
        ((x - 2.0 * wall, wall, z - wall), (cx, -y + wall, level)),
    ]
    red, green, blue = (_BOX_SHADE * channel for channel in item.rgba[:3])
    shade = (red, green, blue, item.rgba[3])
    grip, centre = parts.grip, parts.grip_centre
    front = cx - x
    arm = (front - centre[0] - grip[0]) / 2.0
    handle = [
        (tuple(grip), tuple(centre)),
        ((arm, grip[1] / 2.0, grip[2] / 2.0), (front - arm, 0.0, float(centre[2] - grip[2] / 2.0))),
    ]
    share = _BOX_SHARE * item.mass
    return (
        *share_mass([_panel(half, at, shade) for half, at in panels], (1.0 - _GRIP_SHARE) * share),
        *share_mass([_panel(half, at, _GRIP_COLOUR) for half, at in handle], _GRIP_SHARE * share),
    )


def _panel(half: Sequence[float], centre: Sequence[float], rgba: Rgba | None = None) -> Piece:
    (a, b, c), (x, y, z) = half, centre
    extents: Vec3 = (float(a), float(b), float(c))
    piece = box_piece(extents, (float(x), float(y), float(z)))
    return piece if rgba is None else Piece(hull=piece.hull, centre=piece.centre, rgba=rgba)
