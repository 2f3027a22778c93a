"""What is remembered from look to look: the same thing keeps its name while it is moved, hidden or held."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from robosandbox.perception.colour import colour_name
from robosandbox.perception.drawers import opened
from robosandbox.perception.familiar import Known
from robosandbox.perception.fit import Fit, Prior, cost_of, fit
from robosandbox.perception.naming import Declared, colour_difference, extents, invented, names_for
from robosandbox.perception.recognize import Thing, aligned, described
from robosandbox.perception.relations import inside
from robosandbox.perception.scenery import Scenery
from robosandbox.types import CONTAINER_KINDS, CONTAINER_WALL, Array, DetectedObject, ObjectKind, Pose

_GATE = 0.05
_COLOUR_GATE = 30.0
_SIZE_GATE = 0.45
_STILL = 0.004
_AS_CLEAR = 0.8
_EXPLAINED = 0.7
_AS_WELL = 0.25
_WORSE = 0.5
_KNOWN_SIZE = 0.001
_CONTAINER_SIZE = 0.0001
_REFITTED = 0.5
_MOST_LOOKS = 6
_SEEN_THROUGH = 0.03
_SHARE_THROUGH = 0.6
_ALL_THROUGH = 0.95
_FADING = 0.97
_LEAST_CONFIDENCE = 0.15
_STRANGER_CONFIDENCE = 0.25
_AT_HAND = 0.06
_FALLEN = 0.4
# Too little to be acted on, or to be claimed.
_MAYBE = 0.25
_PIECE = 0.01
_SURELY = 0.6
_CLEARLY = 0.9
_AS_MUCH = 0.9
_ANOTHER_SIZE = 0.3
_SURELY_ANOTHER_SIZE = 0.15
_FAR_BETTER = 1.5
_SLID = 0.0005


@dataclass(slots=True, eq=False)
class Track:
    """A thing over time.

    Attributes:
        id: Its name.
        thing: As seen best or last.
        looks: How many looks its present place is an average of.
        hidden: Whether the last look did not show it.
        confidence: 0..1.
        tangents: How many its size is told by; 0 while it was not clearly seen.
    """

    id: str
    thing: Thing
    looks: int = 1
    hidden: bool = False
    confidence: float = 1.0
    tangents: int = 0

    def __post_init__(self) -> None:
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
        )


@dataclass
class Tracker:
    """All that is remembered.

    Args:
        declared: What the task's objects are called and look like.

    Attributes:
        tracks: By id.
    """

    declared: Sequence[Declared] = ()
    tracks: dict[str, Track] = field(default_factory=dict)

    def hulls(self, held: str | None) -> list[tuple[ObjectKind, Fit]]:
        """Return the kinds and outer hulls of the containers that stand where they were seen, without the held one."""
        return [
            (track.thing.kind, track.thing.fit)
            for track in self.tracks.values()
            if track.thing.kind in CONTAINER_KINDS - {"drawer"} and track.id != held and track.confidence > _SURELY
        ]

    def solids(self, held: str | None) -> list[Known]:
        """Return the solid upright things that were clearly seen once, without the held one."""
        return [
            Known(track.thing.fit, track.thing.group, track.tangents)
            for track in self.tracks.values()
            if track.thing.kind not in CONTAINER_KINDS
            and track.thing.fit.lean is None
            and track.id != held
            and track.tangents > 0
        ]

    def rename(self, old: str, new: str) -> None:
        """Call a remembered thing something else; the new name must be free."""
        track = self.tracks.pop(old)
        track.id = new
        self.tracks[new] = track

    def update(self, things: Sequence[Thing], scenery: Scenery, held: str | None, hand: Array) -> None:
        """Take a look's things: known ones are recognized by place, then by appearance, new ones get names.

        Args:
            things: What the look shows, without the held one.
            scenery: The look.
            held: Id of what is in the gripper, which moves with it and is left alone.
            hand: The TCP, (3,); between fingers a thing shows pieces that are no things of their own.
        """
        free = [track for track in self.tracks.values() if track.id != held]
        pairs = _assign(free, things, near=True)
        left = [track for track in free if track.id not in {track.id for track, _ in pairs}]
        new = [thing for thing in things if not any(thing is known for _, known in pairs)]
        gone = [track for track in left if seen_through(track.thing, scenery)]
        moved = _assign(gone, new, near=False)
        new = [thing for thing in new if not any(thing is known for _, known in moved)]
        named = self._declared(new)
        new = [thing for thing in new if not any(thing is known for _, known in named)]
        # What nobody has described, and looks like something out of sight, is that.
        hidden = [track for track in left if not any(track is known for known, _ in moved) and track not in gone]
        back = _assign(hidden, new, near=False)
        drawers = [(replace(track), track.thing.opening) for track in free if track.thing.opening is not None]
        for track, thing in (*pairs, *moved, *back):
            _renew(track, thing)
        seen = {track.id for track, _ in (*moved, *back)}
        for track in left:
            if track.id in seen:
                continue
            if track in gone:
                if not self._falls_into_something(track):
                    del self.tracks[track.id]
            else:
                track.hidden = True
                track.confidence *= _FADING
        unseen = [track for track in free if track.hidden and track.id in self.tracks]
        for before, opening in drawers:
            now = self.tracks[before.id].thing.opening if before.id in self.tracks else None
            slide_contents(before, (opening if now is None else now) - opening, unseen)
        for name, thing in named:
            known = next(item for item in self.declared if item.id == name)
            self.tracks[name] = Track(name, as_described(thing, known.size), confidence=thing.confidence)
        for thing in new:
            if thing.confidence >= _STRANGER_CONFIDENCE and not any(thing is known for _, known in back):
                close = float(np.linalg.norm(thing.fit.centre - hand)) < _AT_HAND
                if close or any(_is_part(thing, track.thing) for track in self.tracks.values()):
                    continue
                if self._is_known_inside(thing):
                    continue
                r, g, b = (float(value) for value in thing.rgb)
                name = invented(colour_name((r, g, b)), thing.kind, self.tracks)
                self.tracks[name] = Track(name, thing, confidence=thing.confidence)

    def _is_known_inside(self, thing: Thing) -> bool:
        """Tell whether a new thing lies in a container with something of its colour that is known to be there, and hidden."""
        for vessel in self.tracks.values():
            if vessel.thing.kind in CONTAINER_KINDS and _lies_in(thing.fit.centre, vessel.thing):
                for other in self.tracks.values():
                    alike = colour_difference(other.thing.rgb, thing.rgb) < _COLOUR_GATE
                    if (
                        other is not vessel
                        and other.hidden
                        and alike
                        and _lies_in(other.thing.fit.centre, vessel.thing)
                    ):
                        return True
        return False

    def _falls_into_something(self, track: Track) -> bool:
        """Take a thing that vanished over a container to lie in it, not very surely; say whether there is one."""
        for other in self.tracks.values():
            vessel = other.thing
            if other is track or vessel.kind not in CONTAINER_KINDS:
                continue
            if not _lies_in(track.thing.fit.centre, vessel):
                continue
            between = track.thing.fit.bottom < vessel.fit.top
            height = vessel.fit.bottom + CONTAINER_WALL + (track.thing.fit.top - track.thing.fit.bottom) / 2.0
            drop = np.array([0.0, 0.0, height - float(track.thing.fit.centre[2])])
            pose = Pose.from_matrix(track.thing.pose.position + drop, track.thing.pose.rotation)
            moved = replace(track.thing.fit, centre=track.thing.fit.centre + drop)
            track.thing = replace(track.thing, pose=pose, fit=moved)
            track.hidden = True
            # Let go between the walls it can hardly be elsewhere; from over the rim it may have missed.
            track.confidence = min(track.confidence, _FALLEN if between else _MAYBE)
            return True
        return False

    def _declared(self, things: Sequence[Thing]) -> list[tuple[str, Thing]]:
        """Return the things that fit what the task describes and has not been seen yet, with the names."""
        sure = [thing for thing in things if thing.confidence >= _LEAST_CONFIDENCE]
        names = names_for([(thing.kind, thing.size, thing.rgb) for thing in sure], self.declared, self.tracks)
        return [(name, thing) for name, thing in zip(names, sure, strict=True) if name is not None]


def carry(track: Track, pose: Pose) -> None:
    """Take a thing to be somewhere else than it was seen."""
    shift = pose.position - track.thing.pose.position
    moved = replace(track.thing.fit, centre=track.thing.fit.centre + shift)
    track.thing = replace(track.thing, pose=pose, fit=moved)


def slide_contents(drawer: Track, out: float, tracks: Iterable[Track]) -> None:
    """Move what lies in a drawer with it, so far farther out, metres."""
    if abs(out) < _SLID:
        return
    box = drawer.detected()
    for track in tracks:
        if track.thing.kind != "drawer" and inside(track.detected(), box).holds:
            pose = track.thing.pose
            carry(track, Pose.from_matrix(pose.position - out * box.pose.rotation[:, 0], pose.rotation))


def _lies_in(place: Array, vessel: Thing) -> bool:
    """Tell whether a place (3,) is within a container's walls, seen from above."""
    local = vessel.fit.axes.T @ (place - vessel.fit.centre)
    room = vessel.fit.sizes[:2] if vessel.fit.shape == "box" else vessel.fit.sizes[[0, 0]]
    return bool((np.abs(local[:2]) < room).all())


def as_described(thing: Thing, size: tuple[float, ...]) -> Thing:
    """Return a drawer with the measures that the task gives: how far it opens cannot be seen, and how deep it is hardly."""
    if thing.kind != "drawer" or len(size) != len(thing.size):
        return thing
    total = thing.size[1] + (thing.opening or 0.0)
    depth = min(size[1], total)
    back = thing.fit.centre + thing.fit.sizes[0] * thing.fit.axes[:, 0]
    centre = back - depth / 2.0 * thing.fit.axes[:, 0]
    hull = replace(thing.fit, centre=centre, sizes=np.array([depth, size[0], size[2]]) / 2.0)
    pose = Pose.from_matrix(np.array([*centre[:2], thing.pose.xyz[2]]), thing.pose.rotation)
    return replace(thing, fit=hull, size=size, pose=pose, opening=opened(size, total))


def _renew(track: Track, thing: Thing) -> None:
    """Take a new look at a known thing: averaged with the last ones while it lies still."""
    old = track.thing
    track.hidden = False
    if old.kind == "drawer" and thing.kind == "drawer":
        total = thing.size[1] + (thing.opening or 0.0)
        track.thing = replace(old, opening=opened(old.size, total), group=thing.group, seen=thing.seen)
        track.confidence = max(thing.confidence, track.confidence * _FADING)
        return
    if old.kind == "drawer" or (old.kind in CONTAINER_KINDS and thing.kind not in CONTAINER_KINDS):
        # A container half hidden shows a wall or two; that it is one is known.
        track.confidence = max(track.confidence * _FADING, thing.confidence)
        return
    clearly = thing.kind == old.kind and thing.confidence > _AS_CLEAR * old.confidence
    if not clearly or float(np.linalg.norm(old.fit.centre - thing.fit.centre)) > _STILL:
        unmoved = cost_of(old.fit, thing.seen)
        free = thing
        if unmoved > max(_EXPLAINED, free.fit.cost + _AS_WELL):
            thing = free if clearly and not _changed(track, free) else _with_known_size(free, old)
        if unmoved <= max(_EXPLAINED, thing.fit.cost + _AS_WELL):
            # Half hidden it may look like something else; what was known explains it as well, where it was.
            track.confidence = max(track.confidence * _FADING, free.confidence)
            return
        if _changed(track, thing) and _is_seen_no_better(track, thing):
            # Things do not grow or shrink; with no better a view this is a wrong one.
            track.confidence *= _FADING
            return
        found = aligned(thing.fit, old.fit)
        size, pose = described(thing.kind, found)
        track.thing = replace(thing, fit=found, size=size, pose=pose)
        track.looks, track.confidence = 1, thing.confidence
        if not _same_size(old, found):
            track.tangents = _tangents(thing)
        return
    share = thing.confidence / (thing.confidence + min(track.looks, _MOST_LOOKS) * max(old.confidence, 0.05))
    track.looks += 1
    seen = aligned(thing.fit, old.fit)
    better = seen if thing.confidence > old.confidence else old.fit
    # Half hidden it tells where it is; how large it is has been seen better.
    sized = share if _tangents(thing) >= _AS_MUCH * track.tangents else 0.0
    if seen.shape == old.fit.shape:
        better = replace(
            better,
            centre=(1.0 - share) * old.fit.centre + share * seen.centre,
            sizes=(1.0 - sized) * old.fit.sizes + sized * seen.sizes,
            yaw=(1.0 - share) * old.fit.yaw + share * seen.yaw,
        )
    if sized:
        track.tangents = max(track.tangents, _tangents(thing))
    size, pose = described(old.kind, better)
    track.confidence = max(thing.confidence, (1.0 - share) * track.confidence + share * thing.confidence)
    track.thing = replace(thing, size=size, pose=pose, fit=better, rgb=(1.0 - share) * old.rgb + share * thing.rgb)


def _tangents(thing: Thing) -> int:
    """Return how many tangents tell a thing's size; 0 for one not clearly seen."""
    return len(thing.seen.rows.values) if thing.confidence > _CLEARLY else 0


def _same_size(old: Thing, new: Fit) -> bool:
    return new.shape == old.fit.shape and float(np.abs(new.sizes - old.fit.sizes).max()) < _KNOWN_SIZE


def _changed(track: Track, thing: Thing) -> bool:
    """Tell whether a thing that was clearly seen is now seen with quite another size, or as quite another thing."""
    old = track.thing
    ratio = float(np.abs(np.log(extents(old.kind, old.size) / extents(thing.kind, thing.size))).max())
    if track.tangents > 0 and (thing.kind != old.kind or ratio > _SURELY_ANOTHER_SIZE):
        return True
    if thing.kind in CONTAINER_KINDS and _tangents(thing) < _AS_MUCH * track.tangents:
        # It was known by walls all around; what is seen less well may tell where it is, not how large.
        return not _same_size(old, thing.fit)
    return old.confidence > _SURELY and ratio > _ANOTHER_SIZE


def _is_seen_no_better(track: Track, thing: Thing) -> bool:
    best = max(track.tangents, len(track.thing.seen.rows.values))
    return len(thing.seen.rows.values) < _FAR_BETTER * best


def _is_part(thing: Thing, known: Thing) -> bool:
    """Tell whether a new thing is but a piece of a known one, cut off by what stands before it."""
    if colour_difference(thing.rgb, known.rgb) > _COLOUR_GATE:
        return False
    half = known.fit.sizes
    if known.fit.shape != "box":
        half = np.array([half[0], half[0], half[-1]])
    local = (thing.group.points - known.fit.centre) @ known.fit.axes
    if known.opening is not None:
        # What has slid out of a drawer's front is of it too.
        local[:, 0] += known.opening * np.clip(-local[:, 0] / half[0], 0.0, 1.0)
    local = np.abs(local)
    return bool((local < half + _PIECE).all(axis=1).mean() > 0.6)


def _with_known_size(thing: Thing, old: Thing) -> Thing:
    """Return a badly seen thing fitted anew with the shape and size that are known, if that explains it."""
    hollow = old.kind in CONTAINER_KINDS, thing.kind in CONTAINER_KINDS
    if hollow[0] != hollow[1] or _same_size(old, thing.fit):
        return thing
    prior = Prior(old.fit.sizes, _CONTAINER_SIZE if all(hollow) else _KNOWN_SIZE)
    found = fit(old.fit.shape, thing.seen, thing.resting, prior)
    if found is None or found.cost > thing.fit.cost + _WORSE:
        return thing
    size, pose = described(old.kind, found)
    return replace(thing, kind=old.kind, fit=found, size=size, pose=pose, confidence=max(thing.confidence, _REFITTED))


def _assign(tracks: Sequence[Track], things: Sequence[Thing], *, near: bool) -> list[tuple[Track, Thing]]:
    """Return which track each thing continues, all at once at the least total difference."""
    if not tracks or not things:
        return []
    costs = np.array([[_unlike(track.thing, thing, near=near) for thing in things] for track in tracks])
    rows, columns = linear_sum_assignment(np.minimum(costs, 10.0))
    return [(tracks[r], things[c]) for r, c in zip(rows, columns, strict=True) if costs[r, c] < 1.0]


def _unlike(old: Thing, new: Thing, *, near: bool) -> float:
    """Return how different two looks at a thing are: below 1 they may be of the same."""
    distance = float(np.linalg.norm(old.fit.centre - new.fit.centre))
    colour = colour_difference(old.rgb, new.rgb) / _COLOUR_GATE
    size = float(np.abs(np.log(extents(old.kind, old.size) / extents(new.kind, new.size))).mean()) / _SIZE_GATE
    if near:
        # What was clearly seen to be solid does not become hollow where it stands.
        changed = new.kind in CONTAINER_KINDS and old.kind not in CONTAINER_KINDS and old.confidence > _SURELY
        return max(distance / _GATE, 0.7 * colour, 0.3 * size) + (1.0 if changed else 0.0)
    return max(colour, size) + (0.0 if old.kind == new.kind else 0.4) + 0.2 * distance


def seen_through(thing: Thing, scenery: Scenery) -> bool:
    """Tell whether some view shows what lies behind the place where a thing was."""
    centre, axes, sizes = thing.fit.centre, thing.fit.axes, thing.fit.sizes
    half = np.array([sizes[0], sizes[min(1, len(sizes) - 1)], sizes[-1]])
    if thing.fit.shape in ("cylinder", "lying"):
        half = np.array([sizes[0], sizes[0], sizes[1]])
    # One looks into a container, and at no more than two of its walls.
    walls = thing.kind in CONTAINER_KINDS
    across, heights = ((-0.97, 0.0, 0.97), (0.3,)) if walls else ((-0.5, 0.0, 0.5), (-0.3, 0.3))
    corners = np.array([[x, y, z] for x in across for y in across for z in heights if x or y or not walls])
    points = centre + (corners * half) @ axes.T
    for look in scenery.looks.values():
        pixels, expected = look.view.project(points)
        columns, rows = np.rint(pixels).astype(int).T
        height, width = look.view.depth.shape
        inside = (columns >= 0) & (rows >= 0) & (columns < width) & (rows < height) & (expected > 0.0)
        columns, rows = columns[inside], rows[inside]
        measured = look.view.depth[rows, columns]
        clear = look.view.valid[rows, columns] & ~look.robot[rows, columns]
        if clear.sum() < len(points) // 2:
            continue
        # The table is as far behind as the thing is high, along the ray.
        behind = measured[clear] - expected[inside][clear] > min(_SEEN_THROUGH, 0.7 * float(half.min()))
        if behind.mean() > (_ALL_THROUGH if walls else _SHARE_THROUGH):
            return True
    return False
