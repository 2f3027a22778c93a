"""A thing over time: what a new look at it changes about what was known."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from robosandbox.perception.colour import colour_name
from robosandbox.perception.drawers import opened
from robosandbox.perception.fit import Fit, Prior, cost_of, fit
from robosandbox.perception.shape_prior import AS_MUCH
from robosandbox.perception.thing import Thing, aligned, size_and_pose
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.types import DetectedObject, Pose

_STILL = 2.0 * TOLERANCES.position  # Metres that a thing may seem to move and lie still.
_AS_CLEAR = 0.8  # Share of the confidence before with which a look is as clear. Chosen.
# Cost up to which what is known explains a look (units: mean squared residual over standard deviation). Chosen.
_EXPLAINED = 0.7
# Cost by which it may explain it worse than what is new (units: mean squared residual over standard deviation). Chosen.
AS_WELL = 0.25
# Cost by which a known size may explain a look worse than any other (units: mean squared residual over standard deviation).
# Chosen.
_WORSE = 0.5
_KNOWN_SIZE = TOLERANCES.size  # Standard deviation of a known size, metres, and by how much equal sizes differ.
_CONTAINER_SIZE = 0.0001  # The same of a container, metres: walls of which parts are seen would stretch it. Chosen.
_REFITTED = 0.5
_MOST_LOOKS = 6  # Number of looks that an average remembers, so that a slow change still shows. Chosen.
_LEAST_WEIGHT = 0.05  # Weight, a probability, that a look which was not sure keeps in an average. Chosen.
# Factor by which confidence falls with each look that does not show a thing. Chosen: it is halved in 23 looks.
FADING = 0.97
# Logarithm of the ratio of sizes from which a surely seen thing looks like another, a factor of 1.35. Chosen.
_ANOTHER_SIZE = 0.3
_SURELY_ANOTHER_SIZE = 0.15  # The same of one whose size was clearly seen, a factor of 1.16. Chosen.
_FAR_BETTER = 1.5  # Ratio of tangents from which a look is far better. Chosen.
_GLIMPSE = 0.5  # Share of the confidence before below which a look is a glimpse. Chosen.


@dataclass(slots=True, eq=False)
class Track:
    """A thing over time.

    Attributes:
        id: Its name.
        thing: As seen best or last.
        looks: How many looks its present place is an average of.
        hidden: Whether the last look did not show it.
        confidence: 0..1.
        tag: Number of the tag that was last read on it; None before any was.
        tangents: How many its size is told by; 0 while it was not clearly seen.
    """

    id: str
    thing: Thing
    looks: int = 1
    hidden: bool = False
    confidence: float = 1.0
    tag: int | None = None
    tangents: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        self.tag = self.thing.tag
        self.tangents = _tangents(self.thing)

    def detected(self) -> DetectedObject:
        """Return it in the planner's words."""
        r, g, b = (float(value) for value in self.thing.rgb)
        return DetectedObject(
            id=self.id,
            kind=self.thing.kind,
            size=self.thing.size,
            colour=colour_name((r, g, b)),
            rgba=(r, g, b, 1.0),
            pose=self.thing.pose,
            confidence=round(self.confidence, 3),
            opening=self.thing.opening,
            tag=self.tag,
        )

    def carry(self, pose: Pose) -> None:
        """Take it to be somewhere else than it was seen."""
        shift = pose.position - self.thing.pose.position
        moved = replace(self.thing.fit, centre=self.thing.fit.centre + shift)
        self.thing = replace(self.thing, pose=pose, fit=moved)


def update_from(track: Track, thing: Thing) -> None:
    """Take a new look at a known thing: averaged with the last ones while it lies still."""
    old = track.thing
    track.hidden = False
    track.tag = track.tag if thing.tag is None else thing.tag
    if old.shape.opens and thing.shape.opens:
        total = thing.size[1] + (thing.opening or 0.0)
        track.thing = replace(old, opening=opened(old.size, total), group=thing.group, seen=thing.seen)
    if not thing.shape.size_fields:
        # The whole of a mesh is laid on what is seen of it: no average tells more.
        track.thing, track.confidence = thing, max(track.confidence, thing.confidence)
        return
    if not old.shape.size_fields:
        # Half covered it looks like something else.
        track.confidence = max(track.confidence * FADING, thing.confidence)
        return
    if old.shape.opens or (old.shape.holds_things and not thing.shape.holds_things):
        # A container half hidden shows a wall or two; that it is one is known.
        track.confidence = max(track.confidence * FADING, thing.confidence)
    elif _is_as_clear(old, thing) and float(np.linalg.norm(old.fit.centre - thing.fit.centre)) <= _STILL:
        _average(track, thing)
    else:
        _look_anew(track, thing)


def _is_as_clear(old: Thing, thing: Thing) -> bool:
    """Tell whether a look shows a thing as what it was, about as surely."""
    return thing.kind == old.kind and thing.confidence > _AS_CLEAR * old.confidence


def _look_anew(track: Track, thing: Thing) -> None:
    """Take a look that shows a thing elsewhere, less clearly, or as something else, unless what is known explains it as well."""
    old = track.thing
    unmoved = cost_of(old.fit, thing.seen)
    found = thing
    if unmoved > max(_EXPLAINED, thing.fit.cost + AS_WELL) and (not _is_as_clear(old, thing) or _changed(track, thing)):
        found = _with_known_size(thing, old)
    if unmoved <= max(_EXPLAINED, found.fit.cost + AS_WELL):
        # Half hidden it may look like something else; what was known explains it as well, where it was.
        track.confidence = max(track.confidence * FADING, thing.confidence)
        return
    # Things do not grow or shrink: with no better a view another size is a wrong one. A corner of it that shows among others
    # tells that it is there, and less well than was known where.
    if (_changed(track, found) and _is_seen_no_better(track, found)) or _is_partial_view(track, found):
        track.confidence *= FADING
        return
    place = aligned(found.fit, old.fit)
    size, pose = size_and_pose(found.kind, place)
    track.thing = replace(found, fit=place, size=size, pose=pose)
    track.looks, track.confidence = 1, found.confidence
    if not _same_size(old, place):
        track.tangents = _tangents(found)


def _average(track: Track, thing: Thing) -> None:
    """Average a look with those before, each weighted by how clearly it shows the thing."""
    old = track.thing
    share = thing.confidence / (thing.confidence + min(track.looks, _MOST_LOOKS) * max(old.confidence, _LEAST_WEIGHT))
    track.looks += 1
    seen = aligned(thing.fit, old.fit)
    better = seen if thing.confidence > old.confidence else old.fit
    # Half hidden it tells where it is; how large it is has been seen better.
    sized = share if _tangents(thing) >= AS_MUCH * track.tangents else 0.0
    if seen.shape == old.fit.shape:
        better = replace(
            better,
            centre=(1.0 - share) * old.fit.centre + share * seen.centre,
            sizes=(1.0 - sized) * old.fit.sizes + sized * seen.sizes,
            yaw=(1.0 - share) * old.fit.yaw + share * seen.yaw,
        )
    if sized:
        track.tangents = max(track.tangents, _tangents(thing))
    size, pose = size_and_pose(old.kind, better)
    track.confidence = max(thing.confidence, (1.0 - share) * track.confidence + share * thing.confidence)
    track.thing = replace(thing, size=size, pose=pose, fit=better, rgb=(1.0 - share) * old.rgb + share * thing.rgb)


def _tangents(thing: Thing) -> int:
    """Return how many tangents tell a thing's size; 0 for one not clearly seen."""
    return len(thing.seen.rows.values) if thing.confidence > TOLERANCES.clear else 0


def _same_size(old: Thing, new: Fit) -> bool:
    return new.shape == old.fit.shape and float(np.abs(new.sizes - old.fit.sizes).max()) < _KNOWN_SIZE


def _changed(track: Track, thing: Thing) -> bool:
    """Tell whether a thing that was clearly seen is now seen with quite another size, or as quite another thing."""
    old = track.thing
    ratio = float(np.abs(np.log(old.shape.extents(old.size) / thing.shape.extents(thing.size))).max())
    if track.tangents > 0 and (thing.kind != old.kind or ratio > _SURELY_ANOTHER_SIZE):
        return True
    if thing.shape.holds_things and _tangents(thing) < AS_MUCH * track.tangents:
        # It was known by walls all around; what is seen less well may tell where it is, not how large.
        return not _same_size(old, thing.fit)
    return old.confidence > TOLERANCES.seen and ratio > _ANOTHER_SIZE


def _is_partial_view(track: Track, thing: Thing) -> bool:
    """Tell whether a look shows a thing where it is known to be, but far less surely."""
    off = float(np.linalg.norm(track.thing.fit.centre - thing.fit.centre))
    return thing.confidence < _GLIMPSE * track.confidence and off < 0.5 * float(
        track.thing.shape.extents(track.thing.size).min()
    )


def _is_seen_no_better(track: Track, thing: Thing) -> bool:
    best = max(track.tangents, len(track.thing.seen.rows.values))
    return len(thing.seen.rows.values) < _FAR_BETTER * best


def _with_known_size(thing: Thing, old: Thing) -> Thing:
    """Return a badly seen thing fitted anew with the shape and size that are known, if that explains it."""
    hollow = old.shape.holds_things, thing.shape.holds_things
    if hollow[0] != hollow[1] or _same_size(old, thing.fit):
        return thing
    prior = Prior(old.fit.sizes, _CONTAINER_SIZE if all(hollow) else _KNOWN_SIZE)
    found = fit(old.fit.shape, thing.seen, thing.resting, prior)
    if found is None or found.cost > thing.fit.cost + _WORSE:
        return thing
    size, pose = size_and_pose(old.kind, found)
    return replace(thing, kind=old.kind, fit=found, size=size, pose=pose, confidence=max(thing.confidence, _REFITTED))
