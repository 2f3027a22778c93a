"""The measures of objects made of parts, in the frame of their pose: what a world builds and what skills reach for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from robosandbox.types import CONTAINER_WALL, Array, frozen_array

SLIDE_CLEARANCE = 0.001
GRIP_WIDTH = 0.014
_GRIP_STAND_OFF = 0.04
_GRIP_HEIGHT = 0.03
_GRIP_LEVEL = 0.6


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawerShape:
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
    def of(cls, size: tuple[float, ...]) -> Self:
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
