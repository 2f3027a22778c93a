"""Geometry of "on", "inside", "beside", "lifted" and "pushed that way".

Skills check their post-conditions and planners their plans with these functions, on what perception sees. Success of tasks is
judged by `robosandbox.tasks.judge`, which shares the words and none of the code. Every shape
is convex here (a container counts as its outer hull) and enters through its support function
h(d) = max over its points of d . x, from which extents, footprints and gaps follow
(Boyd and Vandenberghe, Convex Optimization, 2.5 and 8.1).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import field, replace
from typing import NamedTuple

import numpy as np

from robosandbox.shapes import Room, kinds_that_hold
from robosandbox.shapes.body import Piece
from robosandbox.shapes.compound import Geometry
from robosandbox.shapes.shape import Primitive
from robosandbox.shapes.slopes import SlopingFace
from robosandbox.types import DIRECTION_AXES, SIDE_AXES, Array, DetectedObject, Direction, Pose, Side, Vec3
from robosandbox.values import frozen
from robosandbox.world.episode_cache import cached_for_episode

# Metres between a thing and what it rests on; chosen as twice perception's 2.2 mm (p95, docs/measured.md).
REST_TOLERANCE = 0.005
# Metres; chosen as a hand's width: what stands farther away is not called beside (halved and doubled five placing tasks
# end alike).
BESIDE_GAP = 0.10
# Metres within which a drawer is closed; chosen just above perception's error.
CLOSED_WITHIN = 0.003

# Objects, and pairs of them, whose geometry is kept: a search over plans asks again and again about what has not moved. Chosen:
# some hundred states of a table with twenty things.
_KEPT = 8192
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
_COMPASS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros_like(_ANGLES)])
# By how much a corner may reach farther than the nearest direction of the compass tells, as a ratio.
_BETWEEN = 1.0 / math.cos(math.pi / len(_ANGLES))
# Cosine to the vertical from which on a thing stands upright.
_STANDS = 0.995
_DOWN = np.array([0.0, 0.0, -1.0])
_BOTH_WAYS = np.vstack([np.eye(3), -np.eye(3)])


@frozen
class MeasuredRelation:
    """Truth of a geometric relation, and the numbers that say so.

    Attributes:
        holds: The answer.
        detail: Measurements by name; millimetres where the name ends in `_mm`.
    """

    holds: bool
    detail: dict[str, float] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return self.holds


class Extent(NamedTuple):
    """The upright cylinders around an object and within its footprint: bounds that are compared before anything exact.

    Attributes:
        x: Of the object's centre, metres.
        y: Of the object's centre, metres.
        radius: Seen from above, of the circle around the object, metres.
        ball: Of the ball around its hull, metres.
        inner: Seen from above, of the circle within it, metres.
        low: Height of its lowest point, metres.
        high: Height of its highest point, metres.
    """

    x: float
    y: float
    radius: float
    ball: float
    inner: float
    low: float
    high: float


@cached_for_episode(_KEPT)
def extent(obj: DetectedObject) -> Extent:
    """Return the cylinders around an object and within its footprint."""
    middle = centre(obj)
    directions, reach = _outline(obj)
    out = reach - directions @ middle
    radius = float(out.max()) * _BETWEEN
    # Between two directions the reach changes by no more than the radius times the angle.
    inner = float(out.min()) - radius * math.pi / len(_ANGLES)
    low, high = -float(support(obj, _DOWN[None])[0]), float(support(obj, -_DOWN[None])[0])
    ball = max(radius, obj.shape.hull(obj.size).radius)
    return Extent(float(middle[0]), float(middle[1]), radius, ball, inner, low, high)


def apart(obj: DetectedObject, target: DetectedObject) -> bool:
    """Tell whether two objects are so far from one another that neither can stand on the other or lie in it."""
    a, b = extent(obj), extent(target)
    return math.hypot(a.x - b.x, a.y - b.y) > max(a.ball, a.radius) + b.radius


def stands_on(obj: DetectedObject, target: DetectedObject) -> bool:
    """Tell whether `obj` rests on `target`, as `on_top` does, sooner where they are apart."""
    return not apart(obj, target) and on_top(obj, target).holds


def lies_in(obj: DetectedObject, container: DetectedObject) -> bool:
    """Tell whether `obj` is in `container`, as `inside` does, sooner where they are apart; nothing is in what holds nothing."""
    return container.shape.holds_things and not apart(obj, container) and inside(obj, container).holds


def centre(obj: DetectedObject) -> Array:
    """Return the centre of the object's hull in the world, shape (3,)."""
    return obj.shape.centre(obj)


def support(obj: DetectedObject, directions: Array) -> Array:
    """Return how far the object reaches along each direction.

    Args:
        obj: The object.
        directions: Unit vectors in the world, shape (n, 3).

    Returns:
        h(d) measured from the world's origin, metres, shape (n,).
    """
    return obj.shape.support(obj, directions)


def bounds(obj: DetectedObject) -> tuple[Array, Array]:
    """Return the corners (low, high) of the object's box along the world's axes, each (3,)."""
    reach = support(obj, _BOTH_WAYS)
    return -reach[3:], reach[:3]


def bottom(obj: DetectedObject) -> float:
    """Return the height of the object's lowest point, metres."""
    return -float(support(obj, _DOWN[None])[0])


def top(obj: DetectedObject) -> float:
    """Return the height of the object's highest point, metres."""
    return float(support(obj, -_DOWN[None])[0])


def footprint_margin(obj: DetectedObject, point: Array) -> float:
    """Return how deep a point lies within the object seen from above; negative outside.

    Args:
        obj: The object, in any orientation.
        point: World xy, shape (2,) or more.
    """
    directions, reach = _outline(obj)
    return float(np.min(reach - directions[:, :2] @ point[:2]))


def gap(a: DetectedObject, b: DetectedObject) -> float:
    """Return the distance between two objects seen from above, metres; negative where they overlap."""
    directions = np.vstack([_plan_directions(a), -_plan_directions(b), _towards(a, b)])
    return float(np.max(-support(b, -directions) - support(a, directions)))


@cached_for_episode(_KEPT)
def on_top(obj: DetectedObject, target: DetectedObject) -> MeasuredRelation:
    """Tell whether `obj` rests on `target`: its centre over the target's footprint, its bottom at the target's top, or it leans on a slope."""
    margin, height = _stand(obj, target)
    ways = [(margin, bottom(obj) - height), *_lean(obj, target)]
    margin, clearance = next((way for way in ways if way[0] > 0.0 and abs(way[1]) < REST_TOLERANCE), ways[0])
    return MeasuredRelation(
        margin > 0.0 and abs(clearance) < REST_TOLERANCE,
        {"margin_mm": 1e3 * margin, "clearance_mm": 1e3 * clearance},
    )


def slopes_of(target: DetectedObject) -> tuple[SlopingFace, ...]:
    """Return the sloping faces on which things may lean, of what stands upright."""
    if target.geometry is None or target.shape.holds_things or target.pose.rotation[2, 2] < _STANDS:
        return ()
    return target.geometry.slopes


def _lean(obj: DetectedObject, target: DetectedObject) -> Iterator[tuple[float, float]]:
    """Yield how far within each sloping face of a target an object's middle is, and how far it is off it along its normal, metres."""
    rotation, origin = target.pose.rotation, target.pose.position
    for face in slopes_of(target):
        normal = rotation @ face.axes[:, 2]
        lowest = -float(support(obj, -normal[None])[0]) - float(normal @ origin)
        yield face.margin(rotation.T @ (centre(obj) - origin)), lowest - face.offset


def _stand(obj: DetectedObject, target: DetectedObject) -> tuple[float, float]:
    """Return how far within what it would stand on an object's middle is, and the height of that, metres."""
    place = np.array([*centre(obj)[:2], bottom(obj)])
    surface = target.shape.surface(target, 0.0, place)
    if surface is None:
        return footprint_margin(target, place), rest_height(obj, target)
    met = None if target.is_fixed else let_down(obj, target, (float(place[0]), float(place[1])))
    if met is not None:
        return footprint_margin(target, place), met
    local = target.pose.rotation.T @ (place - target.pose.position)
    return surface.margin(local[:2]), float(target.pose.xyz[2] + surface.height)


def on_table(obj: DetectedObject, table_height: float) -> MeasuredRelation:
    """Tell whether `obj` rests on the table."""
    clearance = bottom(obj) - table_height
    return MeasuredRelation(abs(clearance) < REST_TOLERANCE, {"clearance_mm": 1e3 * clearance})


def above(
    obj: DetectedObject, target: DetectedObject, *, within: float | None = None, rise: float | None = None
) -> MeasuredRelation:
    """Tell whether `obj` is above `target`, touching it or not.

    Args:
        obj: The upper one.
        target: The lower one.
        within: Most that the centres may lie apart seen from above, metres; None asks for the centre of `obj` to lie over
            the target's footprint.
        rise: Least height of the centre of `obj` over the target's centre, metres; None asks for more than the target's top.
    """
    apart = centre(obj) - centre(target)
    aside = float(np.hypot(apart[0], apart[1]))
    margin = footprint_margin(target, centre(obj)) if within is None else within - aside
    height = float(centre(obj)[2] - top(target)) if rise is None else float(apart[2]) - rise
    return MeasuredRelation(
        margin > 0.0 and height > 0.0,
        {"aside_mm": 1e3 * aside, "dz_mm": 1e3 * float(apart[2]), "margin_mm": 1e3 * margin},
    )


@cached_for_episode(_KEPT)
def inside(obj: DetectedObject, container: DetectedObject) -> MeasuredRelation:
    """Tell whether `obj` is in `container`: its centre within the inner walls, its bottom below the rim; in a drawer its centre as well.

    What stands in a drawer with its middle over the rim leans out of it when that moves.

    Raises:
        ValueError: The target is no container.
    """
    room = room_of(container)
    rotation = container.pose.rotation
    local = rotation.T @ (centre(obj) - container.pose.position)
    margin, height = room.margin(local), room.rim
    axis = rotation[:, 2]
    lowest = -float(support(obj, -axis[None])[0]) - float(axis @ container.pose.position)
    below_rim = height - lowest
    return MeasuredRelation(
        margin > 0.0
        and not leans_out(obj, container)
        and 0.0 < below_rim < height - min(room.floor, 0.0) + REST_TOLERANCE,
        {"margin_mm": 1e3 * margin, "below_rim_mm": 1e3 * below_rim},
    )


def leans_out(obj: DetectedObject, container: DetectedObject) -> bool:
    """Tell whether an object's middle is over the rim of a drawer, so that it leans out when that moves."""
    local = container.pose.rotation.T @ (centre(obj) - container.pose.position)
    return container.shape.joint(container) is not None and float(local[2]) > room_of(container).rim


def room_of(container: DetectedObject) -> Room:
    """Return the inside of a container, or of a drawer's sliding box as far open as it is; closed where that is not seen.

    Raises:
        ValueError: Nothing can be put into it.
    """
    room = container.shape.room(container.size, container.opening)
    if room is None:
        raise ValueError(
            f"{container.id!r} is {container.shape.name}; only {', '.join(sorted(kinds_that_hold()))} hold things"
        )
    return room


def mouth_of(container: DetectedObject) -> Room:
    """Return the part of a container's inside that can be reached from above.

    Raises:
        ValueError: Nothing can be put into it.
    """
    mouth = container.shape.mouth(container)
    return room_of(container) if mouth is None else mouth


def rest_height(obj: DetectedObject, target: DetectedObject) -> float:
    """Return the height at which `obj` stands that is set on `target`, metres."""
    x, y, _ = centre(target)
    met = let_down(obj, target, (float(x), float(y)))
    if met is not None:
        return met
    low, high = bounds(obj)
    return target.shape.rest_height(target, float(np.min((high - low)[:2])) / 2.0)


@cached_for_episode(_KEPT)
def let_down(obj: DetectedObject, target: DetectedObject, place: tuple[float, float]) -> float | None:
    """Return the height of an object's lowest point where it comes to rest on another, its middle over a place, x and y.

    None where the target is no solid of pieces, the object neither that nor one convex piece, or one of them does not stand upright.
    """
    geometry = obj.geometry or of_one_piece(obj)
    if geometry is None or target.geometry is None:
        return None
    if min(obj.pose.rotation[2, 2], target.pose.rotation[2, 2]) < _STANDS:
        return None
    points, heights = geometry.grid.underside
    turn = (target.pose.rotation.T @ obj.pose.rotation)[:2, :2]
    middle = (target.pose.rotation.T @ (np.array([*place, 0.0]) - target.pose.position))[:2]
    there = middle + (points - geometry.box[0][:2]) @ turn.T
    height = target.geometry.grid.rest(there, heights - heights.min())
    return None if height == -math.inf else float(target.pose.xyz[2] + height)


def of_one_piece(obj: DetectedObject) -> Geometry | None:
    """Return a box, cylinder, ball or capsule as a solid of pieces; None of other kinds."""
    if not isinstance(obj.shape, Primitive):
        return None
    return Geometry((Piece(hull=obj.shape.hull(obj.size)),))


def loose(obj: DetectedObject) -> list[DetectedObject]:
    """Return the balls that beads are, or the object itself."""
    if not obj.shape.is_granular:
        return [obj]
    return [_bead(obj, grain) for grain in obj.grains]


def _bead(obj: DetectedObject, grain: Vec3) -> DetectedObject:
    return replace(obj, kind="sphere", pose=Pose(xyz=grain), grains=())


def contents(objects: Iterable[DetectedObject], container: DetectedObject) -> list[tuple[str, int]]:
    """Return what lies in a container: the objects' ids, each with the number of its bead, 0 where it is none."""
    loose_ones = (item for item in objects if item.id != container.id and not item.is_fixed)
    return [(item.id, k) for item in loose_ones for k in parts_in(item, container)]


def parts_in(item: DetectedObject, container: DetectedObject) -> list[int]:
    """Return the numbers of an object's beads that lie in a container; 0 for the object itself where it is none."""
    if not item.shape.is_granular:
        return [0] if lies_in(item, container) else []
    if not container.shape.holds_things:
        return []
    around = extent(container)
    return [
        k
        for k, grain in enumerate(item.grains)
        if math.hypot(grain[0] - around.x, grain[1] - around.y) <= around.radius + item.size[0]
        and inside(_bead(item, grain), container)
    ]


def beside(obj: DetectedObject, target: DetectedObject, side: Side) -> MeasuredRelation:
    """Tell whether `obj` stands next to `target` on the given side.

    Both stand equally high, `obj` clears the target along that side more than along any other, and less than
    `BESIDE_GAP` lies between them.
    """
    space = gap(target, obj)
    step = bottom(obj) - bottom(target)
    clears = {name: _clearance(target, obj, axis) for name, axis in SIDE_AXES.items()}
    dominant = all(clears[side] >= clears[other] for other in clears)
    return MeasuredRelation(
        dominant and -REST_TOLERANCE < space < BESIDE_GAP and abs(step) < REST_TOLERANCE,
        {"gap_mm": 1e3 * space, f"{side}_mm": 1e3 * clears[side], "step_mm": 1e3 * step},
    )


def lifted(before: DetectedObject, after: DetectedObject, at_least: float) -> MeasuredRelation:
    """Tell whether the object's lowest point rose by `at_least` metres."""
    rise = bottom(after) - bottom(before)
    return MeasuredRelation(rise >= at_least, {"dz_mm": 1e3 * rise, "min_mm": 1e3 * at_least})


def displacement(
    before: DetectedObject, after: DetectedObject, direction: Direction, at_least: float = 0.0
) -> MeasuredRelation:
    """Tell whether the object went `at_least` metres in the direction, and mostly in that one."""
    axis = np.array(DIRECTION_AXES[direction])
    moved = (centre(after) - centre(before))[:2]
    along = float(axis @ moved)
    across = abs(float(axis[0] * moved[1] - axis[1] * moved[0]))
    return MeasuredRelation(
        along >= at_least and along > across,
        {"along_mm": 1e3 * along, "across_mm": 1e3 * across, "min_mm": 1e3 * at_least},
    )


def moved(before: DetectedObject, after: DetectedObject) -> float:
    """Return the distance between the object's centres then and now, metres."""
    return float(np.linalg.norm(centre(after) - centre(before)))


@cached_for_episode(_KEPT)
def _outline(obj: DetectedObject) -> tuple[Array, Array]:
    """Return horizontal unit vectors (n, 3) and how far the object reaches along each, metres (n,)."""
    directions = _plan_directions(obj)
    return directions, support(obj, directions)


def _plan_directions(obj: DetectedObject) -> Array:
    """Return horizontal unit vectors (n, 3): a compass, and the normals of the footprint's straight edges."""
    axes = obj.pose.rotation[:2].T
    normals = np.column_stack([-axes[:, 1], axes[:, 0], np.zeros(3)])
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals[lengths > 1e-6] / lengths[lengths > 1e-6, None]
    return np.vstack([_COMPASS, normals, -normals])


def _towards(a: DetectedObject, b: DetectedObject) -> Array:
    """Return the horizontal unit vector (1, 3) from one centre to the other."""
    offset = centre(b) - centre(a)
    offset[2] = 0.0
    length = float(np.linalg.norm(offset))
    return offset[None] / length if length > 1e-9 else np.array([[1.0, 0.0, 0.0]])


def _clearance(target: DetectedObject, obj: DetectedObject, axis: tuple[float, float]) -> float:
    """Return how far `obj` starts beyond where `target` ends along a horizontal axis, metres."""
    direction = np.array([[axis[0], axis[1], 0.0]])
    return float((-support(obj, -direction) - support(target, direction))[0])
