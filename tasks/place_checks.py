"""Checks on simulated truth of where on the table an object stands."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

import numpy as np

from robosandbox.tasks.checks import Check, OfObject, Reference, seen
from robosandbox.types import Positive, Truth
from robosandbox.world import relations
from robosandbox.world.relations import Relation


class At(OfObject):
    """The object stands on the table at a point, and was let go of.

    Attributes:
        x: Of its centre, metres.
        y: Of its centre, metres.
        yaw: Its heading, radians; None leaves it open.
        max_mm: Most that it may be off, millimetres.
        max_turn: Most that its heading may be off, radians.
    """

    kind: Literal["at"]
    x: float
    y: float
    yaw: float | None = None
    max_mm: Positive = 15.0
    max_turn: Positive = math.radians(10.0)

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Compare its centre, seen from above, with the point, and what it rests on with the table."""
        del start
        there = seen(now, self.object)
        off = math.dist(relations.centre(there)[:2], (self.x, self.y))
        turned = 0.0 if self.yaw is None else abs(math.remainder(there.pose.yaw - self.yaw, math.tau))
        touched = "robot" in now.objects[self.object].contacts
        rests = relations.on_table(there, now.table_height).holds
        holds = 1e3 * off <= self.max_mm and turned <= self.max_turn and rests and not touched
        detail = {"off_mm": 1e3 * off, "turned_rad": turned, "within_mm": self.max_mm, "touched": float(touched)}
        return Relation(holds, detail)


class InPlaceOf(Check):
    """The object stands where the target stood at the start, and was let go of."""

    kind: Literal["in_place_of"]
    object: str
    target: str
    max_mm: Positive = 20.0

    def references(self) -> Iterator[Reference]:
        """Return the objects that the check names."""
        yield "object", self.object, frozenset()
        yield "target", self.target, frozenset()

    def evaluate(self, start: Truth, now: Truth) -> Relation:
        """Compare where the target was with where the object is, seen from above, and what their lowest points rest at."""
        was, there = seen(start, self.target), seen(now, self.object)
        off = float(np.linalg.norm((relations.centre(there) - relations.centre(was))[:2]))
        step = abs(relations.bottom(there) - relations.bottom(was))
        touched = "robot" in now.objects[self.object].contacts
        holds = 1e3 * off <= self.max_mm and step < relations.REST_TOLERANCE and not touched
        return Relation(holds, {"off_mm": 1e3 * off, "within_mm": self.max_mm, "touched": float(touched)})
