"""Data association by tags: a number that was read settles which object it is, whatever it looks like and wherever it lies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from robosandbox.perception.naming import Declared
from robosandbox.perception.recognize import Thing
from robosandbox.perception.track import Track


@dataclass(frozen=True, slots=True)
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
