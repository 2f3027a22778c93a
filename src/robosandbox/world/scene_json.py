"""The scene as data for a model: where things are, what stands on and in what, what is open, what is within reach."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from robosandbox.shapes.hull import SphereHull
from robosandbox.types import DetectedObject, ObservedScene
from robosandbox.world.facts import TABLE
from robosandbox.world.locations import location_of
from robosandbox.world.placement_sampling import in_easy_reach
from robosandbox.world.relations import CLOSED_WITHIN, contents, parts_in
from robosandbox.world.standing import TIPPED, tilt

_CLEAR = 0.9  # Confidence, a probability, below which a model is told how sure perception is. Chosen.

# Metres and radians by which a thing may seem to move while it lies. Chosen: above the rounding of what is described.
_STAYS = 0.002
# Radians, likewise; chosen as 1 degree.
_TURNS = 0.02


def describe_scene(scene: ObservedScene) -> dict[str, Any]:
    """Return what perception sees as JSON data.

    Lengths are metres to the millimetre, angles radians to the hundredth, in the world frame. What is usual is left out: a
    thing says where it is held up (`on`, `in`) unless nothing is seen to, `reachable` only where it is false, `tipped_over`
    only where it is true.
    """
    near, far = scene.reach
    data: dict[str, Any] = {
        "table_height": _length(scene.table_height),
        "robot_base": _lengths(scene.base_xy),
        "reach_from_base": [_length(near), _length(far)],
        "held": dict(scene.hands) if len(scene.hands) > 1 else scene.held,
        "objects": [_thing(item, scene) for item in scene.objects],
    }
    if scene.notes:
        data["notes"] = list(scene.notes)
    return data


def scene_changes(before: ObservedScene, after: ObservedScene) -> dict[str, Any]:
    """Return what of `describe_scene` is otherwise now: things as they are now, and the ids of those that are not seen any more."""
    was, now = describe_scene(before), describe_scene(after)
    old = {thing["id"]: thing for thing in was["objects"]}
    data: dict[str, Any] = {"held": now["held"]}
    data["objects"] = [thing for thing in now["objects"] if _differs(old.get(thing["id"]), thing)]
    gone = [name for name in old if after.find(name) is None]
    return data | ({"gone": gone} if gone else {}) | ({"notes": now["notes"]} if now.get("notes") else {})


def _differs(was: dict[str, Any] | None, now: dict[str, Any]) -> bool:
    """Say whether a thing is described otherwise; one that lies where it lay to a rounding is not."""
    if was is None or was.keys() != now.keys():
        return True
    near = (
        math.dist(was["position"], now["position"]) <= _STAYS and abs(was.get("yaw", 0) - now.get("yaw", 0)) <= _TURNS
    )
    return not near or any(was[key] != now[key] for key in now if key not in ("position", "yaw"))


def _thing(item: DetectedObject, scene: ObservedScene) -> dict[str, Any]:
    data: dict[str, Any] = {"id": item.id, "kind": item.kind, "colour": item.colour}
    if item.tag is not None:
        data["tag"] = item.tag
    data["position"] = _lengths(item.pose.xyz)
    if not isinstance(item.shape.hull(item.size), SphereHull):
        data["yaw"] = round(item.pose.yaw, 2) + 0.0
    names = item.shape.size_fields
    data["size"] = dict(zip(names, _lengths(item.size), strict=False)) or {"half_extents": _lengths(item.size)}
    if item.shape.is_granular:
        data["count"] = len(item.grains)
    if item.shape.opens:
        data |= _opening(item)
    data |= _support(item, scene)
    if item.shape.holds_things:
        data["contents"] = _contents(item, scene)
    if tilt(item) > TIPPED and (item.shape.rolls or item.shape.is_open_container):
        data["tipped_over"] = True
    if not in_easy_reach(scene, item):
        data["reachable"] = False
    if item.confidence < _CLEAR:
        data["confidence"] = round(item.confidence, 1)
    return data


def _opening(item: DetectedObject) -> dict[str, Any]:
    """Return how far a drawer is open; unknown where that is not seen."""
    if item.opening is None:
        return {"state": "unknown"}
    return {"state": "closed" if item.opening < CLOSED_WITHIN else "open", "open_by": _length(item.opening)}


def _support(item: DetectedObject, scene: ObservedScene) -> dict[str, Any]:
    """Return what an object is held, or lies in, or stands on."""
    place = location_of(scene, item)
    if place is None:
        return _scattered(item, scene) if item.shape.is_granular else {}
    match place.relation:
        case "holding":
            return {"in": "gripper"}
        case "inside":
            return _scattered(item, scene) if item.shape.is_granular else {"in": place.arguments[1]}
        case _:
            return {"on": place.arguments[1]}


def _scattered(item: DetectedObject, scene: ObservedScene) -> dict[str, Any]:
    """Return which containers beads lie in, with numbers where not all of them lie in one; on the table where none does."""
    vessels = (other for other in scene.objects if other.id != item.id)
    found = {vessel.id: len(within) for vessel in vessels if (within := parts_in(item, vessel))}
    if not found:
        return {"on": TABLE}
    whole = list(found.values()) == [len(item.grains)]
    return {"in": next(iter(found)) if whole else found}


def _contents(vessel: DetectedObject, scene: ObservedScene) -> list[str] | dict[str, int]:
    """Return what lies in a container: ids, and of beads how many."""
    others = [item for item in scene.objects if item.id not in scene.in_hands]
    counts = Counter(name for name, _ in contents(others, vessel))
    return dict(counts) if any(count > 1 for count in counts.values()) else list(counts)


def _length(value: float) -> float:
    # Adding zero turns a rounded -0.0 into 0.0.
    return round(float(value), 3) + 0.0


def _lengths(values: Sequence[float]) -> list[float]:
    return [_length(value) for value in values]
