"""Solids of convex pieces: what a scene's file is made of, measured and not named.

A thing of a file is one of four kinds by its geometry alone: `solid`, `dish` (a shallow hollow), `vessel` (a deep one), and
`fixture`, which stays where it is; `cupboard`, a fixture with a cavity that is open to one side or two; `compartment`, a hollow of one;
`part` turns or slides on one. The instance carries its pieces, so that an object is asked for
its shape and nobody looks geometry up by kind.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from robosandbox.shapes.body import Body, PartJoint, Piece, share_mass
from robosandbox.shapes.heights import ConvexPiece, HeightGrid, LevelSurface
from robosandbox.shapes.hull import BoxHull, CapsuleHull, CylinderHull, Hull, SphereHull
from robosandbox.shapes.polyhedron import PolyhedronHull
from robosandbox.shapes.room import Room
from robosandbox.shapes.shape import Shape, Size, Solid, Written
from robosandbox.shapes.slopes import SlopingFace, sloping_faces
from robosandbox.spatial import Array, Vec3, frozen_array, matrix_from_quat_xyzw

FileKind = Literal["solid", "dish", "vessel", "fixture", "cupboard", "compartment", "part"]
# Sides to which a cavity is open at the most: what is open to three is a space under a board.
_MOST_WAYS = 2
# Ratio of a hollow's depth to its half width up to which it is a dish: plates have 0.15 to 0.25, bowls 0.6 up.
_SHALLOW = 0.4
_UP = np.array([0.0, 0.0, 1.0])
_TURN = np.arange(24) * 2.0 * np.pi / 24
_CIRCLE = np.column_stack([np.cos(_TURN), np.sin(_TURN), np.zeros(24)])
# Rings of a ball's outline, by their height as a share of the radius.
_RINGS = np.sin(np.linspace(-np.pi / 2.0, np.pi / 2.0, 9))


@dataclass(frozen=True)
class Geometry:
    """Convex pieces of an object, in the frame of its pose.

    Attributes:
        pieces: What collides.
        kind: Which of the kinds of files it is.
        joint: How a part moves; None for what is no part.
        compartment: Number of the hollow that is told of, of a fixture with several; None for all that there is.
    """

    pieces: tuple[Piece, ...]
    kind: FileKind = "solid"
    joint: PartJoint | None = None
    compartment: int | None = None

    @cached_property
    def shape(self) -> Compound:
        """What the object is asked for."""
        return _KINDS[self.kind](self)

    def __hash__(self) -> int:
        """Return a hash that is worked out once: geometry is large, and asked for often."""
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((self.kind, self.pieces, self.compartment))

    @cached_property
    def corners(self) -> tuple[Array, ...]:
        """Points whose hull each piece is, each (k, 3), metres; what is round as a polyhedron."""
        return tuple(frozen_array(_placed(piece)) for piece in self.pieces)

    @cached_property
    def outer(self) -> Array:
        """Corners of the convex hull of all, shape (k, 3), metres."""
        from scipy.spatial import ConvexHull

        points = np.vstack(self.corners)
        return frozen_array(points[np.unique(ConvexHull(points).vertices)])

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Middle and half-extents of the box around it along the frame's axes, each (3,), metres."""
        low, high = self.outer.min(axis=0), self.outer.max(axis=0)
        return frozen_array((low + high) / 2.0), frozen_array((high - low) / 2.0)

    @cached_property
    def grid(self) -> HeightGrid:
        """Columns of it, as seen from above."""
        return HeightGrid([ConvexPiece.of(points) for points in self.corners])

    @cached_property
    def surfaces(self) -> tuple[LevelSurface, ...]:
        """Level faces on which things can stand, the highest first."""
        return self.grid.surfaces()

    @cached_property
    def slopes(self) -> tuple[SlopingFace, ...]:
        """Sloping faces with a ledge, on which things stay that lean on them, the highest first."""
        return sloping_faces(self.grid.pieces)

    @cached_property
    def hollows(self) -> tuple[Room, ...]:
        """Hollows that are open to above, the largest first."""
        return self.grid.hollows()

    @cached_property
    def bore(self) -> Room | None:
        """The largest hole through it, as seen from above; None without one."""
        return next(iter(self.grid.bores()), None)

    @property
    def hollow(self) -> Room | None:
        """The largest hollow that is open to above, or that of the compartment; None without one."""
        return self.hollows[self.compartment or 0] if self.hollows else None

    @cached_property
    def cavity(self) -> LevelSurface | None:
        """Floor of the largest cavity that is covered and open to one side or two; None without one."""
        covered = [face for face in self.surfaces if 0 < len(face.ways_out) <= _MOST_WAYS]
        return max(covered, key=lambda face: face.area * face.headroom, default=None)


def kind_of(pieces: tuple[Piece, ...]) -> FileKind:
    """Return what kind of thing pieces make."""
    hollow = Geometry(pieces).hollow
    if hollow is None:
        return "solid"
    return "dish" if hollow.rim - hollow.floor <= _SHALLOW * float(hollow.half.min()) else "vessel"


class Compound(Shape):
    """A thing of convex pieces; its pose is its body's frame, and its size are the half-extents of its box.

    Args:
        geometry: Its pieces; None for what is known of the kind alone.
    """

    kind = "solid"
    size_fields = ("half_x", "half_y", "half_z")
    nouns = ("object",)

    def __init__(self, geometry: Geometry | None = None) -> None:
        self.geometry = geometry

    def _told(self) -> Geometry:
        if self.geometry is None:
            raise ValueError(f"{self.name} has the geometry that its file gives; an object of it carries its pieces")
        return self.geometry

    def hull(self, size: Size) -> Hull:
        """Return its convex hull, about the middle of its box."""
        if self.geometry is None:
            return BoxHull((size[0], size[1], size[2]))
        return self._hull

    @cached_property
    def _hull(self) -> PolyhedronHull:
        told = self._told()
        return PolyhedronHull(_tuples(told.outer - told.box[0]))

    def extents(self, size: Size) -> Array:
        """Return the full extents of its box, the smallest first, metres, shape (3,)."""
        return np.sort(2.0 * np.array(size))

    def centre(self, solid: Solid) -> Array:
        """Return the middle of its box in the world, metres, shape (3,)."""
        if self.geometry is None:
            return solid.pose.position
        middle: Array = solid.pose.position + solid.pose.rotation @ self.geometry.box[0]
        return middle

    def support(self, solid: Solid, directions: Array) -> Array:
        """Return how far it reaches along unit vectors (n, 3) from the world's origin, metres, shape (n,)."""
        if self.geometry is None:
            return super().support(solid, directions)
        local = (directions @ solid.pose.rotation) @ self.geometry.outer.T
        reach: Array = directions @ solid.pose.position + local.max(axis=1)
        return reach

    def room(self, size: Size, opening: float | None = None) -> Room | None:
        """Return its hollow, of a thing that has one."""
        del size, opening
        return self.geometry.hollow if self.geometry is not None and self.holds_things else None

    def rest_height(self, target: Solid, width: float, place: Array | None = None) -> float:
        """Return the height of the level face at a place, or of the one that a thing would be put on."""
        found = self.surface(target, width, place)
        if found is None:
            return super().rest_height(target, width)
        return target.pose.xyz[2] + found.height

    def surface(self, target: Solid, width: float, place: Array | None = None) -> LevelSurface | None:
        """Return the level face nearest below a place (3,), or the highest that is open to above, else the largest to the side, and wide enough.

        Args:
            target: What it is a face of; one that does not stand upright has none here.
            width: Half of the narrowest width of what is to stand there, metres.
            place: World x and y of the middle and height of the lowest point of what stands there.
        """
        if self.geometry is None or target.pose.rotation[2, 2] < _STANDS:
            return None
        faces = self.geometry.surfaces
        if place is not None:
            x, y, z = target.pose.rotation.T @ (place - target.pose.position)
            over = [face for face in faces if face.margin(np.array([x, y])) > 0.0]
            return min(over, key=lambda face: abs(face.height - z), default=None)
        wide = [face for face in faces if np.isinf(face.headroom) and face.half_width > width]
        covered = [face for face in faces if len(face.ways_out) and face.half_width > width]
        return max(wide, key=lambda face: (face.height, face.area), default=None) or max(
            covered, key=lambda face: face.area * face.headroom, default=None
        )

    def bodies(self, item: Written) -> tuple[Body, ...]:
        """Return its one body."""
        told = self._told()
        return (Body(pieces=share_mass(told.pieces, item.mass)),)


class Dish(Compound):
    """A thing with a shallow hollow: things lie in it and stand on it."""

    kind = "dish"
    nouns = ("dish",)
    holds_things = True


class Vessel(Compound):
    """A thing with a deep hollow."""

    kind = "vessel"
    nouns = ("vessel",)
    holds_things = True
    pours = True
    flat_top = False


class Fixture(Compound):
    """What stays where it is."""

    kind = "fixture"
    nouns = ("fixture",)
    stays_put = True


class Cupboard(Fixture):
    """A fixture with a cavity that is covered and open to the side: things go in from there."""

    kind = "cupboard"
    nouns = ("cupboard",)
    holds_things = True

    @property
    def name(self) -> str:
        """The kind with its article: it stays where it is as any fixture."""
        return f"a {Fixture.kind}"

    def room(self, size: Size, opening: float | None = None) -> Room | None:
        """Return its cavity, the ceiling for a rim."""
        del size, opening
        cavity = None if self.geometry is None else self.geometry.cavity
        if cavity is None:
            return None
        low, high = (edge(cavity.points, axis=0) for edge in (np.min, np.max))
        half = (high - low + cavity.cell) / 2.0
        return Room(middle=(low + high) / 2.0, half=half, floor=cavity.height, rim=cavity.height + cavity.headroom)


class Compartment(Fixture):
    """A hollow of a fixture, or a fixture with one."""

    kind = "compartment"
    nouns = ("compartment",)
    holds_things = True


class Part(Compound):
    """What turns or slides on a fixture."""

    kind = "part"
    nouns = ("part",)
    stays_put = True
    flat_top = False

    def __init__(self, geometry: Geometry | None = None) -> None:
        super().__init__(geometry)
        # What slides and has a hollow is a drawer.
        joint = None if geometry is None else geometry.joint
        self.holds_things = joint is not None and joint.kind == "slide" and self._told().hollow is not None

    def mouth(self, solid: Solid) -> Room | None:
        """Return the part of its hollow that has come out along its slide, where one can reach in from above."""
        room, joint = self.room(solid.size), self.joint(solid)
        if room is None or joint is None:
            return None
        out = ((joint.shut if solid.opening is None else solid.opening) - joint.shut) * np.array(joint.axis)
        local = (solid.pose.rotation.T @ out)[:2]
        along = int(np.abs(local).argmax())
        half, middle = room.half.copy(), room.middle.copy()
        half[along] = min(half[along], abs(float(local[along])) / 2.0)
        middle[along] += np.sign(local[along]) * (room.half[along] - half[along])
        return replace(room, half=half, middle=middle)

    def joint(self, solid: Solid) -> PartJoint | None:
        """Return the joint that its file gives it."""
        del solid
        return None if self.geometry is None else self.geometry.joint

    def handles(self, solid: Solid) -> tuple[Piece, ...]:
        """Return all its pieces: whether a hand finds room at one is for the collision checker to say."""
        del solid
        return self._told().pieces


_STANDS = 0.995
_KINDS: dict[FileKind, type[Compound]] = {
    "solid": Compound,
    "dish": Dish,
    "vessel": Vessel,
    "fixture": Fixture,
    "cupboard": Cupboard,
    "compartment": Compartment,
    "part": Part,
}
# Kinds of what comes from files, by name; nobody writes an object of one.
FILE_KINDS: Mapping[str, Shape] = {kind: made() for kind, made in _KINDS.items()}


def _placed(piece: Piece) -> Array:
    turned: Array = _outline(piece.hull) @ matrix_from_quat_xyzw(piece.quat_xyzw).T + np.array(piece.centre)
    return turned


def _outline(hull: Hull) -> Array:
    match hull:
        case BoxHull(size=half):
            return np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]) * half
        case SphereHull(size=(radius,)):
            return _ball(radius)
        case CylinderHull(size=(radius, height)):
            return np.vstack([radius * _CIRCLE - height * _UP, radius * _CIRCLE + height * _UP])
        case CapsuleHull(size=(radius, height)):
            return np.vstack([_ball(radius) - height * _UP, _ball(radius) + height * _UP])
        case PolyhedronHull():
            return hull.corners


def _ball(radius: float) -> Array:
    return radius * np.vstack([np.sqrt(max(0.0, 1.0 - z * z)) * _CIRCLE + z * _UP for z in _RINGS])


def _tuples(points: Array) -> tuple[Vec3, ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in points)
