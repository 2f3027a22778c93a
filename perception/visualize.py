"""A picture of what perception saw: outlines, hulls, axes, names and confidences, a panel for each camera."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.perception.frames import FrameSet, SegmentedFrame
from robosandbox.perception.tags import Tag
from robosandbox.perception.thing import Thing
from robosandbox.types import Array, DetectedObject
from robosandbox.world.relations import support

# Channels of x, y and z, of 255 levels: red, green and blue as in robot viewers.
_AXES = ((230, 40, 40), (30, 170, 40), (50, 80, 250))
_HULL = (255, 255, 255)  # White, channels of 255 levels. Chosen.
_TAG = (120, 255, 120)  # Light green, channels of 255 levels. Chosen: no bundled object has it.
_ROBOT = np.array([90, 90, 160], dtype=np.float32)
_AXIS_LENGTH = 0.04  # Metres. Chosen about as long as a cube.


class Shown(Protocol):
    """Something as it is believed to be, and whether the last look did not show it."""

    @property
    def hidden(self) -> bool:
        """Whether the last look did not show it."""
        ...

    def detected(self) -> DetectedObject:
        """Return it in the planner's words."""
        ...


def draw(
    frames: FrameSet, things: Sequence[Thing], tracks: Sequence[Shown], tags: Sequence[Tag] = ()
) -> NDArray[np.uint8]:
    """Return the last look, its cameras side by side, (height, width, 3) uint8 RGB.

    Args:
        frames: The views; without any the picture is grey.
        things: What the look showed; their pieces are tinted.
        tracks: What is known; their hulls, axes and names are drawn, hidden ones dashed.
        tags: Which were seen; they are painted over in the views, and outlined here with their numbers.
    """
    panels = [_panel(segmented, things, tracks, tags) for segmented in frames.by_camera.values()]
    return np.hstack(panels) if panels else np.full((480, 640, 3), 128, dtype=np.uint8)


def _panel(
    segmented: SegmentedFrame, things: Sequence[Thing], tracks: Sequence[Shown], tags: Sequence[Tag]
) -> NDArray[np.uint8]:
    canvas = segmented.frame.rgb.astype(np.float32)
    canvas[segmented.robot] = 0.6 * canvas[segmented.robot] + 0.4 * _ROBOT
    picture = np.ascontiguousarray(canvas.astype(np.uint8))
    for thing in things:
        for segment in thing.group.segments:
            if segment.frame.camera == segmented.frame.camera:
                contours, _ = cv2.findContours(segment.mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
                cv2.drawContours(picture, contours, -1, (255, 220, 0), 1, offset=segment.box[:2])
    for tag in tags:
        _draw_tag(picture, segmented, tag)
    for track in tracks:
        _draw_track(picture, segmented, track)
    cv2.putText(
        picture, segmented.frame.camera, (8, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (255, 255, 255), 2, cv2.LINE_AA
    )
    return picture


def _draw_tag(picture: NDArray[np.uint8], segmented: SegmentedFrame, tag: Tag) -> None:
    """Outline a tag and write its number into it, in the view that showed it best."""
    if segmented.frame.camera != tag.camera:
        return
    pixels, _ = segmented.frame.project(tag.corners)
    cv2.polylines(picture, [np.rint(pixels * 8).astype(np.int32)], True, _TAG, 1, cv2.LINE_AA, 3)
    text = "?" if tag.number is None else str(tag.number)
    x, y = pixels.mean(axis=0)
    at = (int(x) - 4 * len(text), int(y) + 4)
    cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.4, (0, 0, 0), 3, cv2.LINE_AA)
    cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.4, _TAG, 1, cv2.LINE_AA)


def _draw_track(picture: NDArray[np.uint8], segmented: SegmentedFrame, track: Shown) -> None:
    item = track.detected()
    hull, depth = segmented.frame.project(_hull(item))
    height, width = picture.shape[:2]
    if (depth < 0.03).any() or (hull.max(axis=0) < 0).any() or (hull.min(axis=0) > [width, height]).any():
        return
    outline = cv2.convexHull(hull.astype(np.float32)).reshape(-1, 2)
    if track.hidden:
        for point in outline[::2]:
            cv2.circle(picture, (int(point[0]), int(point[1])), 1, _HULL, -1)
    else:
        cv2.polylines(picture, [np.rint(outline * 8).astype(np.int32)], True, _HULL, 1, cv2.LINE_AA, 3)
    origin = item.pose.position
    ends, _ = segmented.frame.project(np.vstack([origin, origin + _AXIS_LENGTH * item.pose.rotation.T]))
    start = (int(ends[0][0]), int(ends[0][1]))
    for end, colour in zip(ends[1:], _AXES, strict=True):
        cv2.line(picture, start, (int(end[0]), int(end[1])), colour, 1, cv2.LINE_AA)
    text = f"{item.id} {100.0 * item.confidence:.0f}%{' hidden' if track.hidden else ''}"
    at = (
        int(np.clip(outline[:, 0].min(), 2, width - 9 * len(text))),
        int(np.clip(outline[:, 1].min() - 5, 34, height - 4)),
    )
    cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.42, (0, 0, 0), 3, cv2.LINE_AA)
    cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.42, (255, 255, 255), 1, cv2.LINE_AA)


def _hull(item: DetectedObject) -> Array:
    """Return points of the object's hull, (n, 3)."""
    rng = np.random.default_rng(0)
    rays = rng.standard_normal((160, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    directions = np.vstack([rays, item.pose.rotation.T, -item.pose.rotation.T])
    from robosandbox.world.relations import centre

    middle = centre(item)
    reach = support(item, directions) - directions @ middle
    slopes = np.maximum(directions @ rays.T, 1e-9)
    points: Array = middle + rays * (reach[:, None] / slopes).min(axis=0)[:, None]
    return points
