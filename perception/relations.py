"""What "on", "inside", "beside", "lifted" and "pushed that way" mean.

Skills check their post-conditions and tasks their success with these same functions, on what perception sees and on
simulated truth, so that what a skill claims and what a bench finds differ only where the two inputs differ. Every shape
is convex here (a container counts as its outer hull) and enters through its support function
h(d) = max over its points of d . x, from which extents, footprints and gaps follow
(Boyd and Vandenberghe, Convex Optimization, 2.5 and 8.1).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from robosandbox.shapes import DrawerShape
from robosandbox.types import (
    CONTAINER_KINDS,
    CONTAINER_WALL,
    DIRECTION_AXES,
    ROUND_CONTAINERS,
    SIDE_AXES,
    Array,
    DetectedObject,
    Direction,
    Pose,
    Side,
)

REST_TOLERANCE = 0.005
BESIDE_GAP = 0.10
CLOSED_WITHIN = 0.003

_ROUNDING = 1e-9
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
_COMPASS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros_like(_ANGLES)])
_DOWN = np.array([0.0, 0.0, -1.0])
_BOTH_WAYS = np.vstack([np.eye(3), -np.eye(3)])


@dataclass(frozen=True, slots=True)
class Relation:
    """Whether something holds, and the numbers that say so.

    Attributes:
        holds: The answer.
        detail: Measurements by name; millimetres where the name ends in `_mm`.
    """

    holds: bool
    detail: dict[str, float] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return self.holds


def centre(obj: DetectedObject) -> Array:
    """Return the centre of the object's hull in the world, shape (3,)."""
    if obj.kind == "beads" and obj.grains:
        return np.asarray(np.mean(obj.grains, axis=0), dtype=np.float64)
    if obj.kind not in CONTAINER_KINDS:
        return obj.pose.position
    height = obj.size[1] if obj.kind in ROUND_CONTAINERS else obj.size[2]
    return obj.pose.position + obj.pose.rotation[:, 2] * (height / 2.0)


def support(obj: DetectedObject, directions: Array) -> Array:
    """Return how far the object reaches along each direction.

    Args:
        obj: The object.
        directions: Unit vectors in the world, shape (n, 3).

    Returns:
        h(d) measured from the world's origin, metres, shape (n,).
    """
    local = directions @ obj.pose.rotation
    reach = directions @ centre(obj)
    axial = np.abs(local[:, 2])
    radial = np.sqrt(np.maximum(1.0 - axial**2, 0.0))
    match obj.kind:
        case "sphere":
            extent = np.full(len(directions), obj.size[0])
        case "cylinder":
            extent = obj.size[0] * radial + obj.size[1] * axial
        case "capsule":
            extent = obj.size[0] + obj.size[1] * axial
        case "bowl" | "cup":
            extent = (obj.size[0] + CONTAINER_WALL) * radial + obj.size[1] / 2.0 * axial
        case "box" | "mesh" | "bin":
            extent = np.abs(local) @ _half_extents(obj)
        case "drawer":
            extent = _drawer_extent(obj, local)
        case "beads":
            extent = np.full(len(directions), obj.size[0])
            if obj.grains:
                return np.asarray((directions @ np.array(obj.grains).T).max(axis=1) + extent, dtype=np.float64)
    return np.asarray(reach + extent, dtype=np.float64)


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
    directions = _plan_directions(obj)
    return float(np.min(support(obj, directions) - directions[:, :2] @ point[:2]))


def gap(a: DetectedObject, b: DetectedObject) -> float:
    """Return the distance between two objects seen from above, metres; negative where they overlap."""
    directions = np.vstack([_plan_directions(a), -_plan_directions(b), _towards(a, b)])
    return float(np.max(-support(b, -directions) - support(a, directions)))


def on_top(obj: DetectedObject, target: DetectedObject) -> Relation:
    """Tell whether `obj` rests on `target`: its centre over the target's footprint, its bottom at the target's top."""
    margin = footprint_margin(target, centre(obj))
    clearance = bottom(obj) - top(target)
    return Relation(
        margin > 0.0 and abs(clearance) < REST_TOLERANCE,
        {"margin_mm": 1e3 * margin, "clearance_mm": 1e3 * clearance},
    )


def on_table(obj: DetectedObject, table_height: float) -> Relation:
    """Tell whether `obj` rests on the table."""
    clearance = bottom(obj) - table_height
    return Relation(abs(clearance) < REST_TOLERANCE, {"clearance_mm": 1e3 * clearance})


def above(
    obj: DetectedObject, target: DetectedObject, *, within: float | None = None, rise: float | None = None
) -> Relation:
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
    return Relation(
        margin > 0.0 and height > 0.0,
        {"aside_mm": 1e3 * aside, "dz_mm": 1e3 * float(apart[2]), "margin_mm": 1e3 * margin},
    )


def inside(obj: DetectedObject, container: DetectedObject) -> Relation:
    """Tell whether `obj` is in `container`: its centre within the inner walls, its bottom below the rim.

    Raises:
        ValueError: The target is no container.
    """
    if container.kind not in CONTAINER_KINDS:
        raise ValueError(
            f"{container.id!r} is a {container.kind}; only {', '.join(sorted(CONTAINER_KINDS))} hold things"
        )
    rotation = container.pose.rotation
    local = rotation.T @ (centre(obj) - container.pose.position)
    if container.kind in ROUND_CONTAINERS:
        margin = container.size[0] - math.hypot(local[0], local[1])
        height = container.size[1]
    else:
        room = box_room(container)
        margin = float(np.min(room.half - np.abs(local[:2] - room.middle)))
        height = room.rim
    axis = rotation[:, 2]
    lowest = -float(support(obj, -axis[None])[0]) - float(axis @ container.pose.position)
    below_rim = height - lowest
    return Relation(
        margin > 0.0 and 0.0 < below_rim < height + REST_TOLERANCE,
        {"margin_mm": 1e3 * margin, "below_rim_mm": 1e3 * below_rim},
    )


@dataclass(frozen=True, slots=True)
class BoxRoom:
    """The inside of a bin or drawer, in the frame of its pose.

    Attributes:
        middle: Of the floor, x and y, metres, shape (2,).
        half: Half-extents along x and y, shape (2,).
        floor: Height of the floor.
        rim: Height of the rim.
    """

    middle: Array
    half: Array
    floor: float
    rim: float


def box_room(container: DetectedObject) -> BoxRoom:
    """Return the inside of a bin, or of a drawer's sliding box as far open as it is; closed where that is not seen."""
    if container.kind == "bin":
        half_x, half_y, height = container.size
        return BoxRoom(np.zeros(2), np.array([half_x, half_y]), CONTAINER_WALL, height)
    shape = DrawerShape.of(container.size)
    middle = shape.box_centre[:2] - [container.opening or 0.0, 0.0]
    return BoxRoom(middle, shape.inner, shape.floor, shape.rim)


def loose(obj: DetectedObject) -> list[DetectedObject]:
    """Return the balls that beads are, or the object itself."""
    if obj.kind != "beads":
        return [obj]
    return [replace(obj, kind="sphere", pose=Pose(xyz=grain), grains=()) for grain in obj.grains]


def contents(objects: Iterable[DetectedObject], container: DetectedObject) -> list[tuple[str, int]]:
    """Return what lies in a container: the objects' ids, each with the number of its bead, 0 where it is none."""
    return [
        (item.id, k)
        for item in objects
        if item.id != container.id
        for k, part in enumerate(loose(item))
        if inside(part, container)
    ]


def poured(
    contents: Sequence[tuple[str, int]],
    objects: Sequence[DetectedObject],
    source: DetectedObject,
    target: DetectedObject,
    *,
    min_fraction: float,
    max_spilled: float,
) -> Relation:
    """Tell whether what was in one container is in another.

    Args:
        contents: What was in it, as `contents` says; nothing is never poured.
        objects: Everything as it is now.
        source: What it was in, as it is now.
        target: What it is to be in.
        min_fraction: Of the contents, that must be in the target.
        max_spilled: Of the contents, that may be in neither.
    """
    parts = {(item.id, k): part for item in objects for k, part in enumerate(loose(item))}
    known = [parts[key] for key in contents if key in parts]
    count = len(contents)
    arrived = sum(inside(part, target).holds for part in known)
    stayed = sum(inside(part, source).holds for part in known)
    fraction, spilled = arrived / max(count, 1), (count - arrived - stayed) / max(count, 1)
    # Fractions of whole things: 0.02 of 50 is 1, whatever the last bit says.
    holds = count > 0 and fraction >= min_fraction - _ROUNDING and spilled <= max_spilled + _ROUNDING
    return Relation(holds, {"fraction": fraction, "spilled": spilled, "count": float(count)})


def beside(obj: DetectedObject, target: DetectedObject, side: Side) -> Relation:
    """Tell whether `obj` stands next to `target` on the given side.

    Both stand equally high, `obj` clears the target along that side more than along any other, and less than
    `BESIDE_GAP` lies between them.
    """
    space = gap(target, obj)
    step = bottom(obj) - bottom(target)
    clears = {name: _clearance(target, obj, axis) for name, axis in SIDE_AXES.items()}
    dominant = all(clears[side] >= clears[other] for other in clears)
    return Relation(
        dominant and -REST_TOLERANCE < space < BESIDE_GAP and abs(step) < REST_TOLERANCE,
        {"gap_mm": 1e3 * space, f"{side}_mm": 1e3 * clears[side], "step_mm": 1e3 * step},
    )


def lifted(before: DetectedObject, after: DetectedObject, at_least: float) -> Relation:
    """Tell whether the object's lowest point rose by `at_least` metres."""
    rise = bottom(after) - bottom(before)
    return Relation(rise >= at_least, {"dz_mm": 1e3 * rise, "min_mm": 1e3 * at_least})


def displacement(
    before: DetectedObject, after: DetectedObject, direction: Direction, at_least: float = 0.0
) -> Relation:
    """Tell whether the object went `at_least` metres in the direction, and mostly in that one."""
    axis = np.array(DIRECTION_AXES[direction])
    moved = (centre(after) - centre(before))[:2]
    along = float(axis @ moved)
    across = abs(float(axis[0] * moved[1] - axis[1] * moved[0]))
    return Relation(
        along >= at_least and along > across,
        {"along_mm": 1e3 * along, "across_mm": 1e3 * across, "min_mm": 1e3 * at_least},
    )


def moved(before: DetectedObject, after: DetectedObject) -> float:
    """Return the distance between the object's centres then and now, metres."""
    return float(np.linalg.norm(centre(after) - centre(before)))


def _half_extents(obj: DetectedObject) -> Array:
    """Return the half-extents (3,) of the box around the object's hull in its own frame."""
    match obj.kind:
        case "box" | "mesh":
            return np.array(obj.size)
        case "bin":
            return np.array([obj.size[0] + CONTAINER_WALL, obj.size[1] + CONTAINER_WALL, obj.size[2] / 2.0])
        case "drawer":
            width, depth, height, _ = obj.size
            return np.array([depth / 2.0, width / 2.0, height / 2.0])
        case _:
            raise ValueError(f"a {obj.kind} has no half-extents")


def _drawer_extent(obj: DetectedObject, local: Array) -> Array:
    """Return how far a drawer reaches from its cabinet's middle, open as far as it is, its grip included."""
    extent: Array = np.abs(local) @ _half_extents(obj)
    if obj.opening is None:
        return extent
    shape = DrawerShape.of(obj.size)
    offset = np.array([-obj.opening, 0.0, -obj.size[2] / 2.0])
    for middle, half in ((shape.box_centre, shape.box), (shape.grip_centre, shape.grip)):
        extent = np.maximum(extent, local @ (middle + offset) + np.abs(local) @ half)
    return extent


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
