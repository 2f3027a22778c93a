"""Drawers: a large box with a grip before the middle of one of its sides; what slides out of it lengthens the box."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robosandbox.perception.evidence import ShapeEvidence, SurfacePoints
from robosandbox.perception.fit import Fit, fit
from robosandbox.perception.frames import FrameSet
from robosandbox.perception.groups import Group
from robosandbox.perception.quantiles import percentiles
from robosandbox.perception.silhouette import Rows, tangents
from robosandbox.perception.support import Form
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.shapes.drawer import DrawerParts
from robosandbox.types import Array, Pose
from robosandbox.values import frozen

# Extent of a grip, metres, at the most: shapes/drawer.py's is 0.03 high on an arm of 0.04. Chosen with room for noise.
_LARGEST_GRIP = 0.065
_GRIP_OVER_TABLE = 0.012  # Metres over the table that a grip begins at least. Chosen: what stands on the table is none.
# Width and depth of a cabinet, metres, at the least. Chosen: twice `LEAST_DRAWER` of shapes/drawer.py.
_LEAST_SIDE = 0.06
_LEAST_HEIGHT = 0.03  # Height of a cabinet, metres, at the least: `LEAST_DRAWER` as of shapes/drawer.py.
# Least and largest distance of a grip before the front, metres: shapes/drawer.py's is 0.04. Chosen 0.025 to either side.
_STAND_OFF = (0.015, 0.065)
_MIDDLE = 0.018  # Metres by which a grip may be off the middle of the front. Chosen.
_WIDEST = 0.024  # Width of a grip, metres, at the most: shapes/drawer.py's is 0.014. Chosen with room for noise.
# Least and largest height of a grip as a share of the cabinet's: shapes/drawer.py's is 0.6. Chosen 0.25 to either side.
_LEVELS = (0.35, 0.85)
# Cost of the poorest fit of a box that is a cabinet (units: mean squared residual over standard deviation). Chosen.
_POOREST = 1.0
_TOP = 4.0 * TOLERANCES.depth  # Metres below the highest points that count as the top.
_FROM_SIDES = 0.02  # Metres from the sides within which the top is looked along, because edges are ragged. Chosen.
_BIN = 0.006  # Metres along the top in which points are counted. Chosen.
_EMPTY = 0.25  # Share of the usual count below which the top has ended. Chosen.
_SHUT = 0.012  # Opening, metres, below which a drawer counts as shut. Chosen: two bins, as of `_BIN`.
_ROOM = 2.0 * TOLERANCES.depth  # Metres around a grip's place within which a piece is of it.
_MOSTLY = 0.8  # Share of a piece's points that must lie there. Chosen.
_ROUND: tuple[Form, ...] = ("lying", "cylinder", "sphere")
_MOST_OPEN = 0.75  # How far a drawer opens as a share of its depth, before it was seen open. Chosen.


@frozen(eq=False)
class SeenDrawer:
    """A drawer as it was seen.

    Attributes:
        hull: Its cabinet, its x axis pointing from the front to the back.
        opening: How far it is open, metres.
        members: Its pieces, the grip's included.
        seen: What the box around all of it was fitted to.
    """

    hull: Fit
    opening: float
    members: Group
    seen: ShapeEvidence

    @property
    def size(self) -> tuple[float, float, float, float]:
        """Width, depth, height and how far it opens, metres; the last is a guess."""
        depth, width, height = (2.0 * float(half) for half in self.hull.sizes)
        return width, depth, height, max(_MOST_OPEN * depth, self.opening)

    @property
    def pose(self) -> Pose:
        """Of the middle of the cabinet's bottom, opening towards local -x."""
        return Pose.from_matrix(self.hull.centre - [0.0, 0.0, self.hull.sizes[2]], self.hull.axes)


def find_drawers(families: Sequence[list[Group]], frames: FrameSet) -> tuple[list[SeenDrawer], list[Group]]:
    """Return the drawers among families of like-coloured groups, and the groups that are none of theirs."""
    left = [list(family) for family in families]
    found = []
    for grip in [item for family in families for item in family if _may_be_grip(item, frames.table.height)]:
        for family in left:
            drawer = None if grip in family or not _near(family, grip) else _as_drawer(family, grip, frames)
            if drawer is not None:
                left.remove(family)
                drawer, left = _with_grip(drawer, grip, left)
                found.append(drawer)
                break
    return found, [item for family in left for item in family]


def _with_grip(drawer: SeenDrawer, grip: Group, left: Sequence[list[Group]]) -> tuple[SeenDrawer, list[list[Group]]]:
    """Return a drawer with what is cut off of the grip, or of the arm that it sits on, and the families without it."""
    cut_off = [item for family in left for item in family if item is not grip and _is_of_grip(item, drawer)]
    segments = (segment for item in cut_off for segment in item.segments)
    whole = Group((*drawer.members.segments, *segments))
    kept = ([item for item in family if item is not grip and item not in cut_off] for family in left)
    return replace(drawer, members=whole), [family for family in kept if family]


def _may_be_grip(item: Group, table: float) -> bool:
    low, high = item.bounds
    return bool((high - low).max() < _LARGEST_GRIP and low[2] > table + _GRIP_OVER_TABLE)


def _is_of_grip(item: Group, drawer: SeenDrawer) -> bool:
    """Tell whether a group lies where a drawer's grip is, or between that and the front."""
    shape = DrawerParts.of(drawer.size)
    local = (item.points - grip_of(drawer.size, drawer.pose, drawer.opening)) @ drawer.pose.rotation
    to_front = -float(shape.cabinet[0]) - float(shape.grip_centre[0])
    before = (local[:, 0] > -shape.grip[0] - _ROOM) & (local[:, 0] < to_front + _ROOM)
    within = (np.abs(local[:, 1:]) < shape.grip[1:] + _ROOM).all(axis=1)
    return float((before & within).mean()) > _MOSTLY


def _near(family: Sequence[Group], grip: Group) -> bool:
    points = np.vstack([item.points for item in family])
    low, high = percentiles(points, [1.0, 99.0])
    large = (high - low)[:2].min() > _LEAST_SIDE and high[2] - low[2] > _LEAST_HEIGHT / 2.0
    first, last = grip.bounds
    return bool(large and (first - _STAND_OFF[1] < high).all() and (low < last + _STAND_OFF[1]).all())


def _as_drawer(family: Sequence[Group], grip: Group, frames: FrameSet) -> SeenDrawer | None:
    """Return the drawer that a family makes with a grip before it, None where its shape is another."""
    members = Group(tuple(segment for item in family for segment in item.segments))
    seen = _outline(members, grip, frames)
    whole = fit("box", seen, frames.table.height) if len(seen.surface.points) else None
    if whole is None or whole.cost > _POOREST or 2.0 * whole.sizes[2] < _LEAST_HEIGHT:
        return None
    facing = _facing(whole, grip)
    rounded = (fit(shape, seen, frames.table.height) for shape in _ROUND)
    if facing is None or any(other is not None and other.cost < whole.cost for other in rounded):
        return None
    length = 2.0 * float(facing.sizes[0])
    depth = _cabinet(members, facing, frames)
    opening = length - depth if length - depth > _SHUT else 0.0
    depth = length - opening
    hull = replace(
        facing,
        centre=facing.centre + opening / 2.0 * facing.axes[:, 0],
        sizes=np.array([depth / 2.0, facing.sizes[1], facing.sizes[2]]),
    )
    if 2.0 * hull.sizes[:2].min() < _LEAST_SIDE:
        # A wall with something before it is no cabinet.
        return None
    return SeenDrawer(hull, opening, Group((*members.segments, *grip.segments)), seen)


def _outline(members: Group, grip: Group, frames: FrameSet) -> ShapeEvidence:
    """Return what tells the box around cabinet and box: tangents, and points on the top."""
    top = float(np.percentile(members.points[:, 2], 98))
    rows, surfaces = [], []
    for segmented, own, points in members.views(frames):
        rows.append(tangents(own, segmented, grip.segments))
        surfaces.append(SurfacePoints.of_frame(points[points[:, 2] > top - _TOP], segmented.frame))
    return ShapeEvidence(Rows.stack(rows), SurfacePoints.stack(surfaces))


def _facing(whole: Fit, grip: Group) -> Fit | None:
    """Return the box with its x axis pointing away from the grip, if the grip is before the middle of a side."""
    for quarter in range(4):
        sizes = whole.sizes[[1, 0, 2]] if quarter % 2 else whole.sizes
        turned = replace(whole, yaw=whole.yaw + quarter * np.pi / 2.0, sizes=sizes)
        local = (grip.points - whole.centre) @ turned.axes
        ahead = -float(np.percentile(local[:, 0], 5)) - float(sizes[0])
        aside = float(np.median(local[:, 1]))
        wide = float(np.subtract(*np.percentile(local[:, 1], [95, 5])))
        level = (float(np.median(local[:, 2])) + float(sizes[2])) / (2.0 * float(sizes[2]))
        if wide > _WIDEST or abs(aside) > _MIDDLE:
            continue
        if _STAND_OFF[0] < ahead < _STAND_OFF[1] and _LEVELS[0] < level < _LEVELS[1]:
            return turned
    return None


def _cabinet(members: Group, whole: Fit, frames: FrameSet) -> float:
    """Return how deep the cabinet is: from the back to where the top ends, metres."""
    heights: list[Array] = []
    for segmented in frames.by_camera.values():
        for segment in members.segments:
            if segment.frame is not segmented.frame:
                continue
            sure = segment.mask & segmented.frame.valid[segment.crop]
            points = segmented.frame.xyz[:, *segment.crop][:, sure].T
            local = (points - whole.centre) @ whole.axes
            within = (np.abs(local[:, 1]) < whole.sizes[1] - _FROM_SIDES) & (local[:, 2] > whole.sizes[2] - _TOP)
            heights.append(whole.sizes[0] - local[within, 0])
    length = 2.0 * float(whole.sizes[0])
    counts, edges = np.histogram(np.concatenate(heights), bins=max(int(length / _BIN), 1), range=(0.0, length))
    usual = float(np.median(counts[: max(len(counts) // 3, 1)]))
    gaps = np.flatnonzero(counts < _EMPTY * usual)
    gaps = gaps[gaps > 1]
    return float(edges[gaps[0]]) if len(gaps) and usual > 0 else length


def opened(size: tuple[float, ...], total: float) -> float:
    """Return how far a drawer of a known size is open, by the length of its cabinet and box together, metres."""
    return float(np.clip(total - size[1], 0.0, size[3]))


def grip_of(size: tuple[float, ...], pose: Pose, opening: float) -> Array:
    """Return the middle of a drawer's grip in the world, (3,)."""
    return np.asarray(pose.position + pose.rotation @ (DrawerParts.of(size).grip_centre - [opening, 0.0, 0.0]))
