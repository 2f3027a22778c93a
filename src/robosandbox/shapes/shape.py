"""Base class of the kinds of objects: size, extents, bodies, affordances, and the words that people have for it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar, Literal, Protocol

import numpy as np

from robosandbox.shapes.body import Body, Contact, PartJoint, Piece
from robosandbox.shapes.heights import LevelSurface
from robosandbox.shapes.hull import BoxHull, Hull
from robosandbox.shapes.room import Room
from robosandbox.spatial import Array, Pose, Vec3

Size = tuple[float, ...]

# A ball or a lying can meets resistance to rolling, as on a table top: about half a millimetre of lever arm.
_ROLLING = 0.0005


class Solid(Protocol):
    """An object as it is seen or simulated: what a shape is asked about."""

    @property
    def size(self) -> Size:
        """Metres, as the shape's `size_fields` name them."""
        ...

    @property
    def pose(self) -> Pose:
        """In the world."""
        ...

    @property
    def opening(self) -> float | None:
        """Opening, metres; None where that is not known, or it does not open."""
        ...

    @property
    def grains(self) -> tuple[Vec3, ...]:
        """Positions of many small things in the world, metres; empty for one thing."""
        ...


class Written(Protocol):
    """An object as a scene gives it: what bodies are made of."""

    @property
    def id(self) -> str:
        """Its name."""
        ...

    @property
    def size(self) -> Size:
        """Metres, as the shape's `size_fields` name them."""
        ...

    @property
    def mass(self) -> float:
        """Kilograms."""
        ...

    @property
    def rgba(self) -> tuple[float, float, float, float]:
        """Its colour, each channel 0..1."""
        ...

    @property
    def open(self) -> float:
        """Opening at the start, metres."""
        ...

    @property
    def locked(self) -> bool:
        """True where it stays as open as it is."""
        ...

    @property
    def count(self) -> int:
        """Number of small things."""
        ...

    @property
    def mesh(self) -> Path | None:
        """The file of a mesh."""
        ...

    @property
    def scale(self) -> float:
        """Metres per unit of the file."""
        ...

    @property
    def collision(self) -> Literal["hull", "coacd"]:
        """Collision shape of a mesh: its convex hull, or convex pieces that follow its hollows."""
        ...


class Shape(ABC):
    """A kind of object.

    A new kind is a subclass in a file of its own, registered under `robosandbox.shapes`; `conformance.check_shape` tells
    whether it is sound. Each kind says where on it the pose's origin is.

    Attributes:
        kind: Its name in scenes.
        size_fields: What the numbers of its size are, metres.
        nouns: Words that people have for it, the most usual first.
        translations: Words for it in languages that are data: lines of a lexicon, by language, each meaning a noun of `nouns`.
        is_plural: Whether the kind's name is a plural.
        options: Which fields of a scene's object it takes beside size, pose, colour and mass.
        holds_things: Whether things can be put into it.
        opens: Whether it has a part that slides open.
        pours: Whether what it holds can be poured out of it.
        flat_top: Whether something can stand on top of it.
        stays_put: Whether it is left where it is unless somebody names it: things go into it, it goes nowhere.
        is_granular: Whether it is many small things.
        rolls: Whether it can roll.
        turns_on_the_spot: Whether it fills the same space however it is turned about its pose.
        looks_like: Other kinds that a camera may take it for, or it for them.
    """

    kind: ClassVar[str]
    size_fields: ClassVar[tuple[str, ...]]
    nouns: ClassVar[tuple[str, ...]]
    translations: ClassVar[Mapping[str, str]] = {}
    is_plural: ClassVar[bool] = False
    options: ClassVar[frozenset[str]] = frozenset()
    holds_things: bool = False
    opens: ClassVar[bool] = False
    pours: ClassVar[bool] = False
    flat_top: ClassVar[bool] = True
    stays_put: ClassVar[bool] = False
    is_granular: ClassVar[bool] = False
    rolls: ClassVar[bool] = False
    turns_on_the_spot: ClassVar[bool] = False
    looks_like: ClassVar[frozenset[str]] = frozenset()

    # Size.

    def check(self, size: Size) -> None:
        """Check the numbers of a size beyond their being positive and as many as `size_fields`.

        Raises:
            ValueError: What is wrong, and what is valid.
        """
        del size

    @abstractmethod
    def hull(self, size: Size) -> Hull:
        """Return the convex hull, without what opens out of it."""

    def extents(self, size: Size) -> Array:
        """Return the three full extents by which sizes are compared, the smallest first, metres, shape (3,)."""
        return np.sort(2.0 * self.hull(size).half_extents)

    def size_of_hull(self, hull: Sequence[float]) -> Size:
        """Return the size of the kind whose convex hull has these measures, metres, as `Hull.size` has them."""
        return tuple(hull)

    def is_likely(self, size: Size) -> bool:
        """Tell whether a size has the proportions of the kind, for telling it from others with the same hull."""
        del size
        return True

    def max_open(self, size: Size) -> float:
        """Return how far it opens, metres; 0 for what does not."""
        del size
        return 0.0

    # Moving on a joint.

    def joint(self, solid: Solid) -> PartJoint | None:
        """Return the joint on which it, or its sliding box, moves; None for what moves on none."""
        del solid
        return None

    def handles(self, solid: Solid) -> tuple[Piece, ...]:
        """Return the pieces that a hand may lead it by along its joint, where they are now, in the frame of its pose."""
        del solid
        return ()

    # Where it is.

    def centre(self, solid: Solid) -> Array:
        """Return the centre of the hull in the world, metres, shape (3,)."""
        return solid.pose.position

    def support(self, solid: Solid, directions: Array) -> Array:
        """Return how far it reaches along unit vectors (n, 3) from the world's origin, metres, shape (n,)."""
        reach: Array = directions @ self.centre(solid) + self.hull(solid.size).support(directions @ solid.pose.rotation)
        return reach

    def convex_parts(self, solid: Solid) -> list[tuple[BoxHull, Pose]]:
        """Return the parts that fingers may take hold of by themselves, with their poses; none where the hull says it all."""
        del solid
        return []

    # Affordances.

    def room(self, size: Size, opening: float | None = None) -> Room | None:
        """Return the inside, as far open as it is; None where nothing can be put into it."""
        del size, opening
        return None

    def mouth(self, solid: Solid) -> Room | None:
        """Return the part of the inside that can be reached from above."""
        return self.room(solid.size, solid.opening)

    def rest_height(self, target: Solid, width: float, place: Array | None = None) -> float:
        """Return at what height something stands that is set on top.

        Args:
            target: What it is set on, upright.
            width: Half of the narrowest width of what is set on it, metres.
            place: World x and y of the middle and height of the lowest point of what stands there already, (3,); None where
                it is to be set down.
        """
        del width, place
        return float(self.support(target, np.array([[0.0, 0.0, 1.0]]))[0])

    def surface(self, target: Solid, width: float, place: Array | None = None) -> LevelSurface | None:
        """Return the level face that a thing stands on, of what has several or not all over; None where the top says it all."""
        del target, width, place
        return None

    @property
    def is_open_container(self) -> bool:
        """True where things can be put into it from above at any time."""
        return self.holds_things and not self.opens

    def tag_face(self, size: Size) -> tuple[float, float] | None:
        """Return the edge of the largest square on the flat face at the end of local z and its height over the pose, metres."""
        del size
        return None

    # Bodies that engines build.

    @abstractmethod
    def bodies(self, item: Written) -> tuple[Body, ...]:
        """Return the rigid bodies; the first carries the pose."""

    # Words.

    @property
    def name(self) -> str:
        """The kind with its article."""
        return self.kind if self.is_plural else f"a {self.kind}"

    def noun(self, size: Size) -> str:
        """Return what people call one of this size."""
        del size
        return self.nouns[0]

    def describe(self, solid: Solid) -> str:
        """Return the measures that people give, millimetres."""
        return " x ".join(f"{2e3 * half:.0f}" for half in self.hull(solid.size).half_extents)


class Primitive(Shape):
    """A kind that is one convex piece: new sizes need no new model."""

    def bodies(self, item: Written) -> tuple[Body, ...]:
        """Return its one body."""
        contact = Contact(rolling=_ROLLING) if self.rolls else Contact()
        return (Body(pieces=(Piece(hull=self.hull(item.size), mass=item.mass),), contact=contact),)
