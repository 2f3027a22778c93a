"""Places on other things for a thing in the way, where that takes a call less than the table."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

from robosandbox.types import DetectedObject, ObservedScene
from robosandbox.world.contracts import lookup
from robosandbox.world.facts import TABLE, Fact, fact
from robosandbox.world.heuristic import SearchState
from robosandbox.world.locations import location_of
from robosandbox.world.relations import Extent, apart, extent

# Things that are tried, the nearest first. Chosen.
_MOST = 2
# How high over the table a thing may come to reach, metres; chosen as the tower of the task stack_five does.
_HIGHEST = 0.2
# Share of its own width that the top under a thing has at least. Chosen so that it stands as firmly as on the table.
_AS_WIDE = 0.9


def parking_spots(
    state: SearchState, name: str, goals: Sequence[Fact], claimed: Sequence[DetectedObject]
) -> Iterator[Fact]:
    """Yield that a thing stands on one that no goal concerns which does not hold yet, the nearest first.

    Args:
        state: Where it is in the way.
        name: Of the thing.
        goals: All that is to hold.
        claimed: Things as goals want them to stand on the table.
    """
    scene = state.scene
    item = scene.find(name)
    if item is None:
        return
    lacking = [goal for goal in goals if not state.find(goal).holds]
    concerned = {name for goal in lacking for name in lookup(goal).objects(goal.arguments)} | {name}
    # Things inside a container are taken out of it, not piled upon.
    not_below = concerned | {other.id for other in scene.objects if other.shape.holds_things}
    around = extent(item)
    likely = [other for other in scene.objects if other.id not in not_below and _may_carry(other, around, scene)]
    likely.sort(key=lambda other: math.hypot(extent(other).x - around.x, extent(other).y - around.y))
    free = (
        other
        for other in likely
        if all(apart(other, claim) for claim in claimed if claim.id != other.id)
        and not any(below in not_below for below in _below(scene, other))
        and state.first_refuted((fact("supports", other.id), fact("room_on", name, other.id))) is None
    )
    yield from (fact("on", name, other.id) for other in itertools.islice(free, _MOST))


def _may_carry(other: DetectedObject, around: Extent, scene: ObservedScene) -> bool:
    """Say whether the top of an object is flat and wide enough for a thing within an extent, and not too high."""
    top = extent(other)
    highest = top.high + around.high - around.low
    return other.shape.flat_top and top.inner >= _AS_WIDE * around.inner and highest <= scene.table_height + _HIGHEST


def _below(scene: ObservedScene, item: DetectedObject) -> Iterator[str]:
    """Yield the ids of what an object stands on or lies in, downwards."""
    for _ in scene.objects:
        place = location_of(scene, item)
        if place is None or place.arguments[-1] == TABLE:
            return
        base = scene.find(str(place.arguments[1]))
        if base is None:
            return
        yield base.id
        item = base
