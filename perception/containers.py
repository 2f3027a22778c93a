"""Containers: open hollow shapes whose walls have one colour."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from itertools import combinations

import numpy as np

from robosandbox.perception.contents import split_contents
from robosandbox.perception.evidence import ShapeEvidence, SurfacePoints
from robosandbox.perception.fit import Fit, fit
from robosandbox.perception.frames import FrameSet, SegmentedFrame
from robosandbox.perception.free_space import seen_through
from robosandbox.perception.groups import Group, alike, group, same_colour
from robosandbox.perception.plane_fit import plane_tilt
from robosandbox.perception.quantiles import median, percentiles
from robosandbox.perception.segments import Segment
from robosandbox.perception.silhouette import Rows, tangents
from robosandbox.perception.support import Form
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.shapes import CONTAINER_WALL, shape_of
from robosandbox.types import Array, ObjectKind

# Metres between groups of one colour that may be one container. Chosen: walls show with gaps between them.
_NEAR = 0.015
_SECTORS = 20  # Number of directions from the middle in which walls are counted. Chosen.
# Share of the directions in which something raised must be seen. Chosen: a thing before it may hide a side.
_CLOSED = 0.7
# Metres below the highest points that count as the rim, and around a hull that count as its own. Chosen: twice a wall.
_RIM = 0.008
_HOLLOW = 0.016  # Depth below the rim, metres, from which a point lies inside. Chosen: twice `_RIM`.
_WALL = 0.012  # Metres from a hull's side that count as its wall. Chosen: three walls, because depth errs at edges.
_LEAST_INSIDE = 30  # Number of points deep inside that make a hull hollow. Chosen.
_LEAST_POINTS = 30  # Number of surface points that a container has at least. Chosen.
# Number of the largest groups that are tried together. Chosen so that at most 15 combinations are fitted.
_MOST_PIECES = 4
_MIDDLE = 0.2  # Share of the extents around the middle in which a solid thing shows its top. Chosen.
# Inner half-extent and half height, metres, of the smallest container. Chosen: half of a small cube.
_LEAST_INNER = 0.012
_FEW = 5  # Number of points in the middle that tell whether there is a top. Chosen.
_FEWEST_OF_RIM = 4  # Number of points on the rim that tell of it. Chosen.
_POOREST = 2.0 * TOLERANCES.cost  # Cost of the poorest fit that is a container.
_VAGUE = 0.006  # Standard deviation of centre and sizes, metres, from which a fit says too little. Chosen.
# Cost that a hull which explains the whole family is worth over one that explains nothing of it (units: mean squared residual
# over standard deviation). Chosen.
_MORE = 0.8
_INSIDE = 0.8  # Share of a piece's points that lie within a hull it belongs to. Chosen.
_SHELL = 0.5  # Share of a piece's points that lie at a hull's walls or floor, if it belongs to it. Chosen.
_SAME_SIZE = 0.12  # Ratio by which two hulls of the same size may differ, less 1. Chosen.

# Points of a hull's walls, as shares of its half-extents; the rim is left out, because the table shows behind it.
_ALONG, _UP = (-0.7, -0.35, 0.0, 0.35, 0.7), (-0.5, 0.0, 0.3)
_ANGLES = np.arange(16) * np.pi / 8.0
_WALLS: dict[Form, Array] = {
    "box": np.array([w for u in _ALONG for z in _UP for s in (-0.97, 0.97) for w in ((s, u, z), (u, s, z))]),
    "cylinder": np.array([(0.97 * np.cos(angle), 0.97 * np.sin(angle), z) for angle in _ANGLES for z in _UP]),
}
_GAPS = 0.12  # Share of points of a hull's walls behind which something may be seen. Chosen.

# The kind that an open container with a hull counts as, where no other has its proportions.
_HULLS: tuple[tuple[ObjectKind, Form], ...] = (("bin", "box"), ("bowl", "cylinder"))

Container = tuple[ObjectKind, Fit, Group]
Hull = tuple[ObjectKind, Fit]


def find_containers(
    groups: Sequence[Group], frames: FrameSet, known: Sequence[Hull] = ()
) -> tuple[list[Container], list[Group], FrameSet]:
    """Return the containers, each with its outer hull and all its pieces, and the groups that are none of theirs.

    The frames come back with what lies in a container of its own colour as pieces of their own.

    Args:
        groups: What was seen.
        frames: Where.
        known: The containers that were seen before: half covered each is still the one that it was, where it was.
    """
    containers: list[Container] = []
    rest: list[Group] = []
    contents: list[Group] = []
    for family in families(groups):
        found = _as_known(family, _best_container(family, frames), known)
        if found is None:
            rest += family
            continue
        kind, hull, members = found
        every = dict.fromkeys((*members.segments, *_segments(family)))
        of_hull = [segment for segment in every if _belongs(segment.points, hull)]
        own, inside, frames = split_contents(hull, of_hull, frames)
        containers.append((kind, hull, Group(tuple(own)) if own else members))
        contents += group(inside)
        left = [tuple(segment for segment in item.segments if segment not in of_hull) for item in family]
        rest += [Group(segments) for segments in left if segments]
    for number, container in enumerate(containers):
        containers[number], rest = _with_strays(container, rest)
    return containers, rest + contents, frames


def _segments(groups: Iterable[Group]) -> tuple[Segment, ...]:
    return tuple(segment for item in groups for segment in item.segments)


def _with_strays(container: Container, rest: Sequence[Group]) -> tuple[Container, list[Group]]:
    """Return a container with the pieces that something before it has parted from the others, and what else is left."""
    kind, hull, members = container
    strays = [item for item in rest if same_colour(item, members) and _belongs(item.points, hull)]
    whole = Group((*members.segments, *_segments(strays)))
    return (kind, hull, whole), [item for item in rest if item not in strays]


def kind_by_proportions(kind: ObjectKind, hull: Fit, kinds: Collection[ObjectKind]) -> ObjectKind:
    """Return which of some kinds an open container is: the first with its form and proportions, else the usual one.

    Args:
        kind: The usual kind for its form.
        hull: Its outer hull.
        kinds: What else it may be.
    """
    usual = shape_of(kind)
    size = usual.size_of_hull([float(value) for value in hull.sizes])
    form = type(usual.hull(size))
    for name in sorted(kinds):
        other = shape_of(name)
        alike = other.is_open_container and other.size_fields == usual.size_fields and type(other.hull(size)) is form
        if alike and name not in dict(_HULLS) and other.is_likely(size):
            return name
    return kind


def _as_known(family: Sequence[Group], found: Container | None, known: Sequence[Hull]) -> Container | None:
    """Return what was found, or the known container whose pieces these are, where they do not show one like it."""
    points = np.vstack([item.points for item in family])
    for kind, hull in known:
        if found is not None and found[1].shape == hull.shape and _as_large(found[1], hull):
            continue
        if _at_shell(points, hull) > _SHELL:
            return kind, hull, Group(_segments(family))
    return found


def _as_large(a: Fit, b: Fit) -> bool:
    one, other = (np.sort(hull.sizes[:-1]) for hull in (a, b))
    return bool((np.abs(one / other - 1.0) < _SAME_SIZE).all())


def _best_container(family: Sequence[Group], frames: FrameSet) -> Container | None:
    """Return the container that some of the groups make, however many: the one whose hull explains its pieces best."""
    largest = sorted(family, key=lambda item: -len(item.points))[:_MOST_PIECES]
    whole = sum(len(item.points) for item in largest)
    subsets = [chosen for count in range(1, len(largest) + 1) for chosen in combinations(largest, count)]
    best, least = None, np.inf
    # Among hulls that fit about equally the one that explains more points wins; subsets that explain too few are not fitted.
    for gain, chosen in sorted(
        ((_MORE * sum(len(item.points) for item in chosen) / whole, chosen) for chosen in subsets),
        key=lambda option: -option[0],
    ):
        if -gain >= least:
            break
        found = _as_container(chosen, family, frames, min(_POOREST, least + gain))
        if found is None:
            continue
        if float(np.sqrt(np.diag(found[1].covariance)[:-1].max())) < _VAGUE:
            best, least = found, found[1].cost - gain
    # Walls stand and floors lie; what is oblique is a board that leans.
    return None if best is None or plane_tilt(best[2].points) is not None else best


def _belongs(points: Array, hull: Fit) -> bool:
    """Tell whether a piece is of a hull's walls or floor; what stands out of the floor lies in it and is another thing."""
    local = (points - hull.centre) @ hull.axes
    half = hull.sizes if hull.shape == "box" else np.array([hull.sizes[0], hull.sizes[0], hull.sizes[1]])
    if (np.abs(local) < half + _RIM).all(axis=1).mean() < _INSIDE:
        return False
    return _at_shell(points, hull) > _SHELL


def _at_shell(points: Array, hull: Fit) -> float:
    """Return the share of points (n, 3) that lie at a hull's walls or on its floor."""
    local = (points - hull.centre) @ hull.axes
    half = hull.sizes if hull.shape == "box" else np.array([hull.sizes[0], hull.sizes[0], hull.sizes[1]])
    within = (np.abs(local) < half + _RIM).all(axis=1)
    if hull.shape == "box":
        at_wall = (np.abs(local[:, :2]) > half[:2] - _WALL).any(axis=1)
    else:
        at_wall = np.hypot(local[:, 0], local[:, 1]) > half[0] - _WALL
    on_floor = local[:, 2] < -half[2] + _WALL
    return float((within & (at_wall | on_floor)).mean())


def families(groups: Sequence[Group]) -> list[list[Group]]:
    """Return groups of like colour that lie within one another or side by side."""
    found: list[list[Group]] = [[item] for item in groups]
    merged = True
    while merged:
        merged = False
        for first, second in combinations(found, 2):
            if any(_adjoin(a, b) for a in first for b in second):
                first += second
                found = [family for family in found if family is not second]
                merged = True
                break
    return found


def _adjoin(a: Group, b: Group) -> bool:
    (low_a, high_a), (low_b, high_b) = a.bounds, b.bounds
    near = (low_a - _NEAR < high_b).all() and (low_b - _NEAR < high_a).all()
    return bool(near) and any(alike(one, other) for one in a.segments for other in b.segments)


def _as_container(chosen: Sequence[Group], family: Sequence[Group], frames: FrameSet, worst: float) -> Container | None:
    """Return the container that these groups of a family make, None where they make none at a cost below `worst`."""
    members = chosen[0] if len(chosen) == 1 else Group(_segments(chosen))
    rim = _rim(members, frames.table.height)
    if rim is None:
        return None
    seen = outer(members, _segments(family), rim, frames)
    fits = [(usual, fit(shape, seen, frames.table.height)) for usual, shape in _HULLS]
    cheap = [(usual, found) for usual, found in fits if found is not None and found.cost < worst]
    for usual, found in sorted(cheap, key=lambda option: option[1].cost):
        if (
            _holds_something(found)
            and not seen_through(found, frames, _WALLS[found.shape], _GAPS)
            and _is_hollow(found, frames)
        ):
            return usual, found, members
    return None


def _rim(members: Group, table: float) -> float | None:
    """Return the height at which walls all around end, metres; None where there are none."""
    points, (low, high) = members.points, members.bounds
    if len(points) < _LEAST_POINTS:
        return None
    rim = float(percentiles(points[:, 2], [96.0])[0])
    too_low = rim - table < 2.0 * _RIM + _HOLLOW / 2.0
    walled = not too_low and not _has_a_top(points, low, high, rim) and _walled(points, (low + high)[:2] / 2.0)
    return rim if walled else None


def _has_a_top(points: Array, low: Array, high: Array, rim: float) -> bool:
    """Tell whether the middle is as high as the rim, as is plain of most solid things."""
    inner = (np.abs(points[:, :2] - (low + high)[:2] / 2.0) < _MIDDLE * (high - low)[:2]).all(axis=1)
    return bool(inner.sum() >= _FEW and median(points[inner, 2]) > rim - _RIM)


def _walled(points: Array, middle: Array) -> bool:
    """Tell whether there is something raised in nearly every direction from the middle."""
    offset = points[:, :2] - middle
    sector = ((np.arctan2(offset[:, 1], offset[:, 0]) + np.pi) / (2.0 * np.pi) * _SECTORS).astype(int) % _SECTORS
    return len(np.unique(sector)) >= _CLOSED * _SECTORS


def _holds_something(found: Fit) -> bool:
    """Tell whether there is room inside of a hull's walls."""
    walls = found.sizes[:2] if found.shape == "box" else found.sizes[:1]
    return bool(walls.min() > _LEAST_INNER + CONTAINER_WALL and found.sizes[-1] > _LEAST_INNER)


def _is_hollow(found: Fit, frames: FrameSet) -> bool:
    """Tell whether the cameras see into a hull: points deep inside, where a solid thing would show its top."""
    inside = over = 0
    for segmented in frames.by_camera.values():
        crop = _around(found, segmented)
        if crop is None:
            continue
        xyz = segmented.frame.xyz[:, crop[0], crop[1]]
        near = segmented.frame.valid[crop] & ~segmented.robot[crop] & (xyz[2] > found.bottom - _RIM)
        reach = float(np.hypot(*found.sizes[:2])) if found.shape == "box" else float(found.sizes[0])
        near &= (np.abs(xyz[0] - found.centre[0]) < reach) & (np.abs(xyz[1] - found.centre[1]) < reach)
        local = (xyz[:, near].T - found.centre) @ found.axes
        inner = np.maximum(found.sizes[:2] - _WALL, 0.3 * found.sizes[:2])
        if found.shape == "box":
            within = (np.abs(local[:, :2]) < inner).all(axis=1)
        else:
            within = np.hypot(local[:, 0], local[:, 1]) < inner[0]
        depth = found.sizes[-1] - local[within, 2]
        # Points above the rim belong to something else.
        inside += int((depth > _HOLLOW).sum())
        over += int(((depth > -_RIM) & (depth < _HOLLOW)).sum())
    return inside >= _LEAST_INSIDE and inside > over


def _around(found: Fit, segmented: SegmentedFrame) -> tuple[slice, slice] | None:
    """Return the part of a picture in which a hull lies; None outside of it."""
    pixels, depth = segmented.frame.project(found.corners(_RIM))
    height, width = segmented.frame.depth.shape
    if (depth < 0.05).any() or not np.isfinite(pixels).all():
        return None
    left, top = np.clip(pixels.min(axis=0), 0, [width, height]).astype(int)
    right, bottom = np.clip(pixels.max(axis=0) + 1, 0, [width, height]).astype(int)
    return (slice(top, bottom), slice(left, right)) if right > left and bottom > top else None


def outer(members: Group, kin: Sequence[Segment], rim: float, frames: FrameSet) -> ShapeEvidence:
    """Return what tells a container's outer hull: tangents, and points on the rim; those inside say nothing of it.

    Args:
        members: The container's pieces.
        kin: Others that may be of it.
        rim: How high it ends, metres.
        frames: Where they are seen.
    """
    rows, surfaces = [], []
    for segmented, own, points in members.views(frames):
        rows.append(tangents(own, segmented, kin))
        top = points[points[:, 2] > rim - _RIM]
        if len(top) >= _FEWEST_OF_RIM:
            surfaces.append(SurfacePoints.of_frame(top, segmented.frame))
    elsewhere = SurfacePoints(members.points, np.array([0.0, 0.0, 2.0]), 1.0)
    return ShapeEvidence(Rows.stack(rows), SurfacePoints.stack(surfaces or [elsewhere]))
