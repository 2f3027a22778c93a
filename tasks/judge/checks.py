"""Checks on simulated truth, one sentence each: lifted, on, inside, opened."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field, model_validator

from robosandbox.errors import InputError
from robosandbox.shapes import kinds_that_hold, shape_of, shapes
from robosandbox.tasks.judge.bodies import centre, form, front
from robosandbox.tasks.judge.containment import vessel
from robosandbox.tasks.judge.finding import Judgement
from robosandbox.tasks.judge.polygons import depth, separation
from robosandbox.tasks.judge.support import borne_by, rests_on, touched
from robosandbox.types import (
    DIRECTION_AXES,
    SIDE_AXES,
    Direction,
    Fraction,
    NonNegative,
    ObjectTruth,
    Positive,
    Side,
    StrictModel,
    Truth,
)

TABLE = "table"
# Metres between a thing and what it rests on, or between the heights of two that stand beside one another; chosen above what
# contacts yield by (0.2 mm) and what a thing stands askew by, below the height of the thinnest thing here.
REST_WITHIN = 0.005
# Metres between two things beside one another; chosen as a hand's width.
BESIDE_WITHIN = 0.10
# Metres that a closed drawer, or the outermost point of a closed part, may be open; chosen above the play of a drawer's slide.
CLOSED_WITHIN = 0.003
# How far a joint may be from home, rad or m; chosen above what servos leave under the arm's own weight.
HOME_TOLERANCE = 0.05

# A field that names an object, the name, and the kinds that it may have (empty: any).
Reference = tuple[str, str, frozenset[str]]
_ANY: frozenset[str] = frozenset()
HOLDERS = (kinds_that_hold() | {"part"}) - {"compartment"}
_OPENING = frozenset({"part", *(kind for kind, shape in shapes().items() if shape.opens)})
# Shares of its way from which on a part of a scene's file is open, up to which one is closed whose whole way is some millimetres, and
# what it may lack to a share that is asked for.
_PART_OPEN, _PART_CLOSED, _PART_SHORT = 0.5, 0.1, 0.05


class Check(StrictModel):
    """Base of all checks.

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
    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Tell whether it is true of this moment, given how the episode began."""

    def settled(self, start: Truth, now: Truth) -> Iterator[str]:
        """Yield the objects that have to lie still for it to be true to stay; asked where it holds."""
        del start, now
        yield from ()


class OfObject(Check):
    """Base of the checks of one object."""

    object: str
    kinds: ClassVar[frozenset[str]] = _ANY

    def references(self) -> Iterator[Reference]:
        """Return the objects that the check names."""
        yield "object", self.object, self.kinds

    def settled(self, start: Truth, now: Truth) -> Iterator[str]:
        """Yield the object."""
        del start, now
        yield self.object


class Lifted(OfObject):
    """The object's lowest point is higher than at the start.

    Attributes:
        min_mm: By so much at the least.
        hand: The hand that holds it, of a robot with several; None where that does not matter.
    """

    kind: Literal["lifted"]
    min_mm: Positive = 50.0
    hand: Annotated[str | None, Field(exclude_if=lambda hand: hand is None)] = None

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Compare lowest points, and ask the hand."""
        rise = form(now.objects[self.object]).low - form(start.objects[self.object]).low
        detail = {"dz_mm": 1e3 * rise, "min_mm": self.min_mm}
        if self.hand is None:
            return Judgement(1e3 * rise >= self.min_mm, detail)
        in_hand = now.hands.get(self.hand) == self.object
        return Judgement(in_hand and 1e3 * rise >= self.min_mm, {**detail, "in_hand": float(in_hand)})


class Pair(Check):
    """An object let go of at a target."""

    object: str
    target: str
    targets: ClassVar[frozenset[str]] = _ANY

    def references(self) -> Iterator[Reference]:
        """Return the objects that the check names."""
        yield "object", self.object, _ANY
        yield "target", self.target, self.targets

    def settled(self, start: Truth, now: Truth) -> Iterator[str]:
        """Yield the object."""
        del start, now
        yield self.object

    def released(self, finding: Judgement, now: Truth) -> Judgement:
        """Add to a finding that the robot no longer touches the object."""
        held = touched(now, self.object)
        return Judgement(finding.holds and not held, {**finding.detail, "touched": float(held)})


class On(Pair):
    """The object rests on the target, or on "table"."""

    kind: Literal["on"]

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Compare outlines and heights, and ask what carries it."""
        del start
        found = on_table(now, self.object) if self.target == TABLE else self._on_target(now)
        return self.released(Judgement(found.holds and rests_on(now, self.object, self.target), found.detail), now)

    def _on_target(self, now: Truth) -> Judgement:
        obj, target = now.objects[self.object], now.objects[self.target]
        point, low, under = centre(obj)[:2], form(obj).low, form(target)
        margin = depth(under.outline, point)
        clearances = [low - under.high]
        if shape_of(target.kind).flat_top:
            # What fits into a plate or a tray stands on its floor, and what leans on a slope lies along it.
            floor = under.surface_below(point)
            clearances += [] if floor is None else [low - floor]
            clearances += under.off_slopes(form(obj), point)
        clearance = min(clearances, key=abs)
        detail = {"margin_mm": 1e3 * margin, "clearance_mm": 1e3 * clearance}
        return Judgement(margin > 0.0 and abs(clearance) < REST_WITHIN, detail)


class Inside(Pair):
    """The object is in the container."""

    kind: Literal["inside"]
    targets: ClassVar[frozenset[str]] = HOLDERS

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Look for walls around it and a floor below it, and ask what carries it."""
        del start
        found = vessel(now.objects[self.target], HOLDERS).holds(now.objects[self.object])
        return self.released(Judgement(found.holds and borne_by(now, self.object, self.target), found.detail), now)


class Beside(Pair):
    """The object stands next to the target."""

    kind: Literal["beside"]
    side: Side

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Compare sides and heights, and measure the gap."""
        del start
        obj, target = form(now.objects[self.object]), form(now.objects[self.target])
        gap, step = separation(target.outline, obj.outline), obj.low - target.low
        clears = {
            name: -obj.reach(-np.array([x, y, 0.0])) - target.reach(np.array([x, y, 0.0]))
            for name, (x, y) in SIDE_AXES.items()
        }
        near = -REST_WITHIN < gap < BESIDE_WITHIN and abs(step) < REST_WITHIN
        holds = near and clears[self.side] >= max(clears.values())
        detail = {"gap_mm": 1e3 * gap, f"{self.side}_mm": 1e3 * clears[self.side], "step_mm": 1e3 * step}
        return self.released(Judgement(holds, detail), now)


class Displaced(OfObject):
    """The object went that way; of a drawer, its box did, on its slide or with the whole."""

    kind: Literal["displaced"]
    direction: Direction
    min_mm: Positive

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Compare where it was and is."""
        x, y = DIRECTION_AXES[self.direction][:2]
        dx, dy, _ = (front(now.objects[self.object]) - front(start.objects[self.object])).tolist()
        along, across = x * dx + y * dy, abs(x * dy - y * dx)
        detail = {"along_mm": 1e3 * along, "across_mm": 1e3 * across, "min_mm": self.min_mm}
        return Judgement(1e3 * along >= self.min_mm and along > across, detail)


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

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Compare centres, outline and top, now and at the start."""
        before, after = self._above(start), self._above(now)
        return Judgement(after.holds and not before.holds, {**after.detail, "above_at_start": float(before.holds)})

    def settled(self, start: Truth, now: Truth) -> Iterator[str]:
        """Yield the object."""
        del start, now
        yield self.object

    def _above(self, truth: Truth) -> Judgement:
        middle, target = centre(truth.objects[self.object]), truth.objects[self.target]
        dx, dy, dz = (middle - centre(target)).tolist()
        aside = math.hypot(dx, dy)
        margin = depth(form(target).outline, middle[:2]) if self.xy_tol is None else self.xy_tol - aside
        height = float(middle[2]) - form(target).high if self.min_dz is None else dz - self.min_dz
        detail = {"aside_mm": 1e3 * aside, "dz_mm": 1e3 * dz, "margin_mm": 1e3 * margin}
        return Judgement(margin > 0.0 and height > 0.0, detail)


class Opened(OfObject):
    """The drawer is open at least so far; of a part of a scene's file its outermost point went so far, and it at least half its way.

    Attributes:
        object: Id.
        min_mm: The least way of the drawer, or of the part's outermost point, millimetres.
        share: Of its way, 0 to 1, that a part of a scene's file has gone; half where it is left out.
    """

    kind: Literal["opened"]
    kinds: ClassVar[frozenset[str]] = _OPENING
    min_mm: Positive
    share: Fraction | None = None

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Read how far its box has slid, or the part has gone."""
        del start
        if (gone := part_travel(now.objects[self.object])) is not None:
            share, metres = gone
            detail = {"open_share": share, "opening_mm": 1e3 * metres, "min_mm": self.min_mm}
            least = _PART_OPEN if self.share is None else self.share - _PART_SHORT
            return Judgement(share >= least and 1e3 * metres >= self.min_mm, detail)
        opening = _opening(now, self.object)
        return Judgement(1e3 * opening >= self.min_mm, {"opening_mm": 1e3 * opening, "min_mm": self.min_mm})


class Closed(OfObject):
    """The drawer, or the part of a scene's file, is closed."""

    kind: Literal["closed"]
    kinds: ClassVar[frozenset[str]] = _OPENING

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Read how far its box has slid, or the part has gone."""
        del start
        if (gone := part_travel(now.objects[self.object])) is not None:
            share, metres = gone
            closed = metres <= CLOSED_WITHIN and share <= _PART_CLOSED
            return Judgement(closed, {"open_share": share, "opening_mm": 1e3 * metres})
        opening = _opening(now, self.object)
        return Judgement(opening <= CLOSED_WITHIN, {"opening_mm": 1e3 * opening})


class TurnedTo(OfObject):
    """The part of a scene's file is turned or slid to a share of its way from where it rests.

    Attributes:
        object: Id.
        share: Of its way, 0 to 1.
        within: Most that it may be off, as a share.
    """

    kind: Literal["turned_to"]
    kinds: ClassVar[frozenset[str]] = frozenset({"part"})
    share: Fraction
    within: Positive = 0.1

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Read how far it has gone."""
        del start
        gone = part_travel(now.objects[self.object])
        share = -1.0 if gone is None else gone[0]
        return Judgement(abs(share - self.share) <= self.within, {"share": share, "wanted": self.share})


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

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Read the most that was felt."""
        del start
        felt = now.objects[self.object].felt
        return Judgement(self.min_n <= felt <= self.max_n, {"felt_n": felt})

    def settled(self, start: Truth, now: Truth) -> Iterator[str]:
        """Yield nothing: a ball that was touched may roll."""
        del start, now
        yield from ()


class AtHome(Check):
    """The arm is at its home configuration."""

    kind: Literal["at_home"]

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Compare joint by joint."""
        del start
        error = now.off_home
        return Judgement(error < HOME_TOLERANCE, {"home_error": error})


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

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Find the one that moved most."""
        names = [self.object] if self.object is not None else [n for n in start.objects if n not in (self.but or ())]
        if not names:
            return Judgement(True)
        ways = (centre(now.objects[name]) - centre(start.objects[name]) for name in names)
        most = max(float(np.linalg.norm(way)) for way in ways)
        return Judgement(1e3 * most <= self.max_mm, {"moved_mm": 1e3 * most, "max_mm": self.max_mm})


def on_table(now: Truth, name: str) -> Judgement:
    """Tell whether an object's lowest point is at the table's top."""
    clearance = form(now.objects[name]).low - now.table_height
    return Judgement(abs(clearance) < REST_WITHIN, {"clearance_mm": 1e3 * clearance})


def part_travel(item: ObjectTruth) -> tuple[float, float] | None:
    """Return by what share of its way a part is from its shut end, and how far its outermost point went, metres; None for others.

    Where it is shut the joint says.
    """
    joint = None if item.geometry is None else item.geometry.joint
    if joint is None or item.opening is None:
        return None
    shut, far = joint.shut, joint.far
    gone = item.opening - shut if far > shut else shut - item.opening
    span = abs(far - shut) if math.isfinite(far) else math.pi / 2.0
    lever = 1.0
    if joint.kind == "hinge":
        points = np.vstack([one.points for one in item.solids]) - np.array(joint.anchor)
        lever = float(np.linalg.norm(np.cross(points, np.array(joint.axis)), axis=1).max())
    return gone / span if span else 0.0, gone * lever


def _opening(truth: Truth, name: str) -> float:
    opening = truth.objects[name].opening
    if opening is None:
        raise InputError(f"success.object: {name!r}: this world does not report how far it is open")
    return opening
