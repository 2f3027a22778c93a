"""Effects of steps on a scene: things carried with their load, put down, drawers slid; geometry, no physics."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from robosandbox.types import Array, DetectedObject, ObservedScene, Pose
from robosandbox.world.placement_sampling import levelled
from robosandbox.world.relations import bottom, centre, contents, parts_in, stands_on

# Height over the table at which what is held is thought of, metres: over everything that stands on tables here.
_CARRIED = 0.5


def load_of(scene: ObservedScene, name: str) -> tuple[str, ...]:
    """Return the ids of what stands on an object or lies in it, however deep: it moves along."""
    found, held = list[str](), scene.in_hands
    below = [name]
    while below:
        base = scene.find(below.pop())
        if base is None:
            continue
        for item in scene.objects:
            if item.id not in (name, base.id, *held, *found) and _rests(item, base):
                found.append(item.id)
                below.append(item.id)
    return tuple(found)


def carried(scene: ObservedScene, name: str, pose: Pose) -> ObservedScene:
    """Return the scene with an object at a pose, and its load moved along rigidly."""
    item = scene.find(name)
    if item is None:
        return scene
    shift = pose @ item.pose.inverse()
    load = load_of(scene, name)
    moved = [replace(item, pose=pose, grains=_shifted(item.grains, shift))]
    moved += [_with_shift(other, shift, item) for other in scene.objects if other.id in load]
    return with_objects(scene, moved)


def taken(scene: ObservedScene, name: str, hand: str | None = None) -> ObservedScene:
    """Return the scene with an object in a hand, the one that calls are made with where none is named, up in the air."""
    item = scene.find(name)
    if item is None:
        return scene
    up = scene.table_height + _CARRIED - bottom(item)
    lifted = Pose.from_matrix(item.pose.position + [0.0, 0.0, up], item.pose.rotation)
    return carried(scene, name, lifted).holding(name, hand)


def put(scene: ObservedScene, name: str, pose: Pose) -> ObservedScene:
    """Return the scene with an object standing at a pose, no longer held."""
    return carried(scene, name, pose).letting_go(name)


def shifted(scene: ObservedScene, name: str, offset: Array) -> ObservedScene:
    """Return the scene with an object moved by an offset (3,), metres."""
    item = scene.find(name)
    if item is None:
        return scene
    return carried(scene, name, Pose.from_matrix(item.pose.position + offset, item.pose.rotation))


def turned(scene: ObservedScene, name: str, rotation: Array) -> ObservedScene:
    """Return the scene with an object turned about its centre by a rotation (3, 3) of the world, its bottom as high as before."""
    item = scene.find(name)
    if item is None:
        return scene
    middle = centre(item)
    there = Pose.from_matrix(middle + rotation @ (item.pose.position - middle), rotation @ item.pose.rotation)
    up = bottom(item) - bottom(replace(item, pose=there))
    return carried(scene, name, Pose.from_matrix(there.position + [0.0, 0.0, up], there.rotation))


def slid(scene: ObservedScene, name: str, opening: float) -> ObservedScene:
    """Return the scene with a drawer open by so much, metres, and what lies in it moved along."""
    drawer = scene.find(name)
    if drawer is None:
        return scene
    out = -drawer.pose.rotation[:, 0] * (opening - (drawer.opening or 0.0))
    shift = Pose(xyz=(float(out[0]), float(out[1]), float(out[2])))
    within = {item for item, _ in contents(scene.objects, drawer) if item not in scene.in_hands}
    load = within.union(*(load_of(scene, item) for item in within))
    moved = [replace(drawer, opening=opening)]
    moved += [_with_shift(other, shift, drawer) for other in scene.objects if other.id in load]
    return with_objects(scene, moved)


def poured_into(scene: ObservedScene, source: str, target: str) -> ObservedScene:
    """Return the scene with what one container held in another."""
    vessel, into = scene.find(source), scene.find(target)
    if vessel is None or into is None:
        return scene
    room = into.shape.mouth(into)
    if room is None:
        return scene
    floor = into.pose.position + into.pose.rotation @ np.array([*room.middle, room.floor])
    cargo = contents(scene.objects, vessel)
    moved = []
    for item in scene.objects:
        parts = {number for name, number in cargo if name == item.id}
        if not parts:
            continue
        spot = floor + [0.0, 0.0, 2.0 * item.size[0]] if item.size else floor
        if item.shape.is_granular:
            grains = [tuple(map(float, spot)) if k in parts else grain for k, grain in enumerate(item.grains)]
            moved.append(replace(item, grains=tuple((x, y, z) for x, y, z in grains)))
        else:
            there = Pose.from_matrix(spot, levelled(item))
            up = float(floor[2]) - bottom(replace(item, pose=there)) + 1e-3
            moved.append(replace(item, pose=Pose.from_matrix(spot + [0.0, 0.0, up], there.rotation)))
    return with_objects(scene, moved)


def with_objects(scene: ObservedScene, changed: Iterable[DetectedObject]) -> ObservedScene:
    """Return the scene with these objects in place of those of the same ids."""
    by_id = {item.id: item for item in changed}
    return replace(scene, objects=tuple(by_id.get(item.id, item) for item in scene.objects))


def _rests(item: DetectedObject, base: DetectedObject) -> bool:
    return bool(parts_in(item, base)) or (not item.shape.is_granular and stands_on(item, base))


def _with_shift(item: DetectedObject, shift: Pose, vessel: DetectedObject) -> DetectedObject:
    """Return an object of a load moved along; of many grains those in the vessel."""
    if not item.shape.is_granular:
        return replace(item, pose=shift @ item.pose)
    within = {*parts_in(item, vessel)}
    moved = _shifted(item.grains, shift)
    pairs = zip(moved, item.grains, strict=True)
    grains = tuple(new if k in within else old for k, (new, old) in enumerate(pairs))
    return replace(item, grains=grains)


def _shifted(grains: tuple[tuple[float, float, float], ...], shift: Pose) -> tuple[tuple[float, float, float], ...]:
    rotation, offset = shift.rotation, shift.position
    points = (rotation @ np.array(grain) + offset for grain in grains)
    return tuple((float(x), float(y), float(z)) for x, y, z in points)
