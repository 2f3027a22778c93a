"""Groups of pieces that are one thing: in the same place and of the same colour, and never two solid things in one place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product
from math import dist

import numpy as np
from scipy.spatial import KDTree

from robosandbox.perception.fit import Fit
from robosandbox.perception.frame import Image
from robosandbox.perception.frames import FrameSet, SegmentedFrame
from robosandbox.perception.quantiles import percentiles
from robosandbox.perception.segments import Segment
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.types import Array

_SAME_PLACE = 4.0 * TOLERANCES.position  # Metres between points of two views that are of the same place.
# Share of the points of one view that lie near those of another, of one thing. Chosen: two cameras share little of its
# surface.
_LEAST_SHARE = 0.12
_SAME_CHROMA = 0.06  # Distance of shares of red and green up to which two views show one colour. Chosen.
# What noise adds to it times the sum of the channels (0 to 765): a dark pixel's share says little. Chosen.
_CHROMA_NOISE = 5.0
# Share of the light on a thing's brightest face that its darkest gets at least. Chosen below a half of `SIDE_LIGHT`.
_LEAST_LIGHT = 0.28
# Difference of brightness, of 765 levels, up to which dark colours are alike, because on black nobody can tell. Chosen.
_BLACK = 90.0
_AT_IT = 3.0 * TOLERANCES.position  # Metres from a shape within which it explains a point.
MOST_OF_IT = 0.6  # Share of points that are most of a group. Chosen.
# Metres between two groups that may be one thing with something before it. Chosen: a finger or a cube hides as much.
_APART = 0.06
_STEPS = 24  # Number of points between two pieces at which the frame is looked at. Chosen.
_NEARER = 0.004  # Metres by which something must be nearer to hide what is between. Chosen above the depth noise.


@dataclass(frozen=True, eq=False)
class Group:
    """The pieces of one thing.

    Attributes:
        segments: One or more of each view that shows it.
    """

    segments: tuple[Segment, ...]

    @cached_property
    def points(self) -> Array:
        """Its surface points in the world, (n, 3)."""
        return np.vstack([segment.points for segment in self.segments])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """The corners (3,), (3,) of its points' box, single outliers left out."""
        low, high = percentiles(self.points, [1.0, 99.0])
        return low, high

    def views(self, frames: FrameSet) -> Iterator[tuple[SegmentedFrame, list[Segment], Array]]:
        """Yield each frame that shows it, with its pieces there and their points in the world, (n, 3)."""
        for camera, segmented in frames.by_camera.items():
            own = [segment for segment in self.segments if segment.frame.camera == camera]
            if own:
                yield segmented, own, np.vstack([segment.points for segment in own])


def group(segments: list[Segment]) -> list[Group]:
    """Return the segments of all views in groups, one for each thing."""
    parent = list(range(len(segments)))

    def root(index: int) -> int:
        while parent[index] != index:
            index = parent[index]
        return index

    trees: dict[int, KDTree] = {}

    def tree(index: int) -> KDTree:
        if index not in trees:
            trees[index] = KDTree(segments[index].points)
        return trees[index]

    boxes = [(segment.points.min(axis=0) - _SAME_PLACE, segment.points.max(axis=0)) for segment in segments]
    for first, second in combinations(range(len(segments)), 2):
        a, b = segments[first], segments[second]
        if a.frame is b.frame or root(first) == root(second):
            continue
        (low_a, high_a), (low_b, high_b) = boxes[first], boxes[second]
        if (low_a > high_b).any() or (low_b > high_a).any() or not alike(a, b):
            continue
        if _overlap(tree(first), tree(second)):
            parent[root(first)] = root(second)
    groups: dict[int, list[Segment]] = {}
    for index, segment in enumerate(segments):
        groups.setdefault(root(index), []).append(segment)
    return [Group(tuple(members)) for members in groups.values()]


def alike(a: Segment, b: Segment) -> bool:
    """Tell whether two pieces may have the same colour, in whatever light."""
    dark, light = sorted((max(sum(map(float, a.rgb)), 1.0), sum(map(float, b.rgb))))
    if dist(a.chroma, b.chroma) > _SAME_CHROMA + _CHROMA_NOISE / dark:
        return False
    return dark > _LEAST_LIGHT * light or light - dark < _BLACK


def _overlap(a: KDTree, b: KDTree) -> bool:
    """Tell whether enough of one's points lie near the other."""
    for one, other in ((a, b), (b, a)):
        distance, _ = other.query(one.data, distance_upper_bound=_SAME_PLACE)
        if np.count_nonzero(np.isfinite(distance)) > _LEAST_SHARE * len(distance):
            return True
    return False


def same_colour(a: Group, b: Group) -> bool:
    """Tell whether two groups may have the same colour."""
    return any(alike(one, other) for one, other in product(a.segments, b.segments))


def explains(known: Fit, members: Group, within: float = _AT_IT) -> bool:
    """Tell whether most of a group's points are in a fitted shape or so near to it, metres."""
    return float((known.distances(members.points) < within).mean()) > MOST_OF_IT


def may_be_one(a: Group, b: Group, frames: FrameSet) -> bool:
    """Tell whether two groups near one another may be of one thing: no view shows both without something before the gap."""
    (low_a, high_a), (low_b, high_b) = a.bounds, b.bounds
    if (low_a - _APART > high_b).any() or (low_b - _APART > high_a).any():
        return False
    return all(
        any(_hidden_between(one, other, segmented) for one, other in product(first, second))
        for segmented in frames.by_camera.values()
        if (first := [each for each in a.segments if each.frame is segmented.frame])
        and (second := [each for each in b.segments if each.frame is segmented.frame])
    )


def _hidden_between(a: Segment, b: Segment, segmented: SegmentedFrame) -> bool:
    """Tell whether all that lies between two pieces in the picture is something nearer than they are."""
    start, end = _middle(a), _middle(b)
    columns, rows = np.rint(start + np.linspace(0.0, 1.0, _STEPS)[:, None] * (end - start)).astype(int).T
    own = [k for k, one in enumerate(segmented.segments, start=1) if one is a or one is b]
    between = ~np.isin(segmented.pieces[rows, columns], own)
    if not between.any():
        return False
    depth = segmented.frame.depth
    near = min(_median_depth(one, depth) for one in (a, b)) - _NEARER
    hidden = (segmented.pieces[rows, columns] > 0) & (depth[rows, columns] < near) | segmented.robot[rows, columns]
    return bool(hidden[between].mean() > MOST_OF_IT)


def _middle(segment: Segment) -> Array:
    rows, columns = np.nonzero(segment.mask)
    return np.array([columns.mean() + segment.box[0], rows.mean() + segment.box[1]])


def _median_depth(segment: Segment, depth: Image) -> float:
    values = depth[segment.crop][segment.mask]
    return float(np.median(values[values > 0.0])) if (values > 0.0).any() else 0.0
