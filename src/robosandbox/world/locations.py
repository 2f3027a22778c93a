"""Location of an object: in the gripper, on another, in a container, or on the table; and whether it has changed."""

from __future__ import annotations

import math

from robosandbox.types import DetectedObject, ObservedScene
from robosandbox.world.contracts import find
from robosandbox.world.facts import TABLE, Fact, fact
from robosandbox.world.predicate import Finding, View, is_clearly_seen, predicate
from robosandbox.world.relations import centre, lies_in, on_table, stands_on
from robosandbox.world.standing import AT_TOLERANCE


def location_of(scene: ObservedScene, item: DetectedObject) -> Fact | None:
    """Return what an object is held up by; None where nothing is seen to, or by several, as may be with beads.

    What stands on a thing in a container stands on that thing.
    """
    if item.id in scene.in_hands:
        return fact("holding", item.id)
    if item.shape.is_granular:
        return _within(scene, item)
    others = [
        other for other in scene.objects if other.id not in {item.id, *scene.in_hands} and not other.shape.is_granular
    ]
    solid = next((other for other in others if not other.shape.holds_things and stands_on(item, other)), None)
    if solid is not None:
        return fact("on", item.id, solid.id)
    vessels = [other for other in others if other.shape.holds_things]
    vessel = next((other for other in vessels if lies_in(item, other)), None)
    if vessel is not None:
        return fact("inside", item.id, vessel.id)
    rim = next((other for other in vessels if stands_on(item, other)), None)
    if rim is not None:
        return fact("on", item.id, rim.id)
    return fact("on", item.id, TABLE) if on_table(item, scene.table_height) else None


def _within(scene: ObservedScene, beads: DetectedObject) -> Fact | None:
    """Return which container beads are in; None where they are in several, or in none."""
    vessels = [other for other in scene.objects if other.shape.holds_things]
    view = View.of(scene)
    for vessel in vessels:
        within = fact("inside", beads.id, vessel.id)
        # Where single beads are not known, they are where they are as a whole.
        if find(within, view).holds if beads.grains else lies_in(beads, vessel):
            return within
    return None


def _aside(before: DetectedObject, after: DetectedObject) -> float:
    return math.dist(centre(before)[:2], centre(after)[:2])


def point_of(item: DetectedObject) -> Fact:
    """Return that an object stands on the table at the point over which it is."""
    x, y, _ = (round(float(value), 3) for value in centre(item))
    return fact("at", item.id, x, y)


@predicate("object")
def as_before(view: View, a: str) -> Finding:
    """An object is where it was: on or in what it was then, or, where that is gone, at that point of the table."""
    item, then = view.get(a), view.before.find(a)
    was = None if then is None else location_of(view.before, then)
    if then is None or was is None:
        return Finding(holds=False, is_sure=False, cause=f"it was not seen where {a} was before")
    below = str(was.arguments[-1])
    base, now = view.before.find(below), view.scene.find(below)
    is_gone = base is None or now is None or now.id in view.scene.in_hands or _aside(base, now) > AT_TOLERANCE
    if was.relation != "holding" and is_gone:
        was = point_of(then)
    return Finding(
        holds=find(was, view).holds,
        margin=AT_TOLERANCE - math.dist(centre(item), centre(then)),
        tolerance=AT_TOLERANCE,
        is_sure=is_clearly_seen(item, then),
        cause=f"{a} is not where it was",
        help=f"put {a} back",
        remedies=(was,),
    )
