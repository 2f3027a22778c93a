"""Checks on simulated truth of where on the table an object stands."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from robosandbox.tasks.judge.bodies import centre, form
from robosandbox.tasks.judge.checks import REST_WITHIN, TABLE, OfObject, Pair, on_table
from robosandbox.tasks.judge.finding import Judgement
from robosandbox.tasks.judge.support import rests_on, touched
from robosandbox.types import Positive, Truth


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

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Compare its centre, seen from above, with the point, and what it rests on with the table."""
        del start
        there = now.objects[self.object]
        off = math.dist(centre(there)[:2], (self.x, self.y))
        turned = 0.0 if self.yaw is None else abs(math.remainder(there.pose.yaw - self.yaw, math.tau))
        held = touched(now, self.object)
        rests = on_table(now, self.object).holds and rests_on(now, self.object, TABLE)
        holds = 1e3 * off <= self.max_mm and turned <= self.max_turn and rests and not held
        detail = {"off_mm": 1e3 * off, "turned_rad": turned, "within_mm": self.max_mm, "touched": float(held)}
        return Judgement(holds, detail)


class InPlaceOf(Pair):
    """The object stands where the target stood at the start, and was let go of."""

    kind: Literal["in_place_of"]
    max_mm: Positive = 20.0

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Compare where the target was with where the object is, seen from above, and what their lowest points rest at."""
        was, there = start.objects[self.target], now.objects[self.object]
        off = float(np.linalg.norm((centre(there) - centre(was))[:2]))
        step = abs(form(there).low - form(was).low)
        held = touched(now, self.object)
        holds = 1e3 * off <= self.max_mm and step < REST_WITHIN and not held
        return Judgement(holds, {"off_mm": 1e3 * off, "within_mm": self.max_mm, "touched": float(held)})
