"""Data association: which things of a look are which that are remembered, by tags, by place, or by what they look like."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from robosandbox.perception.naming import Declared, colour_difference
from robosandbox.perception.thing import Thing
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.perception.track import Track
from robosandbox.values import frozen

# Distances, colours and sizes are counted in units; below 1 unit two looks may be at the same thing, which may have been
# pushed: metres.
_GATE = 25.0 * TOLERANCES.position
COLOUR_GATE = 30.0  # CIELAB distance of colours (CIE76) that is one unit. Chosen.
_SIZE_GATE = 0.45  # Mean logarithm of the ratio of sizes that is one unit. Chosen: 1.57 times as large.
# A difference that no pair may have, as a number of units. Chosen far above 1.
_WORST = 10.0


@frozen
class TagNumbers:
    """The numbers that the task describes.

    Attributes:
        by_id: Number of each object described with a tag.
        owners: Id of the object described with each number.
    """

    by_id: Mapping[str, int] = field(default_factory=dict)
    owners: Mapping[int, str] = field(default_factory=dict)

    @classmethod
    def of(cls, declared: Iterable[Declared]) -> TagNumbers:
        """Return what descriptions say."""
        tagged = [(item.id, item.tag) for item in declared if item.tag is not None]
        return cls(dict(tagged), {number: name for name, number in tagged})

    def on(self, track: Track) -> int | None:
        """Return the number on a thing, as read, else as described."""
        return self.by_id.get(track.id) if track.tag is None else track.tag

    def owner(self, thing: Thing) -> str | None:
        """Return the id of the object described with the number that was read on a thing."""
        return None if thing.tag is None else self.owners.get(thing.tag)

    def differ(self, track: Track, thing: Thing) -> bool:
        """Tell whether a thing cannot be a known one because of the number on it."""
        known = self.on(track)
        return thing.tag is not None and known is not None and thing.tag != known

    def sure(self, tracks: Sequence[Track], things: Iterable[Thing]) -> list[tuple[Track, Thing]]:
        """Return the known things whose number was read, each with what it was read on."""
        by_number = {self.on(track): track for track in sorted(tracks, key=lambda each: each.tag is not None)}
        return [(by_number[thing.tag], thing) for thing in things if thing.tag is not None and thing.tag in by_number]

    def assign(
        self, tracks: Sequence[Track], things: Sequence[Thing], *, near: bool = False
    ) -> list[tuple[Track, Thing]]:
        """Return which track each thing continues, all at once at the least total difference.

        Args:
            tracks: Known things.
            things: What a look shows.
            near: They are compared by place, colour and size, in this order; else by colour and size.
        """
        if not tracks or not things:
            return []

        def cost(track: Track, thing: Thing) -> float:
            return _unlike(track.thing, thing, near=near) + _WORST * self.differ(track, thing)

        costs = np.array([[cost(track, thing) for thing in things] for track in tracks])
        from scipy.optimize import linear_sum_assignment

        rows, columns = linear_sum_assignment(np.minimum(costs, _WORST))
        return [(tracks[r], things[c]) for r, c in zip(rows, columns, strict=True) if costs[r, c] < 1.0]


@dataclass
class Assignment:
    """Assignment of the things of a look to those that are remembered.

    Attributes:
        tracks: Remembered things that the look has not shown so far.
        things: Things of the look that are none of them so far.
        by_place: What is where it was, or has a number that was read.
        by_looks: What has turned up elsewhere.
        named: What the task describes and has not been seen before, with its id.
        gone: Of `tracks` those whose place is seen to be empty.
    """

    tracks: list[Track]
    things: list[Thing]
    by_place: list[tuple[Track, Thing]] = field(default_factory=list)
    by_looks: list[tuple[Track, Thing]] = field(default_factory=list)
    named: dict[Thing, str] = field(default_factory=dict)
    gone: list[Track] = field(default_factory=list)

    def settle(self, pairs: list[tuple[Track, Thing]]) -> list[tuple[Track, Thing]]:
        """Take pairs out of what is left, and return them."""
        tracks, things = {track for track, _ in pairs}, {thing for _, thing in pairs}
        self.tracks = [track for track in self.tracks if track not in tracks]
        self.things = [thing for thing in self.things if thing not in things]
        return pairs


def displaced(tracks: Iterable[Track], things: Iterable[Thing]) -> list[Track]:
    """Return the things known so far that cannot be where they were: something else with a number is there.

    Args:
        tracks: Known things that no thing of the look continues.
        things: What the look shows.
    """
    there = [thing for thing in things if thing.tag is not None]
    return [
        track
        for track in tracks
        if any(
            float(np.linalg.norm(track.thing.fit.centre - thing.fit.centre)) < float(min(thing.fit.half))
            for thing in there
        )
    ]


def _unlike(old: Thing, new: Thing, *, near: bool) -> float:
    """Return how different two looks at a thing are: below 1 they may be of the same."""
    distance = float(np.linalg.norm(old.fit.centre - new.fit.centre))
    colour = colour_difference(old.rgb, new.rgb) / COLOUR_GATE
    size = float(np.abs(np.log(old.shape.extents(old.size) / new.shape.extents(new.size))).mean()) / _SIZE_GATE
    if near:
        # A thing that was clearly seen to be solid does not become hollow where it stands.
        changed = new.shape.holds_things and not old.shape.holds_things and old.confidence > TOLERANCES.seen
        return max(distance / _GATE, 0.7 * colour, 0.3 * size) + (1.0 if changed else 0.0)
    return max(colour, size) + (0.0 if old.kind == new.kind else 0.4) + 0.2 * distance
