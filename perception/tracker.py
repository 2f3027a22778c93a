"""Tracker of objects from look to look: a thing keeps its name while it is moved, hidden or held."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from robosandbox.perception.colour import colour_name
from robosandbox.perception.data_association import COLOUR_GATE, Assignment, TagNumbers, displaced
from robosandbox.perception.drawers import opened
from robosandbox.perception.fit import Fit
from robosandbox.perception.frames import FrameSet
from robosandbox.perception.free_space import has_left
from robosandbox.perception.naming import Declared, colour_difference, names_for, new_id
from robosandbox.perception.occlusion import is_its_contents, lies_in
from robosandbox.perception.shape_prior import KnownShape
from robosandbox.perception.thing import Thing
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.perception.track import FADING, Track, update_from
from robosandbox.shapes import CONTAINER_WALL
from robosandbox.types import Array, ObjectKind, Pose
from robosandbox.world.relations import inside

_LEAST_CONFIDENCE = 0.15  # Confidence, a probability, from which a described thing gets its name. Chosen.
_STRANGER_CONFIDENCE = 0.25  # The same probability for what nobody has described: nothing else speaks for it. Chosen.
_AT_HAND = 0.06  # Metres from the TCP within which new things are taken for pieces of what the hand covers. Chosen.
# Confidence, a probability, of a thing let go between a container's walls. Chosen: enough to be acted on.
_FALLEN = 0.4
# Confidence, a probability, of a thing let go over the rim: too little to be acted on, or to be claimed. Chosen.
_MAYBE = 0.25
_PIECE = 0.01  # Metres around a known thing within which most points of a piece of it lie. Chosen.
_SLID = 0.0005  # Metres of a drawer's motion below which its contents stay, because that is noise. Chosen.


@dataclass
class Tracker:
    """All that is remembered.

    Args:
        declared: What the task's objects are called and look like.

    Attributes:
        tracks: By id.
        lost: What was clearly seen once, is not where it was, and has not turned up elsewhere; by id.
        strangers: Ids of what nobody has described, each with the ids of all that was seen beside it.
        numbers: Of tags, as the task describes them.
    """

    declared: Sequence[Declared] = ()
    tracks: dict[str, Track] = field(default_factory=dict)
    lost: dict[str, Track] = field(default_factory=dict)
    strangers: dict[str, set[str]] = field(default_factory=dict)
    numbers: TagNumbers = field(init=False)

    def __post_init__(self) -> None:
        self.numbers = TagNumbers.of(self.declared)

    def hulls(self, held: Collection[str]) -> list[tuple[ObjectKind, Fit]]:
        """Return the kinds and outer hulls of the containers that stand where they were seen, without the held one."""
        return [
            (track.thing.kind, track.thing.fit)
            for track in self.tracks.values()
            if track.thing.shape.is_open_container and track.id not in held and track.confidence > TOLERANCES.seen
        ]

    def solids(self, held: Collection[str]) -> list[KnownShape]:
        """Return the solid upright things that were clearly seen once, without the held one."""
        return [
            KnownShape(track.thing.fit, track.thing.group, track.tangents, lost)
            for lost, tracks in ((False, self.tracks), (True, self.lost))
            for track in tracks.values()
            if not track.thing.shape.holds_things
            and track.thing.fit.lean is None
            and track.id not in held
            and track.tangents > 0
        ]

    def rename(self, old: str, new: str) -> None:
        """Call a remembered thing something else; the new name must be free."""
        track = self.tracks.pop(old)
        track.id = new
        self.tracks[new] = track

    def update(self, things: Sequence[Thing], frames: FrameSet, held: Collection[str], hands: Sequence[Array]) -> None:
        """Take a look's things: known ones are recognized by place, then by appearance, new ones get names.

        Args:
            things: What the look shows, without the held one.
            frames: The look.
            held: Ids of what is in grippers, which moves with them and is left alone.
            hands: The TCPs, each (3,); between fingers a thing shows pieces that are no things of their own.
        """
        known_before = frozenset(self.tracks)
        free = [track for track in self.tracks.values() if track.id not in held]
        found = self._match(free, things, frames)
        by_place = {track.id for track, _ in found.by_place}
        drawers = [replace(track) for track in free if track.thing.opening is not None and track.id not in by_place]
        for track, thing in (*found.by_place, *found.by_looks):
            # Half covered a container is seen amiss; what lies in it, and is seen where it lay, tells where it is.
            if is_its_contents(track, thing, found.by_place):
                track.confidence *= FADING
            else:
                update_from(track, thing)
        self._miss(found.tracks, found.gone)
        self._slide_contents(drawers, [track for track in free if track.hidden])
        sizes = {item.id: item.size for item in self.declared}
        for thing, name in found.named.items():
            self.tracks[name] = Track(name, as_described(thing, sizes[name]), confidence=thing.confidence)
        for thing in found.things:
            if self._is_strange(thing, hands, known_before):
                self._add_stranger(thing)
        self._recognize_strangers(held)
        for name in [name for name, track in self.lost.items() if name in self.tracks or track.tangents == 0]:
            del self.lost[name]

    def _match(self, tracks: Sequence[Track], things: Sequence[Thing], frames: FrameSet) -> Assignment:
        """Return which things these tracks are; what something with a number has displaced is lost."""
        found = Assignment(list(tracks), list(things))
        found.by_place = found.settle(self._recognized(found))
        self._rename_by_tag(found.by_place)
        # What lies in a drawer is where the drawer is now, before the look is asked whether it has left its place.
        for track, thing in found.by_place:
            was, now = track.thing.opening, thing.opening
            if was is not None and now is not None and not is_its_contents(track, thing, found.by_place):
                slide_contents(track, now - was, found.tracks)
        for track in displaced(found.tracks, things):
            self._lose(track)
            found.tracks.remove(track)
        found.gone = [track for track in found.tracks if has_left(track.thing, frames)]
        found.by_looks = found.settle(self.numbers.assign(found.gone, found.things))
        found.named = {thing: name for name, thing in self._declared(found.things)}
        found.things = [thing for thing in found.things if thing not in found.named]
        # A thing that nobody has described, and that looks like one out of sight, is taken for it.
        hidden = [track for track in found.tracks if track not in found.gone]
        found.by_looks += found.settle(self.numbers.assign(hidden, found.things))
        return found

    def _miss(self, tracks: Iterable[Track], gone: Sequence[Track]) -> None:
        """Take what the look does not show to be hidden; of those that it shows to be gone, to have fallen into something or lost."""
        for track in tracks:
            if track not in gone:
                track.hidden = True
                track.confidence *= FADING
            elif not self._falls_into_something(track):
                self._lose(track)

    def _lose(self, track: Track) -> None:
        """Remember a thing that is not where it was apart from those whose place is known."""
        self.lost[track.id] = self.tracks.pop(track.id)

    def _slide_contents(self, drawers: Iterable[Track], hidden: Iterable[Track]) -> None:
        """Move hidden things with the drawers that they lie in.

        Args:
            drawers: As they were before the look.
            hidden: What the look did not show.
        """
        unseen = [track for track in hidden if track.id in self.tracks]
        for before in drawers:
            now = self.tracks.get(before.id, before).thing.opening
            was = before.thing.opening or 0.0
            slide_contents(before, (was if now is None else now) - was, unseen)

    def _add_stranger(self, thing: Thing) -> None:
        """Take a thing that nobody has described for a lost one that looks like it, else give it a name of its own."""
        lost = [track for track in self.lost.values() if track.id not in self.tracks]
        turned_up = self.numbers.assign(lost, [thing])
        name = (
            turned_up[0][0].id
            if turned_up
            else new_id(colour_name(tuple(thing.rgb)), thing.kind, self.tracks, thing.tag)
        )
        self.tracks[name] = Track(name, thing, confidence=thing.confidence)
        if not turned_up:
            self.strangers[name] = set()

    def _recognize_strangers(self, held: Collection[str]) -> None:
        """Give a stranger the name of a lost thing that it comes to look like, and that was never seen beside it."""
        seen = {track.id for track in self.tracks.values() if not track.hidden and track.id not in held}
        self.strangers = {name: beside | seen for name, beside in self.strangers.items() if name in self.tracks}
        clear = [
            self.tracks[name]
            for name in sorted(self.strangers)
            if name not in held and name in seen and self.tracks[name].tangents > 0
        ]
        for known in [track for track in self.lost.values() if track.id not in self.tracks]:
            apart = {
                track.thing: track
                for track in clear
                if known.id not in self.strangers.get(track.id, ()) and track.tag in (None, self.numbers.on(known))
            }
            for _, thing in self.numbers.assign([known], list(apart)):
                stranger = apart[thing]
                del self.strangers[stranger.id]
                clear.remove(stranger)
                self.rename(stranger.id, known.id)

    def _is_strange(self, thing: Thing, hands: Sequence[Array], known: frozenset[str]) -> bool:
        """Tell whether a new thing is one of its own: no piece of another, and none between the fingers."""
        if thing.confidence < _STRANGER_CONFIDENCE:
            return False
        if any(float(np.linalg.norm(thing.fit.centre - hand)) < _AT_HAND for hand in hands):
            return False
        if any(_is_part(thing, track.thing) for track in self.tracks.values()):
            return False
        return not self._is_known_inside(thing, known)

    def _is_known_inside(self, thing: Thing, known: frozenset[str]) -> bool:
        """Tell whether a new thing lies in a container with something of its colour that was known before, or is hidden.

        Of what lies on and against each other in a bin pieces are seen that look like other things.
        """
        vessels = [
            vessel
            for vessel in self.tracks.values()
            if vessel.thing.shape.holds_things and lies_in(thing.fit.centre, vessel.thing.fit)
        ]
        if thing.shape.holds_things and any(vessel.id in known for vessel in vessels):
            # A hollow between things in a bin is no bowl.
            return True
        alike = [
            other
            for other in self.tracks.values()
            if (other.hidden or other.id in known) and colour_difference(other.thing.rgb, thing.rgb) < COLOUR_GATE
        ]
        return any(
            other is not vessel and lies_in(other.thing.fit.centre, vessel.thing.fit)
            for vessel in vessels
            for other in alike
        )

    def _falls_into_something(self, track: Track) -> bool:
        """Take a thing that vanished over a container to lie in it, not very surely; say whether there is one."""
        for other in self.tracks.values():
            vessel = other.thing
            if other is track or not vessel.shape.holds_things:
                continue
            if not lies_in(track.thing.fit.centre, vessel.fit):
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
        owners = [self.numbers.owner(thing) for thing in sure]
        owned = [(name, thing) for name, thing in zip(owners, sure, strict=True) if name and name not in self.tracks]
        taken = [thing for _, thing in owned]
        sure = [thing for thing in sure if thing not in taken]
        names = names_for(
            [(thing.kind, thing.size, thing.rgb) for thing in sure],
            self.declared,
            {*self.tracks, *(name for name, _ in owned)},
            [thing.tag for thing in sure],
        )
        return [*owned, *((name, thing) for name, thing in zip(names, sure, strict=True) if name is not None)]

    def _recognized(self, left: Assignment) -> list[tuple[Track, Thing]]:
        """Return which things known ones are: by a number that was read, else by place."""
        sure = self.numbers.sure(left.tracks, left.things)
        tracks, things = {track for track, _ in sure}, {thing for _, thing in sure}
        by_place = self.numbers.assign(
            [track for track in left.tracks if track not in tracks],
            [thing for thing in left.things if thing not in things],
            near=True,
        )
        return [*sure, *by_place]

    def _rename_by_tag(self, pairs: Sequence[tuple[Track, Thing]]) -> None:
        """Give what turns out to carry a described number the name of that description; what had the name takes the other's."""
        for track, thing in pairs:
            name = self.numbers.owner(thing)
            if name is None or name == track.id:
                continue
            other, before = self.tracks.get(name), track.id
            if other is not None:
                del self.tracks[name]
            self.rename(before, name)
            self.strangers.pop(before, None)
            if other is not None:
                other.id = before
                self.tracks[before] = other


def slide_contents(drawer: Track, out: float, tracks: Iterable[Track]) -> None:
    """Move what lies in a drawer with it, so far farther out, metres."""
    if abs(out) < _SLID:
        return
    box = drawer.detected()
    for track in tracks:
        if not track.thing.shape.opens and inside(track.detected(), box).holds:
            pose = track.thing.pose
            track.carry(Pose.from_matrix(pose.position - out * box.pose.rotation[:, 0], pose.rotation))


def as_described(thing: Thing, size: tuple[float, ...]) -> Thing:
    """Return a drawer with the measures that the task gives: how far it opens cannot be seen, and how deep it is hardly."""
    if not thing.shape.opens or len(size) != len(thing.size):
        return thing
    total = thing.size[1] + (thing.opening or 0.0)
    depth = min(size[1], total)
    back = thing.fit.centre + thing.fit.sizes[0] * thing.fit.axes[:, 0]
    centre = back - depth / 2.0 * thing.fit.axes[:, 0]
    hull = replace(thing.fit, centre=centre, sizes=np.array([depth, size[0], size[2]]) / 2.0)
    pose = Pose.from_matrix(np.array([*centre[:2], thing.pose.xyz[2]]), thing.pose.rotation)
    return replace(thing, fit=hull, size=size, pose=pose, opening=opened(size, total))


def _is_part(thing: Thing, known: Thing) -> bool:
    """Tell whether a new thing is but a piece of a known one, cut off by what stands before it."""
    if colour_difference(thing.rgb, known.rgb) > COLOUR_GATE:
        return False
    half = known.fit.sizes
    if known.fit.shape != "box":
        half = np.array([half[0], half[0], half[-1]])
    local = (thing.group.points - known.fit.centre) @ known.fit.axes
    if known.opening is not None:
        # The part that has slid out of a drawer's front belongs to it as well.
        local[:, 0] += known.opening * np.clip(-local[:, 0] / half[0], 0.0, 1.0)
    local = np.abs(local)
    return bool((local < half + _PIECE).all(axis=1).mean() > 0.6)
