"""The check that any kind of object must pass."""

from __future__ import annotations

import numpy as np

from robosandbox.shapes import Shape, Size, shapes
from robosandbox.shapes.body import Free, Piece
from robosandbox.sim.opening import open_mujoco
from robosandbox.spatial import matrix_from_quat_xyzw
from robosandbox.types import TABLE_HEIGHT, Array, DetectedObject, Pose, Scene, SceneObject

# How far a piece may reach beyond the object's support function, and the support function beyond all pieces, metres;
# chosen because walls made of flat pieces stand out of a ring by 1.3 % of its radius.
_SLACK = 0.002
# Of the object that is tried, kg; chosen as a usual thing's on a table.
_MASS = 0.2
# Number of directions of the Fibonacci sphere; chosen so that neighbours are 14 degrees apart, less than between a
# cube's edges.
_DIRECTIONS = 200
# How far an object may sink or move while it settles on the table, metres; chosen as 20 times what the bundled ones
# were measured to sink.
_SETTLED = 0.004


def check_shape(shape: Shape, size: Size) -> None:
    """Check that a kind of object keeps its promises at a size, in numbers and on a simulated table.

    Args:
        shape: An installed kind that needs no file and no container.
        size: Valid for it, metres.

    Raises:
        AssertionError: With a sentence that says which promise is broken.
    """
    kind = shape.kind
    _demand(shapes().get(kind) is not None, f"{kind}: is not registered under robosandbox.shapes")
    _demand(len(size) == len(shape.size_fields), f"{kind}: its size has {len(shape.size_fields)} numbers")
    shape.check(size)
    item = SceneObject(id="it", kind=kind, size=size, pose=Pose(xyz=(0.15, 0.1, 0.3)), mass=_MASS)
    opening = 0.0 if shape.opens else None
    seen = DetectedObject(id="it", kind=kind, size=size, colour="", rgba=item.rgba, pose=item.pose, opening=opening)
    _check_words(shape, seen)
    _check_bodies(shape, item, seen)
    _check_inside(shape, seen)
    _check_rest(item, seen)


def _check_words(shape: Shape, seen: DetectedObject) -> None:
    _demand(bool(shape.nouns) and all(shape.nouns), f"{shape.kind}: people have no word for it")
    _demand(bool(shape.noun(seen.size)), f"{shape.kind}: noun() is empty")
    _demand(bool(shape.describe(seen)), f"{shape.kind}: describe() is empty")


def _check_bodies(shape: Shape, item: SceneObject, seen: DetectedObject) -> None:
    bodies = shape.bodies(item)
    _demand(bool(bodies) and isinstance(bodies[0].joint, Free), f"{shape.kind}: its first body does not move freely")
    total = sum(piece.mass for body in bodies for piece in body.pieces)
    _demand(abs(total - item.mass) < 1e-9, f"{shape.kind}: its pieces weigh {total:g} kg in place of {item.mass:g}")
    directions = _around()
    reach = shape.support(seen, directions)
    made = np.max([_reach(item, piece, directions) for body in bodies for piece in body.pieces], axis=0)
    _demand(
        float((made - reach).max()) < _SLACK,
        f"{shape.kind}: a piece sticks out of support() by {(made - reach).max():.4f} m",
    )
    half = np.vstack([np.eye(3), -np.eye(3)])
    sizes = shape.support(seen, half)
    pieces = np.max([_reach(item, piece, half) for body in bodies for piece in body.pieces], axis=0)
    if not shape.opens:
        _demand(float(np.abs(sizes - pieces).max()) < _SLACK, f"{shape.kind}: support() is not where its pieces end")
    extents = shape.extents(seen.size)
    _demand(bool((np.diff(extents) >= 0.0).all() and extents[0] > 0.0), f"{shape.kind}: extents() are not in order")


def _check_inside(shape: Shape, seen: DetectedObject) -> None:
    room = shape.room(seen.size, 0.0)
    _demand((room is not None) == shape.holds_things, f"{shape.kind}: holds_things and room() say different things")
    if room is not None:
        top = float(shape.support(seen, np.array([[0.0, 0.0, 1.0]]))[0]) - seen.pose.xyz[2]
        _demand(0.0 < room.floor < room.rim <= top + 1e-9, f"{shape.kind}: floor and rim of its room are not inside it")
    face = shape.tag_face(seen.size)
    _demand(
        (face is not None) == ("tag" in shape.options), f"{shape.kind}: options and tag_face() say different things"
    )


def _check_rest(item: SceneObject, seen: DetectedObject) -> None:
    """Put it on a table and see that it stays where its numbers say that it stands."""
    low = -float(item.shape.support(seen, np.array([[0.0, 0.0, -1.0]]))[0])
    x, y, z = item.pose.xyz
    standing = item.model_copy(update={"pose": Pose(xyz=(x, y, z - low + TABLE_HEIGHT + 0.001))})
    sim = open_mujoco(Scene(objects=(standing,)))
    try:
        now = sim.truth().objects["it"].detected()
        bottom = -float(now.shape.support(now, np.array([[0.0, 0.0, -1.0]]))[0])
        _demand(
            abs(bottom - TABLE_HEIGHT) < _SETTLED, f"{item.kind}: it stands {bottom - TABLE_HEIGHT:.4f} m off the table"
        )
    finally:
        sim.close()


def _reach(item: SceneObject, piece: Piece, directions: Array) -> Array:
    turn = matrix_from_quat_xyzw(piece.quat_xyzw)
    reach: Array = directions @ (item.pose.position + np.array(piece.centre)) + piece.hull.support(directions @ turn)
    return reach


def _around() -> Array:
    """Return unit vectors all around, shape (n, 3), spread evenly (a Fibonacci sphere)."""
    k = np.arange(_DIRECTIONS) + 0.5
    z = 1.0 - 2.0 * k / _DIRECTIONS
    angle = np.pi * (1.0 + np.sqrt(5.0)) * k
    level = np.sqrt(1.0 - z**2)
    return np.column_stack([level * np.cos(angle), level * np.sin(angle), z])


def _demand(holds: bool, otherwise: str) -> None:
    if not holds:
        raise AssertionError(otherwise)
