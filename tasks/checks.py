"""Checks on simulated truth, one sentence each: lifted, on, inside, opened."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field, model_validator

from robosandbox.errors import InputError
from robosandbox.shapes import kinds_that_hold, shapes
from robosandbox.types import (
    DetectedObject,
    Direction,
    Fraction,
    NonNegative,
    Pose,
    Positive,
    Side,
    StrictModel,
    Truth,
)
from robosandbox.world import pouring, relations
from robosandbox.world.relations import Relation

TABLE = "table"
# How far a joint may be from home, rad or m; chosen above what servos leave under the arm's own weight.
HOME_TOLERANCE = 0.05

# A field that names an object, the name, and the kinds that it may have (empty: any).
Reference = tuple[str, str, frozenset[str]]
_ANY: frozenset[str] = frozenset()
_HOLDERS = kinds_that_hold()
_OPENING = frozenset(kind for kind, shape in shapes().items() if shape.opens)


class Check(StrictModel):
    """What all checks share.

    Attributes:
        hold_s: For how many seconds after the episode it must stay true.
    """

    hold_s: NonNegative = 0.0

    def references(self) -> Iterator[Reference]:
        """Return the objects that the check names."""
        yield from ()

    def children(self) -> Iterator[tuple[str, Check]]:
        """Return the checks inside this one, each with its field."""
        yield from ()

    @abstractmethod
    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Tell whether it is true of this moment, given how the episode began."""


class OfObject(Check):
    """What is said of one object."""

    object: str
    kinds: ClassVar[frozenset[str]] = _ANY

    def references(self) -> Iterator[Reference]:
        """Return the objects that the check names."""
        yield "object", self.object, self.kinds


class Lifted(OfObject):
    """The object's lowest point is higher than at the start."""

    kind: Literal["lifted"]
    min_mm: Positive = 50.0

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Compare lowest points."""
        return relations.lifted(seen(start, self.object), seen(now, self.object), self.min_mm / 1e3)


class Pair(Check):
    """An object let go of at a target."""

    object: str
    target: str
    targets: ClassVar[frozenset[str]] = _ANY

    def references(self) -> Iterator[Reference]:
        """Return the objects that the check names."""
        yield "object", self.object, _ANY
        yield "target", self.target, self.targets

    def released(self, relation: Relation, now: Truth) -> Relation:
        """Add to a relation that the robot no longer touches the object."""
        touched = "robot" in now.objects[self.object].contacts
        return Relation(relation.holds and not touched, {**relation.detail, "touched": float(touched)})


class On(Pair):
    """The object rests on the target, or on "table"."""

    kind: Literal["on"]

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Compare footprints and heights."""
        del start
        obj = seen(now, self.object)
        if self.target == TABLE:
            return self.released(relations.on_table(obj, now.table_height), now)
        return self.released(relations.on_top(obj, seen(now, self.target)), now)


class Inside(Pair):
    """The object is in the container."""

    kind: Literal["inside"]
    targets: ClassVar[frozenset[str]] = _HOLDERS

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Compare with the inner walls and the rim."""
        del start
        return self.released(relations.inside(seen(now, self.object), seen(now, self.target)), now)


class Beside(Pair):
    """The object stands next to the target."""

    kind: Literal["beside"]
    side: Side

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Compare sides and measure the gap."""
        del start
        return self.released(relations.beside(seen(now, self.object), seen(now, self.target), self.side), now)


class Displaced(OfObject):
    """The object went that way; of a drawer, its box did, on its slide or with the whole."""

    kind: Literal["displaced"]
    direction: Direction
    min_mm: Positive

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Compare where it was and is."""
        before, after = _front(start, self.object), _front(now, self.object)
        return relations.displacement(before, after, self.direction, self.min_mm / 1e3)


class MovedAbove(Check):
    """The object is above the target and was not there at the start; whether it rests there or hangs in the gripper is all one.

    Attributes:
        object: Id.
        target: Id.
        xy_tol: Most that their centres may lie apart seen from above, metres; left out, the object's centre has to lie
            within the target's outline.
        min_dz: Least that the object's centre is above the target's, metres; left out, it has to be above the target's top.
    """

    kind: Literal["moved_above"]
    object: str
    target: str
    xy_tol: Positive | None = None
    min_dz: Positive | None = None

    def references(self) -> Iterator[Reference]:
        """Return the objects that the check names."""
        yield "object", self.object, _ANY
        yield "target", self.target, _ANY

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Compare centres, outline and top, now and at the start."""
        before, after = (
            relations.above(seen(truth, self.object), seen(truth, self.target), within=self.xy_tol, rise=self.min_dz)
            for truth in (start, now)
        )
        return Relation(after.holds and not before.holds, {**after.detail, "above_at_start": float(before.holds)})


class Opened(OfObject):
    """The drawer is open at least so far."""

    kind: Literal["opened"]
    kinds: ClassVar[frozenset[str]] = _OPENING
    min_mm: Positive

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Read how far its box has slid."""
        del start
        opening = _opening(now, self.object)
        return Relation(1e3 * opening >= self.min_mm, {"opening_mm": 1e3 * opening, "min_mm": self.min_mm})


class Closed(OfObject):
    """The drawer is closed."""

    kind: Literal["closed"]
    kinds: ClassVar[frozenset[str]] = _OPENING

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Read how far its box has slid."""
        del start
        opening = _opening(now, self.object)
        return Relation(opening <= relations.CLOSED_WITHIN, {"opening_mm": 1e3 * opening})


class Poured(Check):
    """What was in one container is in another.

    Attributes:
        object: The container that it was in; beads in it count one by one.
        target: The container that it is to be in.
        min_fraction: Of it, that must be in the target.
        max_spilled: Of it, that may be in neither.
    """

    kind: Literal["poured"]
    object: str
    target: str
    min_fraction: Fraction = 0.8
    max_spilled: Fraction = 0.2

    def references(self) -> Iterator[Reference]:
        """Return the objects that the check names."""
        yield "object", self.object, _HOLDERS
        yield "target", self.target, _HOLDERS

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Count where the contents are, each bead for itself; nothing inside at the start is nothing poured."""
        others = [item for name in start.objects if name != self.target for item in (seen(start, name),)]
        contents = relations.contents(others, seen(start, self.object))
        return pouring.poured(
            contents,
            [seen(now, name) for name in now.objects],
            seen(now, self.object),
            seen(now, self.target),
            min_fraction=self.min_fraction,
            max_spilled=self.max_spilled,
        )


class Tapped(OfObject):
    """The robot has touched the object since the start, and not hard.

    Attributes:
        object: Id.
        min_n: The least that it has to have pressed with at some moment, N.
        max_n: The most that it may ever have pressed with, N.
    """

    kind: Literal["tapped"]
    min_n: Positive = 0.1
    max_n: Positive = 30.0

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Read the most that was felt."""
        del start
        felt = now.objects[self.object].felt
        return Relation(self.min_n <= felt <= self.max_n, {"felt_n": felt})


class AtHome(Check):
    """The arm is at its home configuration."""

    kind: Literal["at_home"]

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Compare joint by joint."""
        del start
        error = float(np.abs(now.q - now.home_q).max())
        return Relation(error < HOME_TOLERANCE, {"home_error": error})


class Undisturbed(Check):
    """One object, or all but some, moved no more than so far."""

    model_config: ClassVar[ConfigDict] = ConfigDict(extra="forbid", frozen=True, serialize_by_alias=True)

    kind: Literal["undisturbed"]
    object: str | None = None
    but: Annotated[tuple[str, ...] | None, Field(alias="except")] = None
    max_mm: Positive = 10.0

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.object is None) == (self.but is None):
            raise ValueError("object: give `object`, or `except` with a list of ids, and not both")
        return self

    def references(self) -> Iterator[Reference]:
        """Return the objects that the check names."""
        if self.object is not None:
            yield "object", self.object, _ANY
        for index, name in enumerate(self.but or ()):
            yield f"except[{index}]", name, _ANY

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Find the one that moved most."""
        names = [self.object] if self.object is not None else [n for n in start.objects if n not in (self.but or ())]
        if not names:
            return Relation(True)
        most = max(relations.moved(seen(start, name), seen(now, name)) for name in names)
        return Relation(1e3 * most <= self.max_mm, {"moved_mm": 1e3 * most, "max_mm": self.max_mm})


def seen(truth: Truth, name: str) -> DetectedObject:
    """Return an object as simulated truth has it."""
    return truth.objects[name].detected()


def _front(truth: Truth, name: str) -> DetectedObject:
    """Return an object where it is; a drawer is where its sliding box is, which opens towards local -x."""
    item = seen(truth, name)
    slide = Pose(xyz=(-(item.opening or 0.0), 0.0, 0.0))
    return replace(item, pose=item.pose @ slide) if item.shape.opens else item


def _opening(truth: Truth, name: str) -> float:
    opening = truth.objects[name].opening
    if opening is None:
        raise InputError(f"success.object: {name!r}: this world does not report how far it is open")
    return opening
