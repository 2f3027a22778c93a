"""All that one look gives: the views, where the robot is in each, and the table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robosandbox.perception.segments import Segment, find_segments, segment_of
from robosandbox.perception.view import Image, Mask, Table, View


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One camera's view and the robot in it.

    Attributes:
        view: What it shows.
        robot: Where the robot is, (height, width).
        robot_near: How near its nearest part is there, metres.
        pieces: Which of `segments` each pixel belongs to, counted from 1; 0 for none.
        segments: What stands out of the table.
    """

    view: View
    robot: Mask
    robot_near: Image
    pieces: NDArray[np.int16]
    segments: tuple[Segment, ...]

    def divided(self, whole: Segment, part: Segment) -> tuple[Look, Segment | None]:
        """Return the look with a part of a piece as a piece of its own, and what is left of the piece, if that is enough.

        Args:
            whole: One of `segments`.
            part: Some of its pixels.
        """
        segments, pieces = list(self.segments), self.pieces.copy()
        segments.append(part)
        pieces[_crop(part)][part.mask] = len(segments)
        number = next(k for k, one in enumerate(segments) if one is whole)
        rest = whole.mask & (pieces[_crop(whole)] == number + 1)
        left = segment_of(self.view, rest, rest, whole.box)
        if left is not None:
            segments[number] = left
        return replace(self, pieces=pieces, segments=tuple(segments)), left


def _crop(segment: Segment) -> tuple[slice, slice]:
    left, top, right, bottom = segment.box
    return slice(top, bottom), slice(left, right)


def take_look(view: View, table: Table, robot: Mask, robot_near: Image) -> Look:
    """Return a view with what stands out of the table in it."""
    segments = tuple(find_segments(view, table, robot, robot_near))
    pieces = np.zeros(view.depth.shape, dtype=np.int16)
    for number, segment in enumerate(segments, start=1):
        left, top, right, bottom = segment.box
        pieces[top:bottom, left:right][segment.mask] = number
    return Look(view, robot, robot_near, pieces, segments)


@dataclass(frozen=True, slots=True, eq=False)
class Scenery:
    """What all cameras show.

    Attributes:
        looks: By camera.
        table: What is known of it.
    """

    looks: Mapping[str, Look]
    table: Table
