"""An object as the judge measures it: extents, outline and surfaces of the pieces that the simulated state has it made of."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import numpy as np

from robosandbox.errors import InputError
from robosandbox.tasks.judge.polygons import depth, outline
from robosandbox.types import Array, Convex, ObjectTruth

UP = np.array([0.0, 0.0, 1.0])
# Directions by which a ball is seen from above; chosen: 64 corners lie at most 0.12 % of the radius within the circle.
_TURN = np.arange(64) * 2.0 * np.pi / 64
_CIRCLE = np.column_stack([np.cos(_TURN), np.sin(_TURN)])
# Dimensions of a solid.
_SOLID = 3
# Cosines of a face's tilt between which a thing leans on it.
_STEEPEST, _LEVEL = 0.7, 0.999


class ConvexPieces:
    """Convex pieces of an object in one frame.

    Args:
        pieces: Its pieces, points as shape (k, 3), metres.
        name: Of the object, for errors.

    Raises:
        InputError: It is made of nothing: the world does not tell.
    """

    def __init__(self, pieces: Iterable[Convex], name: str) -> None:
        self.pieces: tuple[Convex, ...] = tuple(pieces)
        if not self.pieces:
            raise InputError(
                f"success.object: {name!r}: this world does not report what it is made of; its driver's truth or referee "
                "has to give `solids`"
            )

    def reach(self, direction: Array) -> float:
        """Return how far it reaches along a unit vector (3,), measured from the origin, metres."""
        return max(float((one.points @ direction).max()) + one.radius for one in self.pieces)

    @cached_property
    def low(self) -> float:
        """Its least height, metres."""
        return -self.reach(-UP)

    @cached_property
    def high(self) -> float:
        """Its greatest height, metres."""
        return self.reach(UP)

    @cached_property
    def middle(self) -> Array:
        """The middle of the box around it along the frame's axes, metres, shape (3,)."""
        axes = np.eye(3)
        return np.array([(self.reach(axis) - self.reach(-axis)) / 2.0 for axis in axes])

    @cached_property
    def outlines(self) -> tuple[Array, ...]:
        """Each piece seen from above, convex polygons (k, 2), metres."""
        return tuple(outline(_seen_from_above(one)) for one in self.pieces)

    @cached_property
    def outline(self) -> Array:
        """The convex polygon around it seen from above, shape (k, 2), metres."""
        return outline(np.vstack(self.outlines))

    def surface_below(self, point: Array) -> float | None:
        """Return the height of the highest piece that lies under a point (2,), metres; None where none does."""
        tops = [
            float(one.points[:, 2].max()) + one.radius
            for one, seen in zip(self.pieces, self.outlines, strict=True)
            if depth(seen, point) > 0.0
        ]
        return max(tops, default=None)

    def off_slopes(self, other: ConvexPieces, point: Array) -> list[float]:
        """Return how far another object is off the sloping faces that lie under a point (2,), each along its normal, metres."""
        # Heavy: few scenes have a solid that slopes.
        from scipy.spatial import ConvexHull

        found = []
        for one, seen in zip(self.pieces, self.outlines, strict=True):
            if depth(seen, point) <= 0.0 or one.radius or np.linalg.matrix_rank(one.points - one.points[0]) < _SOLID:
                continue
            planes = ConvexHull(one.points).equations
            found += [-other.reach(-plane[:3]) + plane[3] for plane in planes if _STEEPEST < plane[2] < _LEVEL]
        return found


def form(item: ObjectTruth) -> ConvexPieces:
    """Return an object in the world's frame.

    Raises:
        InputError: The world does not tell what it is made of.
    """
    return ConvexPieces(_pieces(item), item.id)


def own_form(item: ObjectTruth, part: int | None = None) -> ConvexPieces:
    """Return an object in the frame of its own pose; or of its parts the last up to `part`.

    Raises:
        InputError: The world does not tell what it is made of.
    """
    rotation, origin = item.pose.rotation, item.pose.position
    return ConvexPieces(
        (
            Convex(points=(one.points - origin) @ rotation, radius=one.radius, part=one.part)
            for one in _pieces(item)
            if part is None or one.part == part
        ),
        item.id,
    )


def in_frame_of(item: ObjectTruth, of: ObjectTruth) -> ConvexPieces:
    """Return an object in the frame of another one's pose."""
    rotation, origin = of.pose.rotation, of.pose.position
    return ConvexPieces(
        (Convex(points=(one.points - origin) @ rotation, radius=one.radius) for one in _pieces(item)), item.id
    )


def centre(item: ObjectTruth) -> Array:
    """Return the middle of the box around the object along its own axes, in the world, metres, shape (3,).

    Of what slides out of a cabinet, the cabinet's; of beads, the mean of them.
    """
    if item.grains:
        mean: Array = np.array(item.grains).mean(axis=0)
        return mean
    middle: Array = item.pose.position + item.pose.rotation @ own_form(item, 0).middle
    return middle


def front(item: ObjectTruth) -> Array:
    """Return the middle of the object's part that moves farthest, metres, shape (3,): of a drawer, of its sliding box."""
    if item.grains:
        return centre(item)
    last = max(one.part for one in _pieces(item)) if item.solids else 0
    middle: Array = item.pose.position + item.pose.rotation @ own_form(item, last).middle
    return middle


def single_beads(item: ObjectTruth) -> list[Convex]:
    """Return the balls that beads are."""
    return [Convex(points=np.array([grain]), radius=item.size[0]) for grain in item.grains]


def _pieces(item: ObjectTruth) -> tuple[Convex, ...]:
    if item.grains:
        return (Convex(points=np.array(item.grains), radius=item.size[0]),)
    return item.solids


def _seen_from_above(one: Convex) -> Array:
    flat = one.points[:, :2]
    if not one.radius:
        return flat
    return np.asarray((flat[:, None] + one.radius * _CIRCLE[None]).reshape(-1, 2), dtype=np.float64)
