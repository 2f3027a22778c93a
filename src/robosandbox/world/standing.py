"""Relations of support: on, beside, upright, and room to stand."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from robosandbox.errors import CollisionError, Phase, PlacementError, SkillError
from robosandbox.evidence import CollisionEvidence, PlacementEvidence
from robosandbox.types import SIDE_AXES, Array, DetectedObject, ObservedScene, Pose, Side
from robosandbox.world import relations
from robosandbox.world.effects import put, slid
from robosandbox.world.facts import TABLE, Fact, fact
from robosandbox.world.parts import at_value, is_part, open_value
from robosandbox.world.placement_sampling import (
    Placement,
    about_level,
    about_z,
    at_its_height,
    free_placements,
    levelled,
    margin_on_table,
    placements_on,
    points_beside,
    resting_pose,
    table_placements,
    with_pose,
    yaw_to_align,
)
from robosandbox.world.predicate import Finding, View, is_clearly_seen, predicate, sentence
from robosandbox.world.relations import BESIDE_GAP, REST_TOLERANCE, bottom, bounds, centre, gap, rest_height, support

# How far from its mark the centre of an object counts as there, metres; chosen far above what a placement leaves.
AT_TOLERANCE = 0.015
# Heading within which an object counts as turned that way, radians; chosen as in `turn` (TURN_TOLERANCE).
_TURN_TOLERANCE = math.radians(10.0)
# Beyond this angle between its axis and the vertical what stands by itself has tipped over, radians; chosen between the
# few degrees that perception is off by and the 45 at which a cube falls by itself.
TIPPED = math.radians(30.0)
# An axis counts as vertical whose cosine to the vertical is above this; chosen as 3 degrees, several times what
# perception was measured to be off by (0.4, docs/measured.md).
_LEVEL = math.cos(math.radians(3.0))
# By how much what leans on something lies over it at least, metres; chosen as more than perception is off by.
_OVERLAP = 0.01
# By how much an up direction is tilted to feel how wide the face on top is, radians; chosen larger than what perception
# is off by, so that a tilted face is still felt, and small enough to be stopped by a chamfer.
_FEELER = math.radians(4.0)
# Least half-width of a face on which something stays, metres; chosen as the few millimetres that a placement is off by.
_LEAST_FACE = 0.004
# Shares of its way at which an opening door is looked at for what would stand in its way.
_OPENINGS = (0.25, 0.5, 0.75, 1.0)
_COMPASS = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)


def tilt(item: DetectedObject) -> float:
    """Return the angle between an object's own z and the vertical, radians; either end up is upright but for containers."""
    upward = float(item.pose.rotation[2, 2])
    return math.acos(max(-1.0, min(1.0, upward if item.shape.holds_things else abs(upward))))


def occupied(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    """Return the error of a place without room for an object, named first."""
    target = ", ".join(str(value) for value in arguments[1:])
    return PlacementError(
        sentence(finding),
        phase=Phase.CHECK,
        evidence=PlacementEvidence(
            object=str(arguments[0]), target=target, reason="occupied", blocking=finding.blocking
        ),
    )


def unsuitable(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    """Return the error of a thing that nothing can be put on or into, whoever asks."""
    return PlacementError(
        sentence(finding),
        phase=Phase.CHECK,
        evidence=PlacementEvidence(object=view.scene.held or "", target=str(arguments[0]), reason="unsuitable"),
    )


def _covered(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    del view
    return CollisionError(
        sentence(finding),
        phase=Phase.CHECK,
        evidence=CollisionEvidence(
            body=str(arguments[0]), other=finding.blocking[0], depth=0.0, waypoint=0, waypoints=1
        ),
    )


def _put_on(scene: ObservedScene, a: str, b: str) -> ObservedScene:
    item, base = scene.find(a), scene.find(b)
    if item is None:
        return scene
    if base is None:
        return _stood(scene, item, centre(item)[:2], 0.0)
    spots, _ = placements_on(item, base, scene.objects)
    heading = yaw_to_align(item, base)
    if not spots:
        return _stood(scene, item, centre(base)[:2], heading, rest_height(item, base))
    turned = spots[0].rotation(levelled(item), heading if spots[0].lean is None else spots[0].yaws[0])
    return put(scene, a, resting_pose(item, spots[0], turned))


def _stood(
    scene: ObservedScene,
    item: DetectedObject,
    point: Sequence[float] | Array,
    heading: float,
    height: float | None = None,
) -> ObservedScene:
    """Return the scene with an object's middle over a point, x and y, of the table or at another height, turned by a heading."""
    xy = float(point[0]), float(point[1])
    spot = Placement(xy, scene.table_height if height is None else height, (), by_middle=True)
    return put(scene, item.id, resting_pose(item, spot, about_z(heading) @ levelled(item)))


def _put_beside(scene: ObservedScene, a: str, b: str, side: Side) -> ObservedScene:
    item, other = scene.find(a), scene.find(b)
    if item is None or other is None:
        return scene
    points = points_beside(item, other, side)
    spots, _ = table_placements(scene, item, points)
    return _stood(scene, item, spots[0].xy, spots[0].yaws[0]) if spots else _stood(scene, item, points[0], 0.0)


def _put_at(scene: ObservedScene, a: str, x: float, y: float, yaw: float | None = None) -> ObservedScene:
    item = scene.find(a)
    if item is None:
        return scene
    if yaw is not None:
        return _stood(scene, item, (x, y), yaw - item.pose.yaw)
    spots, _ = table_placements(scene, item, [np.array([x, y])])
    return _stood(scene, item, (x, y), spots[0].yaws[0] if spots else 0.0)


def _righted(scene: ObservedScene, a: str) -> ObservedScene:
    item = scene.find(a)
    if item is None:
        return scene
    upright = about_z(math.atan2(item.pose.rotation[1, 0], item.pose.rotation[0, 0]))
    there = Pose.from_matrix(item.pose.position, upright)
    up = bottom(item) - bottom(replace(item, pose=there))
    return put(scene, a, Pose.from_matrix(there.position + [0.0, 0.0, up], upright))


def _laid(scene: ObservedScene, a: str) -> ObservedScene:
    item = scene.find(a)
    if item is None or abs(float(item.pose.rotation[2, 2])) < math.sin(TIPPED):
        return scene
    level = levelled(item)
    there = Pose.from_matrix(item.pose.position, about_level(math.atan2(level[1, 0], level[0, 0])) @ level)
    up = bottom(item) - bottom(replace(item, pose=there))
    return put(scene, a, Pose.from_matrix(there.position + [0.0, 0.0, up], there.rotation))


def standing_on(view: View, b: str) -> list[DetectedObject]:
    """Return what stands on an object."""
    base = view.get(b)
    others = [item for item in view.others(b) if not item.shape.is_granular]
    return [item for item in others if relations.stands_on(item, base) or _leans_on(item, base)]


def _leans_on(item: DetectedObject, base: DetectedObject) -> bool:
    """Tell whether an object that does not stand level lies partly over another, which bears it then."""
    if relations.apart(item, base):
        return False
    rotation = np.abs(item.pose.rotation[2])
    if rotation.max() > _LEVEL or centre(item)[2] < relations.top(base) or relations.gap(base, item) > -_OVERLAP:
        return False
    return not any(relations.lies_in(other, one) for one, other in ((base, item), (item, base)))


def face_half_width(item: DetectedObject, up: float = 1.0) -> float:
    """Return how far the flat face on top of an object reaches from its middle in the narrowest direction, metres.

    Felt with its support function: where `up` is tilted by a little, h grows with the width of a flat face, and hardly where
    the top is round. Not above zero where the top is no level face.

    Args:
        item: The object.
        up: 1 for its top, -1 for its bottom.
    """
    middle = centre(item)
    sines, cosines = math.sin(_FEELER), math.cos(_FEELER)
    around = np.column_stack([np.cos(_COMPASS) * sines, np.sin(_COMPASS) * sines, np.full(len(_COMPASS), up * cosines)])
    straight = np.array([[0.0, 0.0, up]])
    height = float((support(item, straight) - straight @ middle)[0])
    reach = support(item, around) - around @ middle
    return float(((reach - cosines * height) / sines).min())


@predicate("object", "place", effect=_put_on, lasts=True)
def on(view: View, a: str, b: str) -> Finding:
    """An object stands on another, or on the table."""
    item = view.get(a)
    if a in view.scene.in_hands:
        return Finding(holds=False, cause=f"{a} is in the gripper", help=f"place it on {b}")
    if b == TABLE:
        found, base = relations.on_table(item, view.scene.table_height), item
        vessels = [other for other in view.others(a) if other.shape.holds_things]
        if found.holds and any(relations.lies_in(item, vessel) for vessel in vessels):
            # A container's floor is no thicker than the tolerance.
            found = replace(found, holds=False)
    else:
        base = view.get(b)
        found = relations.on_top(item, base)
    off = abs(found.detail["clearance_mm"]) / 1e3
    return Finding(
        holds=found.holds,
        margin=min(REST_TOLERANCE - off, found.detail.get("margin_mm", math.inf) / 1e3),
        tolerance=REST_TOLERANCE,
        is_sure=is_clearly_seen(item, base),
        cause=f"{a} does not stand on {b}",
        help=f"place {a} on {b}",
    )


@predicate("object", "object", "word", effect=_put_beside, lasts=True)
def beside(view: View, a: str, b: str, side: Side) -> Finding:
    """An object stands next to another on one side: left, right, front or back."""
    if side not in SIDE_AXES:
        return Finding(holds=False, cause=f"{side!r} is no side", help=f"there is {', '.join(SIDE_AXES)}")
    item, other = view.get(a), view.get(b)
    found = relations.beside(item, other, side)
    return Finding(
        holds=found.holds and a not in view.scene.in_hands,
        margin=BESIDE_GAP - found.detail["gap_mm"] / 1e3,
        tolerance=BESIDE_GAP,
        is_sure=is_clearly_seen(item, other),
        cause=f"{a} does not stand {side} of {b}",
        help=f"place {a} there",
    )


@predicate("object", "number", "number", "number?", effect=_put_at, lasts=True)
def at(view: View, a: str, x: float, y: float, yaw: float | None = None) -> Finding:
    """An object stands at a point of the table, metres, turned by an angle, radians."""
    item = view.get(a)
    off = math.dist(centre(item)[:2], (x, y))
    tolerance = AT_TOLERANCE + view.slack
    turned_off = 0.0 if yaw is None else abs(math.remainder(item.pose.yaw - yaw, math.tau))
    stands = relations.on_table(item, view.scene.table_height).holds
    return Finding(
        holds=off < tolerance and turned_off < _TURN_TOLERANCE and stands and a not in view.scene.in_hands,
        margin=tolerance - off,
        tolerance=tolerance,
        is_sure=is_clearly_seen(item),
        cause=f"{a} is {1e3 * off:.0f} mm from ({x:.3f}, {y:.3f})" if stands else f"{a} does not stand on the table",
        help=f"place {a} there",
    )


@predicate("object", effect=_righted, lasts=True)
def upright(view: View, a: str) -> Finding:
    """An object's own axis is about vertical."""
    item = view.get(a)
    angle = tilt(item)
    return Finding(
        holds=angle < TIPPED,
        margin=TIPPED - angle,
        tolerance=TIPPED,
        is_sure=is_clearly_seen(item),
        cause=f"{a} has tipped over",
        help="set it upright first",
        remedies=(fact("upright", a),),
    )


@predicate("object", effect=_laid, lasts=True)
def lying(view: View, a: str) -> Finding:
    """An object's own axis is about level: it lies on its side."""
    angle = math.asin(min(1.0, abs(float(view.get(a).pose.rotation[2, 2]))))
    return Finding(
        holds=angle < TIPPED,
        margin=TIPPED - angle,
        tolerance=TIPPED,
        is_sure=is_clearly_seen(view.get(a)),
        cause=f"{a} does not lie on its side",
        help="lay it down first",
        remedies=(fact("lying", a),),
    )


@predicate("object", blame=_covered)
def clear(view: View, a: str) -> Finding:
    """Nothing stands on an object."""
    names = tuple(item.id for item in standing_on(view, a))
    verb = "stands" if len(names) == 1 else "stand"
    return Finding(
        holds=not names,
        is_sure=is_clearly_seen(view.get(a)),
        cause=f"{', '.join(names)} {verb} on {a} and would fall when that is moved",
        help=f"put {names[0]} aside first" if names else "",
        blocking=names,
        remedies=tuple(fact("on", name, TABLE) for name in names),
    )


@predicate("object", "object", blame=occupied)
def room_on(view: View, a: str, b: str) -> Finding:
    """Nothing but an object itself stands on another that it is to stand on."""
    names = tuple(item.id for item in standing_on(view, b) if item.id != a)
    if view.get(b).is_fixed:
        # There is room beside one another.
        spots, names = placements_on(view.get(a), view.get(b), view.scene.objects)
        names = () if spots else tuple(name for name in names if not view.get(name).is_fixed)
    return Finding(
        holds=not names,
        is_sure=is_clearly_seen(view.get(b)),
        cause=f"no room for {a} at {b}: occupied by {', '.join(names)}",
        help="clear it or choose another place",
        blocking=names,
        remedies=tuple(fact("on", name, TABLE) for name in names),
    )


@predicate("object", fixed=True, blame=unsuitable)
def has_top(view: View, b: str) -> Finding:
    """Things can be stood on objects of this kind."""
    base = view.get(b)
    remedy = "use place_in" if base.shape.holds_things else "choose something with a flat top"
    return Finding(
        holds=base.shape.flat_top, cause=f"{b} is {base.shape.name}: nothing stays on top of it", help=remedy
    )


@predicate("object", blame=unsuitable)
def supports(view: View, b: str) -> Finding:
    """An object has a level face on top, as it lies or stands, wide enough for things to stay."""
    base = view.get(b)
    surface = base.shape.surface(base, 0.0)
    slopes = [face.half_width for face in relations.slopes_of(base)]
    margin = max([face_half_width(base) if surface is None else surface.half_width, *slopes]) - _LEAST_FACE
    return Finding(
        holds=margin > 0.0,
        margin=margin,
        tolerance=_LEAST_FACE,
        is_sure=is_clearly_seen(base),
        cause=f"{b} has no level face on top as it lies: nothing stays there",
        help="choose something with a flat top, or turn it over first",
    )


def _cleared(view: View, blocking: Sequence[str]) -> tuple[Fact, ...]:
    """Return what would clear a place; nothing where something fixed stands there, which nobody puts aside."""
    if any(view.get(name).is_fixed for name in blocking):
        return ()
    return tuple(fact("on", name, TABLE) for name in blocking)


def _table_room(view: View, item: DetectedObject, points: Sequence[Array], where: str) -> Finding:
    spots, blocking = table_placements(view.scene, item, points)
    off = all(margin_on_table(view.scene.table_area, point) < 0.0 for point in points)
    why = f"occupied by {', '.join(blocking)}" if blocking else "off the table or too small"
    return Finding(
        holds=bool(spots),
        is_sure=is_clearly_seen(item),
        cause=f"no room for {item.id} at {where}: {why}",
        help="choose a place on the table" if off else "clear it or choose another place",
        blocking=blocking,
        remedies=_cleared(view, blocking),
    )


def _free_spots(view: View, a: str) -> Iterator[tuple[float, float]]:
    """Yield free points of the table in easy reach, the nearest to an object first, but not where drawers open."""
    item = view.get(a)
    scene = view.scene
    for other in scene.objects:
        if other.shape.opens:
            scene = slid(scene, other.id, other.shape.max_open(other.size))
        elif is_part(other):
            # All along its way.
            opened = [at_value(other, open_value(other, share)) for share in _OPENINGS]
            stations = (replace(one, id=f"{other.id}/{number}") for number, one in enumerate(opened))
            scene = replace(scene, objects=(*scene.objects, *stations))
    # It is put aside since it is in the way where it is, or was picked: there it counts as standing still.
    down = scene.table_height - bottom(item)
    there = Pose.from_matrix(item.pose.position + [0.0, 0.0, down], item.pose.rotation)
    scene = replace(scene, objects=(*scene.objects, replace(item, id=f"{a}/before", pose=there)))
    for spot in free_placements(scene, item):
        yield round(spot.xy[0], 3) + 0.0, round(spot.xy[1], 3) + 0.0


@predicate("object", "number", "number", blame=occupied, choices=_free_spots)
def room_at(view: View, a: str, x: float, y: float) -> Finding:
    """An object has room to stand at a point of the table, metres."""
    return _table_room(view, view.get(a), [np.array([x, y])], f"({x:.3f}, {y:.3f})")


@predicate("object", "number", "number", blame=occupied)
def room_to_slide_to(view: View, a: str, x: float, y: float) -> Finding:
    """An object that slides along the table has room at a point of it, metres; what is over it is not in its way."""
    item, point = view.get(a), np.array([x, y])
    offset = np.array([*(point - centre(item)[:2]), 0.0])
    there = with_pose(item, Pose.from_matrix(item.pose.position + offset, item.pose.rotation))
    low, high = bounds(item)
    off = margin_on_table(view.scene.table_area, point, (high - low)[:2] / 2.0) < 0.0
    blocking = tuple(
        other.id for other in view.others(a) if any(gap(there, piece) < 0.0 for piece in at_its_height(there, other))
    )
    why = f"occupied by {', '.join(blocking)}" if blocking else "off the table"
    return Finding(
        holds=not off and not blocking,
        is_sure=is_clearly_seen(item),
        cause=f"no room for {a} at ({x:.3f}, {y:.3f}): {why}",
        help="choose a place on the table" if off else "clear it or choose another place",
        blocking=blocking,
        remedies=_cleared(view, blocking),
    )


@predicate("object", "object", "word", blame=occupied)
def room_beside(view: View, a: str, b: str, side: Side) -> Finding:
    """An object has room on one side of another."""
    item = view.get(a)
    return _table_room(view, item, points_beside(item, view.get(b), side), f"{side} of {b}")
