"""Relations of the hand's reach, and of the force with which it may press."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from robosandbox.errors import CollisionError, LimitError, Phase, SkillError, UnreachableError
from robosandbox.evidence import LimitEvidence
from robosandbox.types import DIRECTION_AXES, SIDE_AXES, Array, DetectedObject, Direction, Side
from robosandbox.world.abilities import Obstruction
from robosandbox.world.facts import TABLE, fact
from robosandbox.world.placement_sampling import (
    Placement,
    placements_in,
    placements_on,
    points_beside,
    table_placements,
    turning_placement,
    yaw_to_align,
)
from robosandbox.world.predicate import Finding, View, predicate, sentence
from robosandbox.world.relations import bottom, centre, lies_in, stands_on, top

# Places on a fixture of which it is asked whether the hand gets there, the best first, a number.
_SPOTS = 12


def _unreachable(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    del view, arguments
    return UnreachableError(sentence(finding), phase=Phase.CHECK)


def _limited(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    value, most = float(arguments[0]), view.robot.max_force
    return LimitError(
        sentence(finding),
        phase=Phase.CHECK,
        evidence=LimitEvidence(quantity="the force of the hand", value=value, low=0.0, high=most),
    )


def _blocked(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    del view, arguments
    return CollisionError(sentence(finding), phase=Phase.CHECK)


def _at(view: View, point: Array, what: str, carried: DetectedObject | None = None) -> Finding:
    """Return whether the hand can work at a point (3,), within reach and inside its workspace, with what it brings there."""
    for workspace in view.robot.workspaces:
        for axis, value in zip("xy", point, strict=False):
            bounds = getattr(workspace, axis)
            if bounds is not None and not bounds[0] <= value <= bounds[1]:
                low, high = bounds
                return Finding(
                    holds=False,
                    margin=float(min(value - low, high - value)),
                    cause=f"{what} is at {axis} = {value:.3f} m, outside the workspace's {low:g}..{high:g}",
                    help="choose something inside, or widen limits.workspace in the task",
                )
    why = view.robot.out_of_reach(tuple(map(float, point)), view.scene, carried)
    return Finding(
        holds=why is None,
        cause=f"{what} is out of reach: {why}",
        help="choose something nearer, or bring it into reach first",
    )


@predicate("object", blame=_unreachable)
def reachable(view: View, a: str) -> Finding:
    """The hand gets to an object."""
    return _at(view, centre(view.get(a)), a)


@predicate("object", "object", blame=_unreachable)
def reachable_over(view: View, a: str, b: str) -> Finding:
    """The hand gets to where an object stands that is put on or into another."""
    item, base = view.get(a), view.get(b)
    half = (top(item) - bottom(item)) / 2.0
    if base.is_fixed:
        within = base.shape.holds_things
        spots = (
            list(placements_in(base, item, (), view.scene))
            if within
            else placements_on(item, base, view.scene.objects)[0]
        )
        found = (
            _at(view, np.array([*spot.xy, spot.height + half]), f"the {'inside' if within else 'top'} of {b}", item)
            for spot in spots[:_SPOTS]
        )
        first: Finding | None = None
        for one in found:
            first = first or one
            if one.holds:
                return one
        return first or Finding(holds=True)
    point = centre(base)
    height = point[2] if base.shape.holds_things else top(base) + half
    return _at(view, np.array([point[0], point[1], height]), f"the top of {b}", item)


@predicate("object", "number", "number", blame=_unreachable)
def reachable_at(view: View, a: str, x: float, y: float) -> Finding:
    """The hand gets to where an object stands that is put down at a point of the table, metres."""
    item = view.get(a)
    height = view.scene.table_height + (top(item) - bottom(item)) / 2.0
    return _at(view, np.array([x, y, height]), f"({x:.3f}, {y:.3f})", item)


@predicate("object", "object", "word", blame=_unreachable)
def reachable_beside(view: View, a: str, b: str, side: Side) -> Finding:
    """The hand gets to some free place on one side of an object."""
    item, other = view.get(a), view.get(b)
    if side not in SIDE_AXES:
        return Finding(holds=True)
    free, _ = table_placements(view.scene, item, points_beside(item, other, side))
    height = view.scene.table_height + (top(item) - bottom(item)) / 2.0
    found = [_at(view, np.array([*spot.xy, height]), f"the {side} of {b}", item) for spot in free]
    return next((one for one in found if one.holds), found[0] if found else Finding(holds=True))


@predicate("object", "word", "number", blame=_unreachable)
def reachable_after(view: View, a: str, direction: Direction, distance: float) -> Finding:
    """The hand gets to where an object ends that is pushed so far."""
    axis = np.array([*DIRECTION_AXES[direction], 0.0])
    return _at(view, centre(view.get(a)) + distance * axis, f"where {a} would be pushed")


def _free(view: View, found: Obstruction | None, about: str, where: str, otherwise: str) -> Finding:
    """Return whether nothing keeps the hand from where it has to be for an object."""
    met = None if found is None or found.met in (None, about, TABLE) else view.scene.find(str(found.met))
    names = () if met is None or met.shape.stays_put else (met.id,)
    return Finding(
        holds=found is None,
        cause="" if found is None else f"there is no room for the hand {where}: {found.cause}",
        help=f"put {names[0]} aside first" if names else otherwise,
        blocking=names,
        remedies=tuple(fact("on", name, TABLE) for name in names),
    )


@predicate("object", "word", "number", blame=_blocked)
def room_behind(view: View, a: str, direction: Direction, distance: float) -> Finding:
    """The hand has room behind an object, and along the way that it pushes it."""
    found = view.robot.unpushable(view.get(a), (*DIRECTION_AXES[direction], 0.0), distance, view.scene)
    return _free(view, found, a, f"to push {a} {direction}", "pick it and place it there, or choose another way")


@predicate("object", "number", "number", blame=_blocked)
def room_to_push_to(view: View, a: str, x: float, y: float) -> Finding:
    """The hand has room behind an object, and along a way on which it pushes it to a point of the table, metres."""
    found = view.robot.unpushable_to(view.get(a), (x, y), view.scene)
    return _free(
        view, found, a, f"to push {a} to ({x:.3f}, {y:.3f})", "pick it and place it there, or choose another way"
    )


@predicate("object", blame=_blocked)
def room_to_open(view: View, d: str) -> Finding:
    """The hand has room at a drawer's grip, and on its way until the drawer is open."""
    found = view.robot.unopenable(view.get(d), view.scene)
    return _free(view, found, d, f"to pull {d} open", "choose another way")


@predicate("object", blame=_blocked)
def room_to_take(view: View, a: str) -> Finding:
    """The hand has room around an object: coming to it, closing on it, and rising with it."""
    found = view.robot.untakeable(view.get(a), view.scene)
    return _free(view, found, a, f"to take {a}", "push it where there is room, if it can be pushed")


def _put(view: View, a: str, spots: Sequence[Placement], allowed: Sequence[str], where: str) -> Finding:
    found = view.robot.unplaceable(view.get(a), spots, allowed, view.scene)
    return _free(view, found, a, f"to put {a} {where}", "choose a place with more room around it")


@predicate("object", "number", "number", blame=_blocked)
def room_to_put_at(view: View, a: str, x: float, y: float) -> Finding:
    """The hand has room to put an object down at a point of the table, metres."""
    spots, _ = table_placements(view.scene, view.get(a), [np.array([x, y])])
    return _put(view, a, spots, (TABLE,), f"at ({x:.3f}, {y:.3f})")


@predicate("object", "object", "word", blame=_blocked)
def room_to_put_beside(view: View, a: str, b: str, side: Side) -> Finding:
    """The hand has room to put an object down on one side of another."""
    item = view.get(a)
    points = points_beside(item, view.get(b), side) if side in SIDE_AXES else []
    spots, _ = table_placements(view.scene, item, points)
    return _put(view, a, spots, (TABLE,), f"{side} of {b}")


@predicate("object", "object", blame=_blocked)
def room_to_put_on(view: View, a: str, b: str) -> Finding:
    """The hand has room to put an object on another."""
    spots, _ = placements_on(view.get(a), view.get(b), view.scene.objects)
    return _put(view, a, spots, (b,), f"on {b}")


@predicate("object", "number", blame=_blocked)
def room_to_turn(view: View, a: str, angle: float) -> Finding:
    """The hand has room to put an object back where it stands, turned by an angle, radians, or by a part of it."""
    item, turn = view.get(a), math.remainder(angle, math.tau)
    others = [other for other in view.others(a) if stands_on(item, other) or lies_in(item, other)]
    spots = [turning_placement(item, turn)] if turn else []
    return _put(view, a, spots, (TABLE, *(other.id for other in others)), "back, turned")


@predicate("object", "object", blame=_blocked)
def room_to_align(view: View, a: str, b: str) -> Finding:
    """The hand has room to put an object back where it stands, turned until its sides are parallel to another's."""
    return room_to_turn(view, a, yaw_to_align(view.get(a), view.get(b)))


@predicate("number", fixed=True, blame=_limited)
def may_press(view: View, force: float) -> Finding:
    """The robot may press with a force, N."""
    most = view.robot.max_force
    return Finding(
        holds=force <= most,
        margin=most - force,
        cause=f"it takes {force:g} N, and the robot may press with {most:g} N at most",
        help="raise limits.max_force_n in the task or the sidecar",
    )
