"""Stillness of objects, seen look by look."""

from __future__ import annotations

import math

import numpy as np

from robosandbox.types import DetectedObject, ObservedScene, Pose
from robosandbox.world.parts import lever, part_value

# Seconds between two looks; chosen so that what falls has moved by 50 mm.
LOOK_SECONDS = 0.1
# Metres along an axis below which a thing stands still between two looks; chosen as 5 mm/s, at which nothing rolls or falls.
_STILL = 0.0005
# Angle below which it does, radians: ten times what was measured of things put down upright (0.017 degrees).
_UNTURNED = math.radians(0.15)
# Angle that pixels are wrong by, radians (p95, docs/measured.md): what turns by less stands still where it turns no faster than
# before.
_TURN_NOISE = math.radians(1.6)


class Stillness:
    """Objects that are looked at every `LOOK_SECONDS`.

    Args:
        scene: The first look.
        names: Ids of the objects.
    """

    def __init__(self, scene: ObservedScene, names: tuple[str, ...]) -> None:
        self._names = names
        self._before = scene
        self._turns: dict[str, float] = {}

    def seen(self, now: ObservedScene) -> bool:
        """Take another look; tell whether all objects are seen in it, where they were at the look before."""
        pairs = {name: (self._before.find(name), now.find(name)) for name in self._names}
        poses = {name: (a.pose, b.pose) for name, (a, b) in pairs.items() if a and b}
        turns = {name: a.angle_to(b) for name, (a, b) in poses.items()}
        still = not any(_runs(a, b) for a, b in pairs.values() if a and b) and all(
            _stays(*pair) and (turns[name] < _UNTURNED or turns[name] <= min(self._turns.get(name, 0.0), _TURN_NOISE))
            for name, pair in poses.items()
        )
        self._before, self._turns = now, turns
        return still and len(poses) == len(self._names)


def _stays(before: Pose, after: Pose) -> bool:
    return bool(np.abs(before.position - after.position).max() < _STILL)


def _runs(before: DetectedObject, after: DetectedObject) -> bool:
    """Tell whether a part of a scene's file goes along its joint: one that nothing brakes does so at an even speed."""
    if after.geometry is None or after.geometry.joint is None:
        return False
    return abs(part_value(after) - part_value(before)) * lever(after) >= _STILL
