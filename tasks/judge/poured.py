"""The check that what was in one container is in another."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from robosandbox.tasks.judge.checks import HOLDERS, Check, Reference
from robosandbox.tasks.judge.containment import contents, vessel
from robosandbox.tasks.judge.finding import Judgement
from robosandbox.types import Fraction, Truth

# Share that sums of whole things may be off by; chosen far below one thing in a thousand.
_ROUNDING = 1e-9


class Poured(Check):
    """Contents of one container are in another.

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
        yield "object", self.object, HOLDERS
        yield "target", self.target, HOLDERS

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Count where the contents are, each bead for itself; nothing inside at the start is nothing poured."""
        source, target = (vessel(now.objects[name], HOLDERS) for name in (self.object, self.target))
        others = [item for name, item in start.objects.items() if name not in (self.object, self.target)]
        poured = contents(others, vessel(start.objects[self.object], HOLDERS))
        there = [now.objects[name] for name in {name: None for name, _ in poured} if name in now.objects]
        arrived, stayed = ({*contents(there, each)} for each in (target, source))
        count = len(poured)
        came = sum(one in arrived for one in poured)
        left = sum(one in stayed and one not in arrived for one in poured)
        fraction, spilled = came / max(count, 1), (count - came - left) / max(count, 1)
        # Fractions of whole things: 0.02 of 50 is 1, whatever the last bit says.
        holds = count > 0 and fraction >= self.min_fraction - _ROUNDING and spilled <= self.max_spilled + _ROUNDING
        return Judgement(holds, {"fraction": fraction, "spilled": spilled, "count": float(count)})
