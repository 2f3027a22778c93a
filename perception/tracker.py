"""What is remembered from look to look: the same thing keeps its name while it is moved, hidden or held."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from robosandbox.perception.colour import colour_name
from robosandbox.perception.data_association import TagNumbers, displaced
from robosandbox.perception.drawers import opened
from robosandbox.perception.fit import Fit
from robosandbox.perception.frames import FrameSet
from robosandbox.perception.free_space import seen_through
from robosandbox.perception.naming import Declared, colour_difference, invented, names_for
from robosandbox.perception.occlusion import is_its_contents, lies_in
from robosandbox.perception.recognize import Thing
from robosandbox.perception.shape_prior import Known
from robosandbox.perception.track import FADING, SURELY, Track, carry, update_from
from robosandbox.shapes import CONTAINER_WALL
from robosandbox.types import Array, ObjectKind, Pose
from robosandbox.world.relations import inside

_GATE = 0.05
_COLOUR_GATE = 30.0
_SIZE_GATE = 0.45
_LEAST_CONFIDENCE = 0.15
_STRANGER_CONFIDENCE = 0.25
_AT_HAND = 0.06
_FALLEN = 0.4
# Too little to be acted on, or to be claimed.
_MAYBE = 0.25
_PIECE = 0.01
_SLID = 0.0005
_WORST = 10.0


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

    def hulls(self, held: str | None) -> list[tuple[ObjectKind, Fit]]:
        """Return the kinds and outer hulls of the containers that stand where they were seen, without the held one."""
        return [
            (track.thing.kind, track.thing.fit)
            for track in self.tracks.values()
            if track.thing.shape.is_open_container and track.id != held and track.confidence > SURELY
        ]

    def solids(self, held: str | None) -> list[Known]:
        """Return the solid upright things that were clearly seen once, without the held one."""
        return [
            Known(track.thing.fit, track.thing.group, track.tangents, lost)
            for lost, tracks in ((False, self.tracks), (True, self.lost))
            for track in tracks.values()
            if not track.thing.shape.holds_things
            and track.thing.fit.lean is None
            and track.id != held
            and track.tangents > 0
        ]

    def rename(self, old: str, new: str) -> None:
        """Call a remembered thing something else; the new name must be free."""
        track = self.tracks.pop(old)
        track.id = new
        self.tracks[new] = track

    def update(self, things: Sequence[Thing], frames: FrameSet, held: str | None, hand: Array) -> None:
        """Take a look's things: known ones are recognized by place, then by appearance, new ones get names.

        Args:
            things: What the look shows, without the held one.
            frames: The look.
            held: Id of what is in the gripper, which moves with it and is left alone.
            hand: The TCP, (3,); between fingers a thing shows pieces that are no things of their own.
        """
        known_before = frozenset(self.tracks)
        free = [track for track in self.tracks.values() if track.id != held]
        pairs = self._recognized(free, things)
        self._rename_by_tag(pairs)
        for track in displaced(free, pairs, things):
            self.lost[track.id] = self.tracks.pop(track.id)
            free.remove(track)
        left = [track for track in free if track.id not in {track.id for track, _ in pairs}]
        new = [thing for thing in things if not any(thing is known for _, known in pairs)]
        gone = [track for track in left if seen_through(track.thing, frames)]
        moved = self._assign(gone, new, near=False)
        new = [thing for thing in new if not any(thing is known for _, known in moved)]
        named = self._declared(new)
        new = [thing for thing in new if not any(thing is known for _, known in named)]
        # What nobody has described, and looks like something out of sight, is that.
        hidden = [track for track in left if not any(track is known for known, _ in moved) and track not in gone]
        back = self._assign(hidden, new, near=False)
        drawers = [(replace(track), track.thing.opening) for track in free if track.thing.opening is not None]
        for track, thing in (*pairs, *moved, *back):
            if is_its_contents(track, thing, pairs):
                # Half covered it is seen amiss; what lies in it, and is seen where it lay, tells where it is.
                track.confidence *= FADING
            else:
                update_from(track, thing)
        seen = {track.id for track, _ in (*moved, *back)}
        for track in left:
            if track.id in seen:
                continue
            if track in gone:
                if not self._falls_into_something(track):
                    self.lost[track.id] = self.tracks.pop(track.id)
            else:
                track.hidden = True
                track.confidence *= FADING
        unseen = [track for track in free if track.hidden and track.id in self.tracks]
        for before, opening in drawers:
            now = self.tracks[before.id].thing.opening if before.id in self.tracks else None
            slide_contents(before, (opening if now is None else now) - opening, unseen)
        for name, thing in named:
            known = next(item for item in self.declared if item.id == name)
            self.tracks[name] = Track(name, as_described(thing, known.size), confidence=thing.confidence)
        new = [thing for thing in new if not any(thing is known for _, known in back)]
        for thing in new:
            if not self._is_strange(thing, hand, known_before):
                continue
            turned_up = self._assign(
                [track for track in self.lost.values() if track.id not in self.tracks], [thing], near=False
            )
            name = turned_up[0][0].id if turned_up else self._invented(thing)
            self.tracks[name] = Track(name, thing, confidence=thing.confidence)
            if not turned_up:
                self.strangers[name] = set()
        self._recognize_strangers(held)
        self.lost = {name: track for name, track in self.lost.items() if name not in self.tracks and track.tangents > 0}

    def _recognize_strangers(self, held: str | None) -> None:
        """Give a stranger the name of a lost thing that it comes to look like, and that was never seen beside it."""
        seen = {track.id for track in self.tracks.values() if not track.hidden and track.id != held}
        self.strangers = {name: beside | seen for name, beside in self.strangers.items() if name in self.tracks}
        clear = [
            self.tracks[name]
            for name in sorted(self.strangers)
            if name != held and name in seen and self.tracks[name].tangents > 0
        ]
        for known in [track for track in self.lost.values() if track.id not in self.tracks]:
            apart = [
                track
                for track in clear
                if known.id not in self.strangers.get(track.id, ()) and track.tag in (None, self.numbers.on(known))
            ]
            for _, thing in self._assign([known], [track.thing for track in apart], near=False):
                stranger = next(track for track in apart if track.thing is thing)
                del self.strangers[stranger.id]
                clear.remove(stranger)
                self.rename(stranger.id, known.id)

    def _is_strange(self, thing: Thing, hand: Array, known: frozenset[str]) -> bool:
        """Tell whether a new thing is one of its own: no piece of another, and none between the fingers."""
        if thing.confidence < _STRANGER_CONFIDENCE or float(np.linalg.norm(thing.fit.centre - hand)) < _AT_HAND:
            return False
        if any(_is_part(thing, track.thing) for track in self.tracks.values()):
            return False
        return not self._is_known_inside(thing, known)

    def _is_known_inside(self, thing: Thing, known: frozenset[str]) -> bool:
        """Tell whether a new thing lies in a container with something of its colour that was known before, or is hidden.

        Of what lies on and against each other in a bin pieces are seen that look like other things.
        """
        for vessel in self.tracks.values():
            if vessel.thing.shape.holds_things and lies_in(thing.fit.centre, vessel.thing.fit):
                if thing.shape.holds_things and vessel.id in known:
                    # A hollow between things in a bin is no bowl.
                    return True
                for other in self.tracks.values():
                    alike = colour_difference(other.thing.rgb, thing.rgb) < _COLOUR_GATE
                    if (
                        other is not vessel
                        and (other.hidden or other.id in known)
                        and alike
                        and lies_in(other.thing.fit.centre, vessel.thing.fit)
                    ):
                        return True
        return False

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
        sure = [thing for thing in sure if not any(thing is known for _, known in owned)]
        names = names_for(
            [(thing.kind, thing.size, thing.rgb) for thing in sure],
            self.declared,
            {*self.tracks, *(name for name, _ in owned)},
            [thing.tag for thing in sure],
        )
        return [*owned, *((name, thing) for name, thing in zip(names, sure, strict=True) if name is not None)]

    def _recognized(self, tracks: Sequence[Track], things: Sequence[Thing]) -> list[tuple[Track, Thing]]:
        """Return which things known ones are: by a number that was read, else by place."""
        sure = self.numbers.sure(tracks, things)
        left = [track for track in tracks if not any(track is known for known, _ in sure)]
        new = [thing for thing in things if not any(thing is known for _, known in sure)]
        return [*sure, *self._assign(left, new, near=True)]

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

    def _invented(self, thing: Thing) -> str:
        r, g, b = (float(value) for value in thing.rgb)
        return invented(colour_name((r, g, b)), thing.kind, self.tracks, thing.tag)

    def _assign(self, tracks: Sequence[Track], things: Sequence[Thing], *, near: bool) -> list[tuple[Track, Thing]]:
        """Return which track each thing continues, all at once at the least total difference."""
        if not tracks or not things:
            return []
        costs = np.array(
            [
                [
                    _unlike(track.thing, thing, near=near) + _WORST * self.numbers.differ(track, thing)
                    for thing in things
                ]
                for track in tracks
            ]
        )
        from scipy.optimize import linear_sum_assignment

        rows, columns = linear_sum_assignment(np.minimum(costs, _WORST))
        return [(tracks[r], things[c]) for r, c in zip(rows, columns, strict=True) if costs[r, c] < 1.0]


def slide_contents(drawer: Track, out: float, tracks: Iterable[Track]) -> None:
    """Move what lies in a drawer with it, so far farther out, metres."""
    if abs(out) < _SLID:
        return
    box = drawer.detected()
    for track in tracks:
        if not track.thing.shape.opens and inside(track.detected(), box).holds:
            pose = track.thing.pose
            carry(track, Pose.from_matrix(pose.position - out * box.pose.rotation[:, 0], pose.rotation))


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


def _unlike(old: Thing, new: Thing, *, near: bool) -> float:
    """Return how different two looks at a thing are: below 1 they may be of the same."""
    distance = float(np.linalg.norm(old.fit.centre - new.fit.centre))
    colour = colour_difference(old.rgb, new.rgb) / _COLOUR_GATE
    size = float(np.abs(np.log(old.shape.extents(old.size) / new.shape.extents(new.size))).mean()) / _SIZE_GATE
    if near:
        # What was clearly seen to be solid does not become hollow where it stands.
        changed = new.shape.holds_things and not old.shape.holds_things and old.confidence > SURELY
        return max(distance / _GATE, 0.7 * colour, 0.3 * size) + (1.0 if changed else 0.0)
    return max(colour, size) + (0.0 if old.kind == new.kind else 0.4) + 0.2 * distance
