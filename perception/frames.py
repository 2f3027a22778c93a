"""All frames of one look, each cut into segments, with the robot masked out, and the table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.perception.frame import Image, Mask, PointCloudFrame, TablePrior, as_image
from robosandbox.perception.segments import Segment, find_segments, segment_of
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.types import Array
from robosandbox.values import frozen

# Number of pixels from one to the next of which the bare table is noted. Chosen so that light is still measured near things.
BARE_STRIDE = 4
_ON_TABLE = 2.0 * TOLERANCES.depth  # Metres from the table's height within which a point is on it.
_FROM_EDGE = 0.005  # Metres from the table's edge within which its light is not measured. Chosen.
_TABLE_HUE = 0.15  # Difference of shares of the channels, summed, up to which a pixel has the table's colour. Chosen.


@frozen(eq=False)
class SegmentedFrame:
    """One camera's frame, cut into segments, with the robot masked out.

    Attributes:
        frame: What it shows.
        robot: Where the robot is, (height, width).
        robot_near: How near its nearest part is there, metres.
        pieces: Which of `segments` each pixel belongs to, counted from 1; 0 for none.
        bare: Where nothing but the table is seen, of every `BARE_STRIDE`th row and column.
        segments: What stands out of the table.
        made: What was made of it, for those who would make the same again; of no other frame, a divided one included.
    """

    frame: PointCloudFrame
    robot: Mask
    robot_near: Image
    pieces: NDArray[np.int16]
    bare: Mask
    segments: tuple[Segment, ...]
    made: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    def beyond(self, points: Array) -> Array:
        """Return how far behind each point (n, 3) of the world the frame sees, (n,), metres; NaN where it does not tell.

        It does not tell of what is out of the picture, has no depth there, or has the robot before it. A pixel sees no farther than
        those around it: beside an outline it may show what is behind.
        """
        pixels, depths = self.frame.project(points)
        height, width = self.frame.depth.shape
        inside = (depths > 0.0) & (pixels >= -0.5).all(axis=1) & (pixels < [width - 0.5, height - 0.5]).all(axis=1)
        columns, rows = np.rint(pixels[inside]).astype(int).T
        clear = self.frame.valid[rows, columns] & ~self.robot[rows, columns]
        found = np.full(len(points), np.nan)
        found[inside] = np.where(clear, self._nearest[rows, columns] - depths[inside], np.nan)
        return found

    @property
    def _nearest(self) -> Image:
        """The least depth of each pixel and those around it that have one, (height, width), metres."""
        if "nearest" not in self.made:
            depth = np.where(self.frame.valid, self.frame.depth, np.float32(np.inf))
            self.made["nearest"] = as_image(cv2.erode(depth, np.ones((3, 3), np.uint8)))
        found: Image = self.made["nearest"]
        return found

    def divided(self, whole: Segment, part: Segment) -> tuple[SegmentedFrame, Segment | None]:
        """Return the frame with a part of a segment as a segment of its own, and what is left of the segment, if that is enough.

        Args:
            whole: One of `segments`.
            part: Some of its pixels.
        """
        segments, pieces = list(self.segments), self.pieces.copy()
        segments.append(part)
        pieces[part.crop][part.mask] = len(segments)
        number = next(k for k, one in enumerate(segments) if one is whole)
        rest = whole.mask & (pieces[whole.crop] == number + 1)
        left = segment_of(self.frame, rest, rest, whole.box)
        if left is not None:
            segments[number] = left
        return replace(self, pieces=pieces, segments=tuple(segments)), left


def segment_frame(frame: PointCloudFrame, table: TablePrior, robot: Mask, robot_near: Image) -> SegmentedFrame:
    """Return a frame cut into the segments that stand out of the table."""
    return segmented_by(frame, table, robot, robot_near, tuple(find_segments(frame, table, robot, robot_near)))


def segmented_by(
    frame: PointCloudFrame, table: TablePrior, robot: Mask, robot_near: Image, segments: tuple[Segment, ...]
) -> SegmentedFrame:
    """Return a frame with these segments; arguments as for `segment_frame`."""
    pieces = np.zeros(frame.depth.shape, dtype=np.int16)
    for number, segment in enumerate(segments, start=1):
        pieces[segment.crop][segment.mask] = number
    return SegmentedFrame(frame, robot, robot_near, pieces, _bare(frame, table, robot | (pieces > 0)), segments)


def _bare(frame: PointCloudFrame, table: TablePrior, tags_removed: Mask) -> Mask:
    """Return where nothing but the table is seen, by place and hue; a bin's floor lies hardly higher than the table."""
    some = np.s_[::BARE_STRIDE, ::BARE_STRIDE]
    bare = frame.valid[some] & ~tags_removed[some]
    x, y, z = (plane[some] for plane in frame.xyz)
    bare &= np.abs(z - np.float32(table.height)) < max(_ON_TABLE, 2.0 * frame.noise)
    bare &= table.within(x, y, _FROM_EDGE)
    red, green, blue = (channel[some].astype(np.float32) for channel in cv2.split(frame.rgb))
    total = np.maximum(red + green + blue, 1.0)
    r, g, b = np.array(table.rgb, dtype=np.float32) / np.float32(sum(table.rgb))
    off = np.abs(red - r * total) + np.abs(green - g * total) + np.abs(blue - b * total)
    return np.asarray(bare & (off < _TABLE_HUE * total))


@frozen(eq=False)
class FrameSet:
    """Frames of all cameras.

    Attributes:
        looks: By camera.
        table: What is known of it.
    """

    by_camera: Mapping[str, SegmentedFrame]
    table: TablePrior
