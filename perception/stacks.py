"""One thing on another of its colour: cut at the height where the lower one's top shows."""

from __future__ import annotations

import cv2
import numpy as np

from robosandbox.perception.groups import Group
from robosandbox.perception.scenery import Scenery
from robosandbox.perception.segments import Segment, segment_of
from robosandbox.perception.view import Mask

_BIN = 0.004
_ENDS = 0.012
_MOST_LEDGES = 3
_ABOVE = 0.004


def ledges(members: Group) -> list[float]:
    """Return the heights between its bottom and its top at which most of a group's points lie, metres."""
    low, high = members.bounds[0][2] + _ENDS, members.bounds[1][2] - _ENDS
    if high <= low:
        return []
    counts, edges = np.histogram(members.points[:, 2], bins=max(int((high - low) / _BIN), 1), range=(low, high))
    best = np.argsort(-counts, kind="stable")[:_MOST_LEDGES]
    return [float(edges[k] + _BIN / 2.0 + _ABOVE) for k in best]


def cut_at(members: Group, height: float, scenery: Scenery) -> tuple[tuple[Group | None, Group | None], Scenery]:
    """Return what of a group lies lower and higher than a height, None for nothing, and the scenery with the pieces cut."""
    looks = dict(scenery.looks)
    lower: list[Segment] = []
    upper: list[Segment] = []
    for segment in members.segments:
        look = looks[segment.view.camera]
        high = _over(segment, height)
        part = segment_of(segment.view, high, high, segment.box)
        if part is None:
            lower.append(segment)
        elif (high == segment.mask).all():
            upper.append(segment)
        else:
            looks[segment.view.camera], rest = look.divided(segment, part)
            upper.append(part)
            if rest is not None:
                lower.append(rest)
    found = (Group(tuple(lower)) if lower else None, Group(tuple(upper)) if upper else None)
    return found, Scenery(looks, scenery.table)


def _over(segment: Segment, height: float) -> Mask:
    """Return a piece's pixels over a height; where depth is missing the nearest pixels with depth decide."""
    left, top, right, bottom = segment.box
    sure = segment.mask & segment.view.valid[top:bottom, left:right]
    high = sure & (segment.view.xyz[2, top:bottom, left:right] > height)
    to_high, to_low = (
        cv2.distanceTransform((~pixels).astype(np.uint8), cv2.DIST_L2, 3) for pixels in (high, sure & ~high)
    )
    return np.asarray(segment.mask & (to_high < to_low))
