"""One thing on another of about its colour: cut where the lower one's top shows, or where the colour changes most."""

from __future__ import annotations

import cv2
import numpy as np

from robosandbox.perception.groups import Group
from robosandbox.perception.scenery import Scenery
from robosandbox.perception.segments import Segment, segment_of
from robosandbox.perception.view import Mask
from robosandbox.types import Array

_BIN = 0.004
_ENDS = 0.012
_MOST_LEDGES = 2
_ABOVE = 0.004


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
