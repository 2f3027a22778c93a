"""One thing on another of about its colour: cut where the lower one's top shows, or where the colour changes most."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from robosandbox.perception.frame import Mask
from robosandbox.perception.frames import FrameSet
from robosandbox.perception.groups import Group
from robosandbox.perception.segments import Segment, segment_of
from robosandbox.types import Array

Parts = tuple[Group | None, Group | None]

_BIN = 0.004  # Metres of height in which points are counted. Chosen: the step of `realsense` at its distance is less.
_ENDS = 0.012  # Metres from top and bottom within which nothing is cut. Chosen: half of the lowest thing.
_MOST_LEDGES = 2
_ABOVE = 0.004  # Metres over a ledge at which it is cut, because edges are ragged. Chosen.


def ledges(members: Group) -> list[float]:
    """Return heights at which a group may be cut: where its colour changes most, and over where most of its points lie.

    The change of colour is told by the variance between the parts (Otsu, A Threshold Selection Method from Gray-Level
    Histograms, 1979).
    """
    low, high = members.bounds[0][2] + _ENDS, members.bounds[1][2] - _ENDS
    if high <= low + 2.0 * _BIN:
        return []
    counts, edges = np.histogram(members.points[:, 2], bins=max(int((high - low) / _BIN), 1), range=(low, high))
    best = np.argsort(-counts, kind="stable")[:_MOST_LEDGES]
    return [_change(members, edges[1:-1]), *(float(edges[k] + _BIN / 2.0 + _ABOVE) for k in best)]


def _change(members: Group, heights: Array) -> float:
    height = members.points[:, 2]
    colours = np.vstack([segment.colours for segment in members.segments])
    middle = colours.mean(axis=0)
    below = [colours[height < each] for each in heights]
    shares = [len(part) / len(colours) for part in below]
    spread = [
        s * float(((p.mean(axis=0) - middle) ** 2).sum()) / (1.0 - s) if 0.0 < s < 1.0 else 0.0
        for s, p in zip(shares, below, strict=True)
    ]
    return float(heights[int(np.argmax(spread))])


def cut_at(members: Group, height: float, frames: FrameSet) -> tuple[Parts, FrameSet]:
    """Return what of a group lies lower and higher than a height, and the frames with the pieces cut."""
    return cut(members, lambda points: points[:, 2] > height, frames)


def cut(members: Group, chosen: Callable[[Array], Mask], frames: FrameSet) -> tuple[Parts, FrameSet]:
    """Return what of a group is not of a part and what is, None for nothing, and the frames with the pieces cut.

    Args:
        members: The group.
        chosen: Tells which points (n, 3) of the world are of the part, (n,).
        frames: Where it is seen.
    """
    by_camera = dict(frames.by_camera)
    others: list[Segment] = []
    part: list[Segment] = []
    for segment in members.segments:
        segmented = by_camera[segment.frame.camera]
        mask = _of_part(segment, chosen)
        piece = segment_of(segment.frame, mask, mask, segment.box)
        if piece is None:
            others.append(segment)
        elif (mask == segment.mask).all():
            part.append(segment)
        else:
            by_camera[segment.frame.camera], rest = segmented.divided(segment, piece)
            part.append(piece)
            if rest is not None:
                others.append(rest)
    found = (Group(tuple(others)) if others else None, Group(tuple(part)) if part else None)
    return found, FrameSet(by_camera, frames.table)


def _of_part(segment: Segment, chosen: Callable[[Array], Mask]) -> Mask:
    """Return a piece's pixels of a part; where depth is missing the nearest pixels with depth decide."""
    sure = segment.mask & segment.frame.valid[segment.crop]
    part = np.zeros_like(sure)
    part[sure] = chosen(segment.frame.xyz[:, *segment.crop][:, sure].T.astype(np.float64))
    to_part, to_rest = (
        cv2.distanceTransform((~pixels).astype(np.uint8), cv2.DIST_L2, 3) for pixels in (part, sure & ~part)
    )
    return np.asarray(segment.mask & (to_part < to_rest))
