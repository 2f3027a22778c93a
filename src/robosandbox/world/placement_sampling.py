"""Sampling of placements on the table, beside something and in a container, by geometry alone, without an arm."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from robosandbox.shapes.compound import Geometry
from robosandbox.shapes.heights import LevelSurface
from robosandbox.shapes.slopes import SlopingFace
from robosandbox.spatial import matrix_about_axis
from robosandbox.types import SIDE_AXES, Array, DetectedObject, ObservedScene, Pose, Side
from robosandbox.types.objects import Area
from robosandbox.values import frozen
from robosandbox.world.covered import OUTSIDE, ways_out
from robosandbox.world.episode_cache import cached_for_episode
from robosandbox.world.relations import (
    BESIDE_GAP,
    Extent,
    bottom,
    bounds,
    centre,
    extent,
    gap,
    let_down,
    mouth_of,
    rest_height,
    slopes_of,
    support,
    top,
)

# How far over its support an object is let go, metres; chosen above a descent's error: the descent ends there (halved
# and doubled five placing tasks end alike).
_DROP = 0.0015
# Free space that is kept around an object on the table, metres; chosen as part of what opening fingers need.
_SPACING = 0.008
# Distances beside a neighbour, as shares of BESIDE_GAP, the best first; chosen so that fingers fit in between and noise
# leaves it beside.
_GAP_SHARES = (0.4, 0.55, 0.3, 0.7, 0.2)
# Shifts along the neighbour, metres, the best first; chosen as a finger's width and two.
_SHIFTS = (0.0, 0.02, -0.02, 0.04, -0.04)
_SHARES = (0.0, 0.5, -0.5, 1.0, -1.0)
# Shares of the room along a ledge at which a thing leans, the middle first.
_ALONG = (0.0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1.0, -1.0)
_CELLS = np.array([(u, v) for u in _SHARES for v in _SHARES])
# Metres between a thing and a container's walls; chosen above perception's error and the descent's.
_WALL_ROOM = 0.004
# Metres between two things in a container, likewise; chosen as at its walls.
_NEXT_ROOM = 0.004
# Metres of free space beyond which more is no better; chosen as a small object's width.
_ENOUGH_ROOM = 0.04
# Metres from a sloping face's edge within which the middle of a thing is that leans on it: twice perception's error.
_HELD_WITHIN = 0.01
# Metres over a face at which a thing is carried in from the side.
CARRIED_OVER = 0.01
# Metres above what lies there at which a thing is put on it; chosen below what a drop shows.
_ABOVE = 0.001
# Metres over its support at which an object is let go where the hand does not get lower; chosen so that the last is
# from over a usual bin's rim.
_DROPS = (0.0, 0.007, 0.015, 0.03, 0.05)
# Places tried at each of these heights; chosen so that all five take under a second.
_MOST_PER_DROP = 16
# Metres of height and of free space that make one place better than another; chosen as twice perception's error.
_STEP = 0.005
# Containers with what lies in them and what is to go in, for which the first place is cached. Chosen: a search's hundred states.
_CACHED = 1024

# Metres between points of the table at which room is looked for; chosen as half a small object.
_APART = 0.04
# Metres from the table's edge at which that begins.
_FROM_EDGE = 0.06
# Space in which a hand gets down beside a thing with its fingers open, metres. Chosen: 4 cm for a finger's way, 3 for itself.
_HAND_ROOM = 0.07


# Cosine of the tilt up to which what holds things is set down with its mouth up; chosen as 75 degrees: beyond that it lies on its side.
_MOUTH_UP = 0.25
# Of what is left to turn, what is tried with one grip, the most first; chosen because an arm's last joint goes about half a
# turn at a time.
_TURN_SHARES = (1.0, 0.75, 0.5, 0.25)


# Level directions in which an object's outline is measured: each side of a triangle, square, hexagon or octagon faces one.
_ANGLES = 2.0 * np.pi * np.arange(48) / 48.0
_AROUND = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros(48)])


@frozen
class Placement:
    """Placement for the held object.

    Attributes:
        xy: The object's origin, metres, or its middle.
        height: Its lowest point, metres.
        yaws: Headings to try, radians about world z from its present one, best first.
        way_out: Level unit vector along which it is left by what has to come in from the side; None from above.
        depth: Metres along it to where what stands there would be outside.
        over: Metres above it from which it is come down to straight at the least, as around a post.
        laid: Direction of the level axis, radians about world z, about which the object is laid down by a quarter turn; None as it stands.
        lean: Direction of the level axis about which it is leant on a slope when it has its heading, and the angle, radians; None where it is not.
        by_middle: Whether `xy` is the middle, however it is turned: a mug's origin is off that by its handle. So it is of what is laid down.
    """

    xy: tuple[float, float]
    height: float
    yaws: tuple[float, ...]
    way_out: tuple[float, float] | None = None
    depth: float = 0.0
    over: float = 0.0
    laid: float | None = None
    lean: tuple[float, float] | None = None
    by_middle: bool = False

    @property
    def is_turnable(self) -> bool:
        """True where any heading will do: the square ones and those between are all to be tried."""
        return len(self.yaws) == len(turns(0.0))

    def rotation(self, level: Array, yaw: float) -> Array:
        """Return the rotation (3, 3) with which what is level as `level` (3, 3) stands here at one of the headings."""
        if self.lean is not None:
            return about_level(*self.lean) @ about_z(yaw) @ level
        return about_z(yaw) @ (level if self.laid is None else about_level(self.laid) @ level)


def table_placements(
    scene: ObservedScene, held: DetectedObject, points: Iterable[Array]
) -> tuple[list[Placement], tuple[str, ...]]:
    """Return the free ones of these points (2,) on the table, and the ids of what occupies the others.

    Where none has the space around it that open fingers need, as little will do as is kept to a container's walls.
    """
    points = list(points)
    for spacing in (_SPACING, _WALL_ROOM):
        found = list(tried_on_table(scene, held, points, spacing, is_turnable=True))
        if free := [spot for spot, names in found if not names]:
            break
    blocking = dict.fromkeys(name for _, names in found for name in names)
    return free, tuple(blocking)


def tried_on_table(
    scene: ObservedScene,
    held: DetectedObject,
    points: Iterable[Array],
    spacing: float = _SPACING,
    *,
    is_turnable: bool = False,
) -> Iterator[tuple[Placement, tuple[str, ...]]]:
    """Yield those of these points (2,) that are on the table as spots, each with the ids of what occupies it.

    Args:
        scene: What is where.
        held: What is to stand there.
        points: World xy, metres.
        spacing: Free space that is kept around it, metres.
        is_turnable: Where there is room with other headings alone, the spot has those.
    """
    low, high = bounds(held)
    half = (high - low)[:2] / 2.0
    level = levelled(held)
    headings = turns(0.0)
    # Around the table's middle, to be compared with what is there before it is put to each point.
    origin = Placement((0.0, 0.0), scene.table_height, headings, by_middle=True)
    here = extent(with_pose(held, resting_pose(held, origin, level)))
    seen = [(item, extent(item)) for item in scene.objects if item.id != held.id]
    others = [(item, around) for item, around in seen if around.low < here.high]
    pieces: dict[str, list[tuple[DetectedObject, Extent]]] = {}
    for point in points:
        if margin_on_table(scene.table_area, point, half) < 0.0:
            continue
        spot = replace(origin, xy=(float(point[0]), float(point[1])))
        x, y = spot.xy[0] + here.x, spot.xy[1] + here.y
        there, always = dict[str, list[tuple[DetectedObject, Extent]]](), list[str]()
        for item, around in others:
            distance = math.hypot(x - around.x, y - around.y)
            if distance > here.radius + around.radius + spacing:
                continue
            if item.id not in pieces:
                pieces[item.id] = [(part, extent(part)) for part in separately(item)]
            parts = pieces[item.id]
            if len(parts) > 1 or distance > here.inner + around.inner + spacing:
                there[item.id] = parts
            else:
                always.append(item.id)
        met = _met_at(held, spot, level, 0.0, there, spacing)
        if met and is_turnable and not always and here.radius > here.inner + spacing:
            free = tuple(yaw for yaw in headings[1:] if not _met_at(held, spot, level, yaw, there, spacing))
            spot, met = (replace(spot, yaws=free), []) if free else (spot, met)
        yield spot, (*always, *met)


def _met_at(
    held: DetectedObject,
    spot: Placement,
    level: Array,
    yaw: float,
    others: Mapping[str, Sequence[tuple[DetectedObject, Extent]]],
    spacing: float,
) -> list[str]:
    """Return the ids of those whose pieces are nearer than a distance to an object that stands on a spot, turned by a heading."""
    if not others:
        return []
    standing, ball = with_pose(held, resting_pose(held, spot, spot.rotation(level, yaw))), extent(held).ball
    return [
        name
        for name, parts in others.items()
        if any(_is_nearer(standing, ball, part, around, spacing) for part, around in parts)
    ]


def _is_nearer(standing: DetectedObject, ball: float, part: DetectedObject, around: Extent, distance: float) -> bool:
    """Tell whether a thing within a ball of a radius stands nearer to a part within a circle than a distance, metres; the circles first."""
    x, y, _ = centre(standing)
    return math.hypot(x - around.x, y - around.y) < ball + around.radius + distance and gap(standing, part) < distance


def separately(item: DetectedObject) -> tuple[DetectedObject, ...]:
    """Return the convex pieces of what is fixed, each as an object: things may stand between the walls of a frame."""
    if item.geometry is None or not item.is_fixed:
        return (item,)
    return tuple(replace(item, geometry=Geometry((piece,), "fixture")) for piece in item.geometry.pieces)


def at_its_height(item: DetectedObject, other: DetectedObject, clearance: float = 0.0) -> tuple[DetectedObject, ...]:
    """Return the pieces of another object that one meets which slides along: those over it, and under it, it passes.

    Args:
        item: What slides.
        other: What may be in its way.
        clearance: How far the top of a piece is over the bottom of what meets it, metres.
    """
    low, high = bottom(item) + clearance, top(item)
    return tuple(piece for piece in separately(other) if top(piece) > low and bottom(piece) < high)


def margin_on_table(area: Area, point: Array, half: Array | float = 0.0) -> float:
    """Return how far a thing of these half-extents (2,) about a point (2,) is from the table's edge, metres; negative over it."""
    (x0, x1), (y0, y1) = area
    low, high = point[:2] - half, point[:2] + half
    return float(min(low[0] - x0, x1 - high[0], low[1] - y0, y1 - high[1]))


def is_easy(scene: ObservedScene, point: Sequence[float] | Array) -> bool:
    """Tell whether a point, x and y, is at a distance at which the robot works easily."""
    near, far = scene.reach
    return near <= math.dist(point[:2], scene.base_xy) <= far


def _too_far(scene: ObservedScene, point: Sequence[float]) -> int:
    """Return how much farther away a point, x and y, is than where the robot works easily, in steps."""
    return max(0, math.ceil((math.dist(point[:2], scene.base_xy) - scene.reach[1]) / _STEP))


def in_easy_reach(scene: ObservedScene, item: DetectedObject) -> bool:
    """Tell whether an object's middle is at a distance at which the robot works easily."""
    around = extent(item)
    return is_easy(scene, (around.x, around.y))


@cache
def _grid(area: Area) -> Array:
    """Return points of a table, shape (n, 2)."""
    xs, ys = (np.arange(low + _FROM_EDGE, high - _FROM_EDGE + 0.01, _APART) for low, high in area)
    return np.array([(x, y) for x in xs for y in ys]).reshape(-1, 2)


def free_placements(scene: ObservedScene, item: DetectedObject) -> Iterator[Placement]:
    """Yield free spots of the table in easy reach, the nearest to an object first.

    Those between whose neighbours and the object a hand gets come before those where it does not.
    """
    here = extent(item)
    grid = _grid(scene.table_area)
    away = np.hypot(*(grid - (here.x, here.y)).T)
    points = [grid[k] for k in np.argsort(away, kind="stable")]
    easy = [point for point in points if is_easy(scene, point)]
    for spacing in (_HAND_ROOM, _SPACING):
        yield from (spot for spot, names in tried_on_table(scene, item, easy, spacing) if not names)


def turning_placement(item: DetectedObject, angle: float) -> Placement:
    """Return the spot where an object stands, turned by an angle, radians, or by a part of it: what one grip is tried for."""
    x, y, _ = item.pose.xyz
    return Placement((x, y), bottom(item), tuple(share * angle for share in _TURN_SHARES))


def turns(first: float) -> tuple[float, ...]:
    """Return headings to try: `first`, the other square ones from it, then the ones between, radians."""
    quarters = sorted((_wrap(first + k * np.pi / 2.0) for k in range(4)), key=abs)
    eighths = sorted((_wrap(first + np.pi / 4.0 + k * np.pi / 2.0) for k in range(4)), key=abs)
    return (*quarters, *eighths)


def yaw_to_align(held: DetectedObject, target: DetectedObject) -> float:
    """Return the turn about z, radians, that squares the held object's sides with the target's."""
    return _wrap_quarter(target.pose.yaw - Pose.from_matrix(held.pose.position, levelled(held)).yaw)


def with_pose(item: DetectedObject, pose: Pose) -> DetectedObject:
    """Return the object as if it stood at `pose`."""
    return replace(item, pose=pose)


def resting_pose(held: DetectedObject, spot: Placement, rotation: Array) -> Pose:
    """Return where the object stands on a spot, turned by `rotation` (3, 3)."""
    there = with_pose(held, Pose.from_matrix(np.array([*spot.xy, 0.0]), rotation))
    x, y = spot.xy if spot.laid is None and not spot.by_middle else 2.0 * np.array(spot.xy) - centre(there)[:2]
    return Pose.from_matrix(np.array([x, y, spot.height + _DROP - bottom(there)]), rotation)


def levelled(item: DetectedObject) -> Array:
    """Return an object's rotation turned by the least angle that makes its most vertical axis vertical; what holds things has its mouth up."""
    rotation = item.pose.rotation
    column = 2 if item.shape.holds_things and rotation[2, 2] > _MOUTH_UP else int(np.abs(rotation[2]).argmax())
    axis = rotation[:, column] * np.sign(rotation[2, column])
    up = np.array([0.0, 0.0, 1.0])
    cross, cosine = np.cross(axis, up), float(axis @ up)
    skew = np.array([[0, -cross[2], cross[1]], [cross[2], 0, -cross[0]], [-cross[1], cross[0], 0]])
    levelled: Array = (np.eye(3) + skew + skew @ skew / (1.0 + cosine)) @ rotation
    return levelled


def about_z(angle: float) -> Array:
    """Return the rotation (3, 3) about the vertical by an angle, radians."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def about_level(heading: float, angle: float = math.pi / 2.0) -> Array:
    """Return a turn (3, 3) by an angle about the level axis of a heading, radians: a quarter turn where none is given."""
    return matrix_about_axis(np.array([math.cos(heading), math.sin(heading), 0.0]), angle)


def _wrap(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _wrap_quarter(angle: float) -> float:
    return float((angle + np.pi / 4.0) % (np.pi / 2.0) - np.pi / 4.0)


def placements_in(
    vessel: DetectedObject,
    held: DetectedObject,
    contents: Sequence[DetectedObject],
    scene: ObservedScene | None = None,
) -> Iterator[Placement]:
    """Yield where the held object may be let go in a container: as low as can be, where there is most room.

    Args:
        vessel: What holds things; of a drawer the open part counts.
        held: What goes in, as it is held.
        contents: What lies in it already.
        scene: Where the robot stands: of what is farther away than it works easily the near side is best. Any place is as near when left out.
    """
    if vessel.geometry is not None and vessel.geometry.kind == "cupboard" and vessel.geometry.cavity is not None:
        cavity = vessel.geometry.cavity
        spots = _on_face(held, vessel, cavity, contents)[0]
        yield from spots or _laid_on_face(held, vessel, cavity, contents)
        return
    edge = float(vessel.pose.xyz[2]) + _inside(vessel)[3]
    # A thing whose underside is as high as the rim stands on the contents, not inside.
    places = [place for place in _places(vessel, held, contents) if place[1] < edge]
    if scene is not None:
        places.sort(key=lambda place: _too_far(scene, place[0]))
    if not places:
        yield from _nested(vessel, held, contents, edge)
        return
    rim = edge + _NEXT_ROOM
    for drop in _DROPS:
        for xy, height, yaw in places[:_MOST_PER_DROP]:
            if height + drop < rim:
                yield Placement(xy, height + drop, (yaw,))
    for xy, height, yaw in places:
        yield Placement(xy, max(rim, height), (yaw,))


def _nested(
    vessel: DetectedObject, held: DetectedObject, contents: Sequence[DetectedObject], edge: float
) -> Iterator[Placement]:
    """Yield where a thing that does not get down between the walls rests on them, below the rim, as one bowl in another.

    Args:
        vessel: What holds things.
        held: What goes in.
        contents: What lies in it already.
        edge: Height of its rim, metres.
    """
    x, y, _ = vessel.pose.position + vessel.pose.rotation @ np.array([*_inside(vessel)[0], 0.0])
    upright = with_pose(held, Pose.from_matrix(held.pose.position, levelled(held)))
    height = None if contents else let_down(upright, vessel, (float(x), float(y)))
    if height is not None and height < edge - _STEP:
        # The object's origin need not be its middle.
        aside = (upright.pose.position - centre(upright))[:2]
        yaws = turns(0.0) if np.hypot(*aside) < _ABOVE else (0.0,)
        # Fingers on its rim may reach down beside the other's, and then let go of it from over that.
        for drop in _DROPS:
            yield Placement((float(x + aside[0]), float(y + aside[1])), height + _ABOVE + drop, yaws)


@cached_for_episode(_CACHED)
def first_placement_in(
    vessel: DetectedObject, held: DetectedObject, contents: tuple[DetectedObject, ...]
) -> Placement | None:
    """Return the first of `placements_in`; None where there is none."""
    return next(placements_in(vessel, held, contents), None)


def middle_of(item: DetectedObject) -> Array:
    """Return the middle of an object's outline as seen from above, that of a triangle too, shape (3,), 0 high, metres."""
    # The Steiner point.
    middle: Array = 2.0 / len(_AROUND) * support(item, _AROUND) @ _AROUND
    return middle


def side_room(held: DetectedObject, vessel: DetectedObject) -> float:
    """Return how far the walls of a container stay off an object in its middle, metres; below 0 it is too wide.

    Of a hollow that is no rectangle the widest circle is known; the widest circle within the object has to fit there.
    """
    room, level = mouth_of(vessel), levelled(held)
    if room.is_round:
        upright = with_pose(held, Pose.from_matrix(held.pose.position, level))
        reach = support(upright, _AROUND)
        return float(room.half[0] - (reach - _AROUND @ middle_of(upright)).min())
    axes, origin = vessel.pose.rotation[:, :2].T, vessel.pose.position
    found = -np.inf
    for yaw in turns(yaw_to_align(held, vessel)):
        upright = with_pose(held, Pose.from_matrix(held.pose.position, about_z(yaw) @ level))
        found = max(found, float((room.square - _span(upright, axes, origin)[1]).min()))
    return found


def _inside(vessel: DetectedObject) -> tuple[Array, Array, float, float]:
    """Return middle (2,), half-extents (2,), floor and rim of the inside, in the frame of the vessel's pose, metres."""
    room = mouth_of(vessel)
    return room.middle, room.square, room.floor, room.rim


def _places(
    vessel: DetectedObject, held: DetectedObject, contents: Sequence[DetectedObject]
) -> Iterator[tuple[tuple[float, float], float, float]]:
    """Yield places in a container as x and y, height and yaw, the lowest and freest first."""
    middle, half, floor, _ = _inside(vessel)
    rotation, origin = vessel.pose.rotation, vessel.pose.position
    axes = rotation[:, :2].T
    level = levelled(held)
    there = [(*_span(item, axes, origin), top(item)) for item in contents]
    points, heights, frees, ranks, offsets, yaws = [], [], [], [], [], []
    for rank, yaw in enumerate(turns(yaw_to_align(held, vessel))):
        upright = with_pose(held, Pose.from_matrix(held.pose.position, about_z(yaw) @ level))
        at, size = _span(upright, axes, origin)
        room = half - size - _WALL_ROOM
        if (room < 0.0).any():
            continue
        point = middle + _CELLS * room
        height, free = np.full(len(point), float(origin[2]) + floor), np.full(len(point), _ENOUGH_ROOM)
        for other, reach, high in there:
            gaps = (np.abs(point - other) - size - reach).max(axis=1)
            height = np.where(gaps < _NEXT_ROOM, np.maximum(height, high), height)
            free = np.minimum(free, gaps)
        points.append(point)
        heights.append(height + _ABOVE)
        frees.append(free)
        ranks.append(np.full(len(point), rank))
        # The object's origin need not be its middle.
        offsets.append(rotation.T[:2] @ (upright.pose.position - origin) - at)
        yaws.append(yaw)
    if not points:
        return
    cells, height, order = np.vstack(points), np.concatenate(heights), np.concatenate(ranks)
    aside = np.tile(np.hypot(*_CELLS.T), len(points)) + 0.01 * order
    low, tight = np.round(height / _STEP), -np.round(np.concatenate(frees) / _STEP)
    for k in np.lexsort((aside, order // 4, tight, low)):
        turn = k // len(_CELLS)
        x, y, _ = origin + rotation[:, :2] @ (cells[k] + offsets[turn])
        yield (float(x), float(y)), float(height[k]), yaws[turn]


def _span(item: DetectedObject, axes: Array, origin: Array) -> tuple[Array, Array]:
    """Return the middle and half-extents (2,) of an object along two axes (2, 3), from an origin (3,), metres."""
    high, low = support(item, axes) - axes @ origin, -support(item, -axes) - axes @ origin
    return (high + low) / 2.0, (high - low) / 2.0


def placements_on(
    held: DetectedObject, base: DetectedObject, others: Iterable[DetectedObject] = ()
) -> tuple[list[Placement], tuple[str, ...]]:
    """Return where an object may stand on another, the best first, and the ids of what occupies the rest.

    On a thing it stands in the middle, squared with it first; on what a scene's file fixes, wherever its level face is free, and where
    another as large may follow for which the middle leaves no room, on one half of it.

    Args:
        held: What is to stand there.
        base: What it is to stand on.
        others: What else there is.
    """
    headings = turns(yaw_to_align(held, base))
    low, high = bounds(held)
    half = (high - low)[:2] / 2.0
    surface = base.shape.surface(base, float(np.min(half)))
    if surface is None and slopes_of(base):
        return _on_slopes(held, base, others)
    if surface is None or not base.is_fixed:
        point = centre(base)
        return [Placement((float(point[0]), float(point[1])), rest_height(held, base), headings)], ()
    others = tuple(others)
    spots, blocking = _on_face(held, base, surface, others)
    return (spots if _leaves_room(held, spots) else [*_halves(held, base, surface, others), *spots]), blocking


def _on_slopes(
    held: DetectedObject, base: DetectedObject, others: Iterable[DetectedObject]
) -> tuple[list[Placement], tuple[str, ...]]:
    """Return where an object may lean on a sloping face of another, its lower end at the ledge, and the ids of what occupies the rest.

    It lies along the slope or stands on it, as it is lower, and nowhere where it would tip over the ledge. What holds things would
    spill them.
    """
    if held.shape.holds_things:
        return [], ()
    others = [item for item in others if item.id not in (held.id, base.id) and not is_on(item, base)]
    found, blocking = [], dict[str, None]()
    for face in slopes_of(base):
        for _, placement in sorted(_leaning(held, base, face), key=lambda one: round(one[0], 3)):
            (yaw,) = placement.yaws
            leant = with_pose(held, resting_pose(held, placement, placement.rotation(levelled(held), yaw)))
            names = [other.id for other in others if _meets(leant, other)]
            blocking.update(dict.fromkeys(names))
            if not names:
                found.append(placement)
    return found, tuple(blocking)


def _leaning(held: DetectedObject, base: DetectedObject, face: SlopingFace) -> Iterator[tuple[float, Placement]]:
    """Yield how far an object that leans on a sloping face stands out from it, metres, and how it leans, in the face's middle first."""
    rotation, origin, level = base.pose.rotation, base.pose.position, levelled(held)
    across, uphill, normal = (rotation @ face.axes).T
    heading, slope = math.atan2(across[1], across[0]), math.acos(normal[2])
    square = _wrap_quarter(heading - Pose.from_matrix(origin, level).yaw)
    directions = np.array([across, -uphill, -normal, normal])
    for share, angle, yaw in itertools.product(_ALONG, (math.pi / 2.0 - slope, -slope), turns(square)[:4]):
        whole = Placement((0.0, 0.0), 0.0, (yaw,), lean=(heading, angle), by_middle=True)
        leant = with_pose(held, Pose.from_matrix(origin, whole.rotation(level, yaw)))
        aside, low, below, out = support(leant, directions) - directions @ centre(leant)
        # The circle around it stays within, as on a level face.
        room = max(0.0, face.half_width - math.hypot(aside, low))
        spot = face.axes @ (face.middle[0] + share * room, face.stop + _WALL_ROOM + low, face.offset + below)
        if face.margin(spot) < _HELD_WITHIN or below * math.tan(slope) > low:
            continue
        x, y, z = origin + rotation @ spot
        height = float(z + bottom(leant) - centre(leant)[2])
        yield float(below + out), replace(whole, xy=(float(x), float(y)), height=height)


def _meets(item: DetectedObject, other: DetectedObject) -> bool:
    """Tell whether an object has no room beside another at its height."""
    low, high = bottom(item), top(item)
    return any(top(part) > low and bottom(part) < high and gap(item, part) < _SPACING for part in separately(other))


def _leaves_room(held: DetectedObject, spots: Sequence[Placement]) -> bool:
    """Tell whether a thing as large has room on one of some spots when the held one stands on the first."""
    if not spots:
        return False
    farthest = max(spots, key=lambda spot: math.dist(spot.xy, spots[0].xy))
    first, next_one = (with_pose(held, resting_pose(held, spot, levelled(held))) for spot in (spots[0], farthest))
    return gap(first, next_one) >= _SPACING


def _halves(
    held: DetectedObject, base: DetectedObject, face: LevelSurface, others: Sequence[DetectedObject]
) -> Iterator[Placement]:
    """Yield the free halves of an open face where there is another thing as large, which may come to stand beside it."""
    alike = (item for item in others if item.id != held.id and item.shape.name == held.shape.name and not item.is_fixed)
    if not np.isinf(face.headroom) or not any(np.allclose(item.size, held.size, atol=_STEP) for item in alike):
        return
    rotation, origin = base.pose.rotation, base.pose.position
    low, high = face.points.min(axis=0), face.points.max(axis=0)
    middle, level = (low + high) / 2.0, levelled(held)
    for yaw in turns(yaw_to_align(held, base))[:4]:
        upright = with_pose(held, Pose.from_matrix(held.pose.position, about_z(yaw) @ level))
        at, half = _span(upright, rotation[:, :2].T, origin)
        room = (high - low) / 2.0 - half
        for axis in np.flatnonzero((room >= half + _SPACING / 2.0) & (room >= 0.0).all()):
            aside = min(room[axis], half[axis] + _HAND_ROOM / 2.0)
            for side in (aside, -aside):
                corners = [middle + side * np.eye(2)[axis] + (u, v) * half for u in (-1, 1) for v in (-1, 1)]
                if any(np.hypot(*(face.points - corner).T).min() > 2.0 * face.cell for corner in corners):
                    continue
                spot = np.mean(corners, axis=0) + rotation.T[:2] @ (upright.pose.position - origin) - at
                x, y, z = origin + rotation @ np.array([*spot, face.height])
                placement = Placement((float(x), float(y)), float(z), (yaw,))
                standing = with_pose(held, resting_pose(held, placement, about_z(yaw) @ level))
                if all(gap(standing, item) >= _SPACING for item in others if item.id not in (held.id, base.id)):
                    yield placement


def _on_face(
    held: DetectedObject,
    base: DetectedObject,
    face: LevelSurface,
    others: Iterable[DetectedObject],
    laid: float | None = None,
) -> tuple[list[Placement], tuple[str, ...]]:
    """Return where an object may stand on a level face of another, the best first, and the ids of what occupies the rest.

    On a face that is covered, what is nearest to the side from which it comes in is best. One that was `laid` is told as it lies.
    """
    headings = turns(yaw_to_align(held, base) if laid is None else _wrap_quarter(base.pose.yaw - laid))
    low, high = bounds(held)
    half = (high - low)[:2] / 2.0
    height = base.pose.xyz[2] + face.height
    if high[2] - low[2] + 2.0 * CARRIED_OVER > face.headroom:
        return [], ()
    level = levelled(held)
    tall = high[2] - low[2] + 2.0 * CARRIED_OVER
    around = [
        item for item in others if item.id not in (held.id, base.id) and not is_on(item, base) and top(item) > height
    ]
    # What is fixed over a place leaves room there, for what comes in from the side.
    near = [part for item in around for part in separately(item) if top(part) > height and bottom(part) < height + tall]
    over = [item for item in around if item.is_fixed and top(item) > height + tall]
    rotation, origin = base.pose.rotation, base.pose.position
    ball, circles = extent(held).ball, [(part, extent(part)) for part in near]
    found, blocking = [], dict[str, None]()
    # The end of what lies may stand out over the edge, so that the hand keeps out.
    wanted = min(float(np.hypot(*half) if laid is None else half.min()), face.half_width - face.cell)
    step = max(1, round(_APART / 2.0 / face.cell))
    cells = np.flatnonzero(face.inside >= wanted)
    points, deep = face.points[cells], _deep(face.inside[cells])
    for way in [None] if np.isinf(face.headroom) else face.ways_out:
        first = np.linalg.norm(points - face.middle, axis=1).round(3) if way is None else (-points @ way).round(2)
        order = np.lexsort((first, -deep) if way is None else (np.linalg.norm(points - face.middle, axis=1), first))
        middle = [face.middle] if way is None else []
        out = None if way is None else rotation[:2, :2] @ way
        for spot in [*middle, *(points[k] for k in order[:: step * step])]:
            x, y, _ = origin + rotation @ np.array([*spot, face.height])
            depth = 0.0
            if way is not None and out is not None:
                edge = float((face.points @ way).max() - spot @ way)
                depth = edge + float(np.hypot(*half)) + OUTSIDE
            placement = Placement(
                (float(x), float(y)),
                height,
                headings,
                None if out is None else (float(out[0]), float(out[1])),
                depth,
                laid=laid,
            )
            standing = with_pose(held, resting_pose(held, placement, level))
            names = [part.id for part, around in circles if _is_nearer(standing, ball, part, around, _SPACING)]
            blocking.update(dict.fromkeys(names))
            if names:
                continue
            outs = ways_out(standing, over, math.inf) if way is None and over else []
            found += [_from_aside(placement, out) for out in outs] or [placement]
    if over and np.isinf(face.headroom):
        # What is nearest to the open side first, as under a board of its own; what is free from above comes before.
        found.sort(key=lambda spot: round(spot.depth, 2))
    return found, tuple(blocking)


def _from_aside(placement: Placement, out: Array) -> Placement:
    """Return a spot that is come to and left on a level way (3,) out from under what is over it."""
    length = float(np.linalg.norm(out))
    return replace(placement, way_out=(float(out[0]) / length, float(out[1]) / length), depth=length)


def _laid_on_face(
    held: DetectedObject, base: DetectedObject, face: LevelSurface, others: Iterable[DetectedObject]
) -> Iterator[Placement]:
    """Yield where an object that is too high for a covered face may lie on it, on each of its sides, those on which it is highest first."""
    if held.shape.holds_things:
        return
    level, others = levelled(held), tuple(others)
    heading = Pose.from_matrix(held.pose.position, level).yaw
    quarters = [_wrap(heading + k * math.pi / 2.0) for k in range(4)]
    lying = [
        (quarter, with_pose(held, Pose.from_matrix(held.pose.position, about_level(quarter) @ level)))
        for quarter in quarters
    ]
    for quarter, item in sorted(lying, key=lambda one: round(bottom(one[1]) - top(one[1]), 3)):
        yield from _on_face(item, base, face, others, quarter)[0]


def is_on(part: DetectedObject, base: DetectedObject) -> bool:
    """Tell whether an object is a part on another: `cupboard.door` on `cupboard`."""
    return part.id.startswith(f"{base.id}.") and part.is_fixed


def _deep(inside: Array) -> Array:
    """Return how good distances from an edge are, in steps: beyond what is enough more is no better."""
    return np.minimum(inside, _ENOUGH_ROOM).round(2)


def points_beside(held: DetectedObject, neighbour: DetectedObject, side: Side) -> list[Array]:
    """Return points (2,) for the object's centre on one side of another, the best first."""
    axis = np.array([*SIDE_AXES[side], 0.0])
    across = np.array([-axis[1], axis[0]])
    edge = float(support(neighbour, axis[None])[0] - axis @ centre(neighbour))
    half = float(support(held, -axis[None])[0] + axis @ centre(held))
    middle = centre(neighbour)[:2]
    distances = [edge + half + share * BESIDE_GAP for share in _GAP_SHARES]
    return [middle + axis[:2] * d + across * shift for shift in _SHIFTS for d in distances]
