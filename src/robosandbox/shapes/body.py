"""Rigid bodies that a shape consists of, in terms that any engine can build: convex pieces, joints, contact."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

from robosandbox.shapes.hull import Hull
from robosandbox.spatial import Vec3
from robosandbox.values import frozen

Rgba = tuple[float, float, float, float]


@frozen(kw_only=True)
class Piece:
    """A convex piece of a rigid body.

    Attributes:
        hull: Its form.
        centre: Its middle in the body's frame, metres.
        quat_xyzw: Its turn in the body's frame, a unit quaternion.
        mass: Its share of the object's mass, kg.
        rgba: Its colour; None is the object's own.
    """

    hull: Hull
    centre: Vec3 = (0.0, 0.0, 0.0)
    quat_xyzw: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    mass: float = 0.0
    rgba: Rgba | None = None


@frozen(kw_only=True)
class Contact:
    """Contact parameters of a surface.

    Attributes:
        sliding: Coefficient of sliding friction.
        torsional: Lever arm of friction against spinning on the spot, metres.
        rolling: Lever arm of friction against rolling, metres.
        frictionless: No friction at all: one row of the contact solver in place of four.
        stiffness_seconds: Time constant with which the contact yields; None is the engine's own.
    """

    sliding: float = 1.0
    torsional: float = 0.005
    rolling: float = 0.0
    frictionless: bool = False
    stiffness_seconds: float | None = None


@frozen(kw_only=True)
class Free:
    """A body that moves freely.

    Attributes:
        drag: What slows it, N per m/s and N m per rad/s.
    """

    drag: float = 0.0


@frozen(kw_only=True)
class Slide:
    """A body that slides along an axis of the object's first body.

    Attributes:
        axis: Unit vector in the first body's frame.
        low: Least travel, metres.
        high: Greatest travel, metres.
        friction: Force that it takes to move it, N.
        damping: N per m/s.
    """

    axis: Vec3
    low: float
    high: float
    friction: float
    damping: float


# Share of its way by which the range of a part may go on beyond where it is shut: what it meets stops it before.
_DRAWN_SHUT = 0.1


@frozen(kw_only=True)
class PartJoint:
    """Hinge or slide of what moves on something else, as it stands in the world.

    Attributes:
        kind: Which.
        axis: Unit vector in the world, along which it slides or about which it turns.
        anchor: A point of the axis in the world, metres.
        low: Least value, metres or radians.
        high: Greatest value; both are infinite where nothing limits it.
        stiffness: Of its spring, N/m or N m/rad.
        start: Value with which a scene begins.
    """

    kind: Literal["hinge", "slide"]
    axis: Vec3
    anchor: Vec3
    low: float
    high: float
    stiffness: float = 0.0
    start: float = 0.0

    @property
    def shut(self) -> float:
        """Value at which a part is shut: 0, where it was drawn, if its range goes on for a little beyond; else the end nearest to 0."""
        low, high = (end if math.isfinite(end) else 0.0 for end in (self.low, self.high))
        if low < 0.0 < high and min(-low, high) <= _DRAWN_SHUT * max(-low, high):
            return 0.0
        return low if abs(low) <= abs(high) else high

    @property
    def far(self) -> float:
        """The end of its range that is farthest from shut; infinite where nothing limits it there."""
        return self.high if self.high - self.shut >= self.shut - self.low else self.low


@frozen(kw_only=True)
class Body:
    """A rigid body of an object.

    Attributes:
        suffix: What follows the object's id in the body's name: "", "/box", "/12".
        pieces: What it consists of.
        joint: How it moves.
        contact: How its surface meets others.
    """

    suffix: str = ""
    pieces: tuple[Piece, ...]
    joint: Free | Slide = Free()
    contact: Contact = Contact()


def share_mass(pieces: Sequence[Piece], mass: float) -> tuple[Piece, ...]:
    """Return the pieces with a mass, kg, shared out among them by volume."""
    whole = sum(piece.hull.volume for piece in pieces)
    return tuple(replace(piece, mass=mass * piece.hull.volume / whole) for piece in pieces)
