"""Containment test: walls all around a thing, a floor under it, and below the rim."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from robosandbox.errors import InputError
from robosandbox.tasks.judge.bodies import ConvexPieces, in_frame_of, own_form, single_beads
from robosandbox.tasks.judge.finding import Judgement
from robosandbox.tasks.judge.polygons import depth, surrounded
from robosandbox.types import Array, Convex, ObjectTruth

# Metres that a thing may sink into a floor, or a wall's foot stand out of it; chosen far above the 0.2 mm that contacts
# yield by and below the height of any wall here.
_GIVE = 0.005


class Vessel:
    """A container whose inside is asked about again and again; of a drawer its sliding box.

    Args:
        item: The container.
    """

    def __init__(self, item: ObjectTruth) -> None:
        self._item = item
        if not item.solids:
            # Says so.
            own_form(item)
        self._form = own_form(item, max(one.part for one in item.solids))

    def holds(self, item: ObjectTruth) -> Judgement:
        """Tell whether an object is inside: its middle between the walls, its lowest point below the rim and above the floor; in a drawer its middle too."""
        return self._holds(in_frame_of(item, self._item))

    def beads(self, item: ObjectTruth) -> list[int]:
        """Return the numbers of the beads that are inside."""
        return [k for k, bead in enumerate(single_beads(item)) if self._holds(self._own(bead)).holds]

    @cached_property
    def _tops(self) -> list[tuple[Array, float, float]]:
        """Each piece's outline seen along the axis, and its lowest and highest point along it, metres."""
        return [
            (seen, float(one.points[:, 2].min()) - one.radius, float(one.points[:, 2].max()) + one.radius)
            for one, seen in zip(self._form.pieces, self._form.outlines, strict=True)
        ]

    def _own(self, bead: Convex) -> ConvexPieces:
        rotation, origin = self._item.pose.rotation, self._item.pose.position
        return ConvexPieces((Convex(points=(bead.points - origin) @ rotation, radius=bead.radius),), self._item.id)

    def _holds(self, thing: ConvexPieces) -> Judgement:
        point, low = thing.middle[:2], thing.low
        below_rim = self._form.high - low
        detail = {"margin_mm": 1e3 * depth(self._form.outline, point), "below_rim_mm": 1e3 * below_rim}
        leans_out = self._item.opening is not None and float(thing.middle[2]) > self._form.high
        if detail["margin_mm"] <= 0.0 or leans_out:
            return Judgement(False, detail)
        over = [high for seen, _, high in self._tops if depth(seen, point) > 0.0]
        walls = [seen for seen, _, high in self._tops if high > low and depth(seen, point) <= 0.0]
        floored = any(high < low + _GIVE for high in over)
        return Judgement(floored and surrounded(point, walls), detail)


class Cupboard(Vessel):
    """A fixture with a cavity that is open to the side: what is in it has a board under it, another over it, and a wall beside it."""

    def _holds(self, thing: ConvexPieces) -> Judgement:
        point, low, high = thing.middle[:2], thing.low, thing.high
        under = [top for seen, _, top in self._tops if depth(seen, point) > 0.0 and abs(top - low) < _GIVE]
        over = [bottom for seen, bottom, _ in self._tops if depth(seen, point) > 0.0 and bottom > high - _GIVE]
        beside = [seen for seen, bottom, top in self._tops if bottom < high and top > low and depth(seen, point) <= 0.0]
        detail = {
            "margin_mm": 1e3 * depth(self._form.outline, point),
            "below_rim_mm": 1e3 * (min(over, default=low) - low),
        }
        return Judgement(detail["margin_mm"] > 0.0 and bool(under) and bool(over) and bool(beside), detail)


def vessel(item: ObjectTruth, holders: frozenset[str]) -> Vessel:
    """Return a container as one.

    Args:
        item: The container.
        holders: The kinds that things can be put into.

    Raises:
        InputError: Nothing can be put into it, or the world does not tell what it is made of.
    """
    if item.kind not in holders:
        raise InputError(f"success.target: {item.id!r} is a {item.kind}; only {', '.join(sorted(holders))} hold things")
    return Cupboard(item) if item.kind == "cupboard" else Vessel(item)


def contents(objects: list[ObjectTruth], container: Vessel) -> list[tuple[str, int]]:
    """Return the ids of what lies in a container, each with the number of its bead; 0 for what is no beads."""
    found: list[tuple[str, int]] = []
    for item in objects:
        if item.grains:
            found += [(item.id, k) for k in container.beads(item)]
        elif np.all(np.isfinite(item.pose.position)) and container.holds(item).holds:
            found.append((item.id, 0))
    return found
