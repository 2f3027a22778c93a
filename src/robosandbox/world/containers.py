"""Relations of containers: inside, room for a thing, contents that can be poured."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from robosandbox.errors import Phase, PlacementError, PourError, SkillError
from robosandbox.evidence import PlacementEvidence, PourEvidence
from robosandbox.types import Array, DetectedObject, ObservedScene, Pose
from robosandbox.world import parts, relations
from robosandbox.world.effects import put
from robosandbox.world.facts import TABLE, fact
from robosandbox.world.nearness import nearer
from robosandbox.world.placement_sampling import (
    first_placement_in,
    is_on,
    levelled,
    placements_in,
    resting_pose,
    side_room,
    with_pose,
)
from robosandbox.world.predicate import Finding, View, is_clearly_seen, predicate, sentence
from robosandbox.world.relations import CLOSED_WITHIN, bounds, centre, contents, loose, mouth_of, support
from robosandbox.world.standing import occupied, unsuitable

# Share of many small things that has to be in a container for all of them to count as in it: what a pour brings over.
_MOST = 0.9
# Room between an object and the edges of a drawer's opening, metres; chosen as the room that `spots` leaves at a
# container's walls.
_ROOM = 0.004
# By how much a hollow may be wider than it is known to be, metres on each side: two columns of the grid on which hollows are found.
_SIZE_ERROR = 0.003
# Places in a cupboard of which it is asked whether a door stands before them, and shares of the way there at which it is looked.
_WAYS_IN, _SHARES = 4, (0.25, 0.5, 0.75, 1.0)
# Share of a container that randomly packed balls fill (Scott 1960 measured 0.60 for loose, 0.64 for dense packing).
_PACKED = 0.6


def _shut(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    del view
    return PlacementError(
        sentence(finding),
        phase=Phase.CHECK,
        evidence=PlacementEvidence(object=str(arguments[0]), target=str(arguments[1]), reason="closed"),
    )


def _nothing_to_pour(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    del view
    evidence = PourEvidence(object=str(arguments[0]), target="", count=0, poured=0, spilled=0)
    return PourError(sentence(finding), phase=Phase.CHECK, evidence=evidence)


def _put_in(scene: ObservedScene, a: str, c: str) -> ObservedScene:
    item, vessel = scene.find(a), scene.find(c)
    if item is None or vessel is None or not vessel.shape.holds_things:
        return scene
    spot = first_placement_in(vessel, item, _solids_in(scene, vessel, a))
    if spot is not None:
        return put(scene, a, resting_pose(item, spot, spot.rotation(levelled(item), spot.yaws[0])))
    room = mouth_of(vessel)
    point = vessel.pose.position + vessel.pose.rotation @ np.array([*room.middle, room.floor])
    return put(scene, a, Pose.from_matrix(point, levelled(item)))


def _solids_in(scene: ObservedScene, vessel: DetectedObject, but: str) -> tuple[DetectedObject, ...]:
    """Return what lies in a container and takes room of its own there."""
    within = {name for name, _ in contents(scene.objects, vessel)} - {but, *scene.in_hands}
    return tuple(item for item in scene.objects if item.id in within and not item.shape.is_granular)


def cargo_of(view: View, c: str) -> list[tuple[str, int]]:
    """Return what lies in a container: ids, each with the number of its grain, 0 where it is one thing."""
    vessel = view.get(c)
    return contents(view.others(c), vessel) if vessel.shape.holds_things else []


@predicate("object", "object", effect=_put_in, lasts=True)
def inside(view: View, a: str, c: str) -> Finding:
    """An object, or nearly all of many, lies in a container."""
    item, vessel = view.get(a), view.get(c)
    if not vessel.shape.holds_things or a in view.scene.in_hands:
        return Finding(holds=False, cause=f"{a} is not in {c}", help=f"put {a} into {c}")
    found = [relations.inside(part, vessel) for part in loose(item)]
    share = sum(map(bool, found)) / max(len(found), 1)
    margin = min((r.detail["margin_mm"] / 1e3 for r in found), default=0.0)
    holds = share >= _MOST
    over = not holds and margin > 0.0 and any(relations.leans_out(part, vessel) for part in loose(item))
    return Finding(
        holds=holds,
        margin=share - _MOST if item.shape.is_granular else margin,
        is_sure=is_clearly_seen(item, vessel) and (not vessel.shape.opens or vessel.opening is not None),
        cause=f"{a} is not in {c}" + (": its middle is over the rim" if over else ""),
        help=f"put {a} into {c}",
    )


@predicate("object", lasts=True)
def empty(view: View, c: str) -> Finding:
    """Nothing is seen in a container."""
    names = tuple(dict.fromkeys(name for name, _ in cargo_of(view, c)))
    vessel = view.get(c)
    return Finding(
        holds=not names,
        is_sure=is_clearly_seen(vessel) and (not vessel.shape.opens or vessel.opening is not None),
        cause=f"{', '.join(names)} is in {c}",
        help="take it out first",
        blocking=names,
        remedies=tuple(fact("on", name, TABLE) for name in names),
    )


@predicate("object", fixed=True, blame=unsuitable)
def holds_things(view: View, c: str) -> Finding:
    """Things can be put and poured into objects of this kind."""
    item = view.get(c)
    return Finding(
        holds=item.shape.holds_things,
        cause=f"{c} is {item.shape.name}, no open container, and holds nothing",
        help="choose a bin, bowl or cup, or use place_on",
    )


@predicate("object", "object", blame=_shut)
def lets_in(view: View, a: str, c: str) -> Finding:
    """A container is open, and far enough for an object."""
    vessel, item = view.get(c), view.get(a)
    if parts.is_part(vessel):
        return parts.open_(view, c)
    if vessel.is_fixed:
        return _way_in(view, item, vessel)
    if not vessel.shape.opens:
        return Finding(holds=True)
    low, high = bounds(item)
    # Of what is poured the container stays outside.
    width = float((high - low)[:2].min())
    free = 2.0 * float(mouth_of(vessel).half[0])
    opening = vessel.opening or 0.0
    far = f"only {1e3 * opening:.0f} mm open" if opening > CLOSED_WITHIN else "closed"
    return Finding(
        holds=free >= width + 2.0 * _ROOM,
        margin=free - width,
        tolerance=2.0 * _ROOM,
        is_sure=vessel.opening is not None and is_clearly_seen(item, vessel),
        cause=f"{c} is {far}, and {a} needs {1e3 * (width + 2.0 * _ROOM):.0f} mm",
        help="open it first",
        remedies=(fact("open", c),),
    )


def _way_in(view: View, item: DetectedObject, cupboard: DetectedObject) -> Finding:
    """Return whether no door stands where an object comes into a cupboard from the side."""
    level = levelled(item)
    ways = []
    for spot in itertools.islice(placements_in(cupboard, item, ()), _WAYS_IN):
        there = with_pose(item, resting_pose(item, spot, spot.rotation(level, 0.0)))
        ways.append((there, spot.depth * np.array([*(spot.way_out or (0.0, 0.0)), 0.0])))
    return no_door_before(view, cupboard, ways)


def no_door_before(view: View, cupboard: DetectedObject, ways: Sequence[tuple[DetectedObject, Array]]) -> Finding:
    """Return whether no door of a cupboard stands in one of some ways.

    Args:
        view: What is seen.
        cupboard: The doors are parts of it.
        ways: A thing where it stands in the cupboard, and the way (3,) on which it comes out, metres.
    """
    doors = [other for other in view.scene.objects if is_on(other, cupboard)]
    shut: dict[str, None] = {}
    for there, out in ways:
        stations = [
            with_pose(there, Pose.from_matrix(there.pose.position + share * out, there.pose.rotation))
            for share in _SHARES
        ]
        met = [door.id for door in doors if any(nearer(door, one, 0.0) for one in stations)]
        if not met:
            return Finding(holds=True)
        shut.update(dict.fromkeys(met))
    closed = [name for name in shut if not parts.open_(view, name).holds]
    names = tuple(closed or shut)
    return Finding(
        holds=not names,
        is_sure=all(is_clearly_seen(there, cupboard) for there, _ in ways),
        cause=f"{', '.join(names)} {'stands' if len(names) == 1 else 'stand'} before {cupboard.id}",
        help=f"open {names[0]} first" if names else "",
        blocking=names,
        remedies=tuple(fact("open", name) for name in closed),
    )


@predicate("object")
def opened(view: View, c: str) -> Finding:
    """A container is open to what falls into it: a drawer at least half."""
    vessel = view.get(c)
    return parts.open_(view, c) if vessel.shape.opens or parts.is_part(vessel) else Finding(holds=True)


@predicate("object", "object", blame=occupied)
def fits(view: View, a: str, c: str) -> Finding:
    """There is room for an object in a container, beside or on what lies there."""
    item, vessel = view.get(a), view.get(c)
    if not vessel.shape.holds_things:
        return Finding(holds=False, cause=f"no room for {a} in {c}: it is {vessel.shape.name}")
    there = _solids_in(view.scene, vessel, a)
    spot = first_placement_in(vessel, item, there)
    # A thing that stands higher than the rim is not inside, nor in a drawer one with its middle over it.
    rim = vessel.pose.xyz[2] + mouth_of(vessel).rim
    if vessel.shape.joint(vessel) is not None:
        upright = with_pose(item, Pose.from_matrix(item.pose.position, levelled(item)))
        rim -= centre(upright)[2] - relations.bottom(upright)
    names = tuple(other.id for other in there)
    why = f"with {', '.join(names)} there it is too full" if names else "it is too small"
    return Finding(
        holds=spot is not None and spot.height < rim,
        margin=None if spot is None else rim - spot.height,
        is_sure=is_clearly_seen(item, vessel),
        cause=f"no room for {a} in {c}: {why}",
        help="clear it or choose another place",
        blocking=names,
        remedies=tuple(fact("on", name, TABLE) for name in reversed(names)),
    )


@predicate("object", "object")
def slides_in(view: View, a: str, c: str) -> Finding:
    """An object is not wider than a container's inside, as far as sizes are known; it may just fit."""
    item, vessel = view.get(a), view.get(c)
    if not vessel.shape.holds_things:
        return Finding(holds=False, cause=f"no room for {a} in {c}: it is {vessel.shape.name}")
    room = side_room(item, vessel)
    return Finding(
        holds=room > -_SIZE_ERROR,
        margin=room,
        tolerance=_SIZE_ERROR,
        is_sure=is_clearly_seen(item, vessel),
        cause=f"{a} is {-2e3 * room:.0f} mm wider than the inside of {c}",
        help="choose another place",
    )


@predicate("object", fixed=True)
def pours(view: View, a: str) -> Finding:
    """The contents of an object can be poured out of it."""
    item = view.get(a)
    return Finding(
        holds=item.shape.pours,
        cause=f"{a} is {item.shape.name}: one pours from a bin, bowl or cup",
        help="pick a container that holds something",
    )


@predicate("object", blame=_nothing_to_pour)
def filled(view: View, a: str) -> Finding:
    """Something is seen in a container."""
    vessel = view.get(a)
    cargo = contents([item for item in view.scene.objects if item.id != a], vessel) if vessel.shape.holds_things else []
    return Finding(
        holds=bool(cargo),
        is_sure=is_clearly_seen(vessel),
        cause=f"nothing is seen in {a}: there is nothing to pour",
        help="fill it first",
    )


@predicate("object", "object")
def holds_load(view: View, a: str, c: str) -> Finding:
    """A container takes all that another holds."""
    vessel, target = view.get(a), view.get(c)
    loads = [contents([item for item in view.scene.objects if item.id != c], vessel), cargo_of(view, c)]
    volume = sum(_volume(view.get(name)) for load in loads for name, _ in load) / _PACKED
    room = relations.room_of(target)
    area = math.pi * float(room.half[0]) ** 2 if room.is_round else 4.0 * float(room.half[0] * room.half[1])
    margin = area * (room.rim - room.floor) - volume
    return Finding(
        holds=margin >= 0.0,
        margin=margin,
        is_sure=is_clearly_seen(vessel, target),
        cause=f"{c} is too small for all that is in {a}",
        help="choose a larger container",
    )


def walls(item: DetectedObject, vessel: DetectedObject) -> list[tuple[Array, float]]:
    """Return the directions (3,) of a container's walls from a thing in it, and how far each is, metres."""
    room = vessel.shape.room(vessel.size)
    if room is None:
        return []
    frame = vessel.pose.rotation
    if room.is_round:
        local = frame.T @ (centre(item) - vessel.pose.position)
        out = np.array([*local[:2], 0.0]) / max(float(np.hypot(*local[:2])), 1e-9)
        directions, limits = [frame @ out], [float(room.half[0])]
    else:
        sides = list(itertools.product((0, 1), (1.0, -1.0)))
        directions = [sign * frame[:, axis] for axis, sign in sides]
        limits = [float(room.half[axis] + sign * room.middle[axis]) for axis, sign in sides]
    reach = support(item, np.array(directions)) - np.array(directions) @ vessel.pose.position
    return [(direction, limit - float(far)) for direction, far, limit in zip(directions, reach, limits, strict=True)]


def _volume(item: DetectedObject) -> float:
    """Return the volume of one thing, or of one grain, as a ball of its size or its hull's box, cubic metres."""
    if item.shape.is_granular:
        return 4.0 / 3.0 * math.pi * item.size[0] ** 3
    return 8.0 * float(np.prod(item.shape.hull(item.size).half_extents))
