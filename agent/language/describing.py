"""Descriptions of a thing in answers: where it is, what it is, how big, and how far from another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robosandbox.agent.language.discourse import listed
from robosandbox.types import SIDE_AXES, DetectedObject, ObservedScene
from robosandbox.world.facts import TABLE
from robosandbox.world.locations import location_of
from robosandbox.world.relations import bounds, centre, contents

# Least offset for which a thing counts as on that side of another, metres. Chosen: what an eye tells on a table.
_ASIDE = 0.01


def place(scene: ObservedScene, item: DetectedObject) -> str:
    """Return what a thing is on or in."""
    if item.shape.is_granular:
        vessels = [other for other in scene.objects if other.shape.holds_things and other.id != scene.held]
        inside = {one.id: sum(name == item.id for name, _ in contents(scene.objects, one)) for one in vessels}
        return listed([f"{count} in {name}" for name, count in inside.items() if count]) or "in no container"
    at = location_of(scene, item)
    if at is None:
        return f"{length(float(centre(item)[2]) - scene.table_height)} above the table's top"
    if at.relation == "holding":
        return "in the gripper"
    below = str(at.arguments[-1])
    return f"{'in' if at.relation == 'inside' else 'on'} {'the table' if below == TABLE else below}"


def whereabouts(scene: ObservedScene, item: DetectedObject) -> str:
    """Return a sentence on where a thing is, in the world and from the robot."""
    x, y, _ = centre(item)
    be = "are" if item.shape.is_plural else "is"
    near = length(from_base(scene, item))
    return f"{item.id} {be} {place(scene, item)}, at ({x:.2f}, {y:.2f}) m, {near} from the robot's base."


def description(scene: ObservedScene, item: DetectedObject) -> str:
    """Return a sentence on what a thing is."""
    kind = f"{item.colour} {item.shape.nouns[0]}".strip()
    article = "an" if kind[:1] in "aeiou" else "a"
    return f"{item.id} is {article} {kind} of {size(item)}, {place(scene, item)}."


def from_base(scene: ObservedScene, item: DetectedObject) -> float:
    """Return how far a thing is from the robot's base seen from above, metres."""
    return float(np.hypot(*(centre(item)[:2] - np.array(scene.base_xy))))


def apart(one: DetectedObject, two: DetectedObject) -> float:
    """Return the distance between two centres, metres."""
    return float(np.linalg.norm(centre(one) - centre(two)))


def side_of(item: DetectedObject, other: DetectedObject) -> str:
    """Return on which side of another a thing is; "" where both are at about one place."""
    offset = (centre(item) - centre(other))[:2]
    along = {name: float(np.dot(axis, offset)) for name, axis in SIDE_AXES.items()}
    best = max(along, key=lambda name: along[name])
    return best if along[best] > _ASIDE else ""


def measure(item: DetectedObject, word: str) -> float:
    """Return what a comparative compares: height, the longest side seen from above, or all three sides together."""
    low, high = bounds(item)
    sides = high - low
    if word in ("taller", "higher", "shorter"):
        return float(sides[2])
    return float(max(sides[:2])) if word in ("wider", "longer") else float(np.prod(sides))


def size(item: DetectedObject) -> str:
    """Return the three extents of a thing, the largest first."""
    return " x ".join(f"{1e3 * float(value):.0f}" for value in item.shape.extents(item.size)[::-1]) + " mm"


def length(metres: float) -> str:
    """Return a length for people."""
    return f"{100.0 * metres:.0f} cm" if metres >= 0.1 else f"{1000.0 * metres:.0f} mm"


def be(names: Sequence[str]) -> str:
    """Return the verb for so many things."""
    return "is" if len(names) == 1 else "are"
