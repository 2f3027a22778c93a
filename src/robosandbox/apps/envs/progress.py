"""Distance of a world from success, in metres, from which a dense reward is made.

One function per kind of criterion; a kind that has none counts as a fixed distance until it holds.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import singledispatch

import numpy as np

from robosandbox.tasks.judge.checks import (
    TABLE,
    AtHome,
    Beside,
    Check,
    Closed,
    Displaced,
    Inside,
    Lifted,
    On,
    Opened,
    TurnedTo,
    Undisturbed,
)
from robosandbox.tasks.judge.place_checks import At, InPlaceOf
from robosandbox.tasks.judge.poured import Poured
from robosandbox.tasks.success import AllOf, AnyOf
from robosandbox.types import DIRECTION_AXES, SIDE_AXES, Array, DetectedObject, Truth
from robosandbox.world import relations

# What a criterion without a measure of its own is away from success: about a reach across the table, metres.
_UNMEASURED = 0.5
# Moving the hand to an object is worth half of moving the object as far, so that objects come first.
_REACH_WEIGHT = 0.5


def potential(criterion: Check, start: Truth, now: Truth, tcp: Array) -> float:
    """Return minus the distance to success, 0 where the criterion holds.

    The distance is what objects, drawers and joints still have to move, and half of how far the tool centre point is
    from the nearest object that still has to. As a difference between two states it shapes a reward without changing
    which policy is best (Ng, Harada and Russell, 1999).

    Args:
        criterion: The task's.
        start: The world as the episode began.
        now: The world.
        tcp: Tool centre point in the world, metres, shape (3,).
    """
    if criterion.evaluate(start, now).holds:
        return 0.0
    hands = [
        float(np.linalg.norm(relations.centre(_seen(now, name)) - tcp))
        for name in _open_subjects(criterion, start, now)
    ]
    return -(distance(criterion, start, now) + _REACH_WEIGHT * min(hands, default=0.0))


def distance(check: Check, start: Truth, now: Truth) -> float:
    """Return how far a check is from holding, metres; 0 where it holds."""
    return 0.0 if check.evaluate(start, now).holds else _left(check, start, now)


@singledispatch
def _left(check: Check, start: Truth, now: Truth) -> float:
    """Return what is left to a check that does not hold, metres."""
    del check, start, now
    return _UNMEASURED


@_left.register
def _(check: Lifted, start: Truth, now: Truth) -> float:
    rise = relations.bottom(_seen(now, check.object)) - relations.bottom(_seen(start, check.object))
    return check.min_mm / 1e3 - rise


@_left.register
def _(check: On, start: Truth, now: Truth) -> float:
    del start
    obj = _seen(now, check.object)
    if check.target == TABLE:
        return abs(relations.bottom(obj) - now.table_height)
    target = _seen(now, check.target)
    return _apart(obj, target) + abs(relations.bottom(obj) - relations.top(target))


@_left.register
def _(check: Inside, start: Truth, now: Truth) -> float:
    del start
    return float(
        np.linalg.norm(relations.centre(_seen(now, check.object)) - relations.centre(_seen(now, check.target)))
    )


@_left.register
def _(check: Beside, start: Truth, now: Truth) -> float:
    del start
    obj, target = _seen(now, check.object), _seen(now, check.target)
    axis = np.array([*SIDE_AXES[check.side], 0.0])
    # In the middle of the gaps that count, in line with the target's centre; `support` is measured from the origin.
    reach = float(relations.support(target, axis[None])[0])
    behind = float(relations.centre(obj) @ axis + relations.support(obj, -axis[None])[0])
    centre = relations.centre(target)
    goal = centre + axis * (reach + relations.BESIDE_GAP / 2.0 + behind - float(centre @ axis))
    off = float(np.linalg.norm((relations.centre(obj) - goal)[:2]))
    return off + abs(relations.bottom(obj) - relations.bottom(target))


@_left.register
def _(check: Displaced, start: Truth, now: Truth) -> float:
    went = (relations.centre(_seen(now, check.object)) - relations.centre(_seen(start, check.object)))[:2]
    along = np.array(DIRECTION_AXES[check.direction])
    return float(np.linalg.norm(check.min_mm / 1e3 * along - went))


@_left.register
def _(check: At, start: Truth, now: Truth) -> float:
    del start
    return float(np.linalg.norm(relations.centre(_seen(now, check.object))[:2] - [check.x, check.y]))


@_left.register
def _(check: InPlaceOf, start: Truth, now: Truth) -> float:
    return _apart(_seen(now, check.object), _seen(start, check.target))


@_left.register
def _(check: Opened, start: Truth, now: Truth) -> float:
    del start
    return check.min_mm / 1e3 - (now.objects[check.object].opening or 0.0)


@_left.register
def _(check: Closed, start: Truth, now: Truth) -> float:
    del start
    return now.objects[check.object].opening or 0.0


@_left.register
def _(check: TurnedTo, start: Truth, now: Truth) -> float:
    # All of its way counts as a metre.
    return abs(float(check.evaluate(start, now).detail["share"]) - check.share)


@_left.register
def _(check: Poured, start: Truth, now: Truth) -> float:
    inside = check.evaluate(start, now).detail.get("fraction", 0.0)
    return (1.0 - inside) * _UNMEASURED + _apart(_seen(now, check.object), _seen(now, check.target))


@_left.register
def _(check: AtHome, start: Truth, now: Truth) -> float:
    del check, start
    # A radian of the joint that is farthest off counts as a metre.
    return now.off_home


@_left.register
def _(check: Undisturbed, start: Truth, now: Truth) -> float:
    found = check.evaluate(start, now).detail
    return (found["moved_mm"] - found["max_mm"]) / 1e3


@_left.register
def _(check: AllOf, start: Truth, now: Truth) -> float:
    return sum(distance(inner, start, now) for inner in check.checks)


@_left.register
def _(check: AnyOf, start: Truth, now: Truth) -> float:
    return min(distance(inner, start, now) for inner in check.checks)


def _open_subjects(check: Check, start: Truth, now: Truth) -> Iterator[str]:
    """Yield the objects that the innermost checks that do not hold want moved."""
    if check.evaluate(start, now).holds or isinstance(check, Undisturbed):
        return
    inner = [child for _, child in check.children()]
    for child in inner:
        yield from _open_subjects(child, start, now)
    if not inner:
        # What a check is about comes first among those that it names.
        yield from (name for _, name, _ in list(check.references())[:1])


def _apart(a: DetectedObject, b: DetectedObject) -> float:
    """Return the distance of two centres as seen from above, metres."""
    return float(np.linalg.norm((relations.centre(a) - relations.centre(b))[:2]))


def _seen(truth: Truth, name: str) -> DetectedObject:
    return truth.objects[name].detected()
