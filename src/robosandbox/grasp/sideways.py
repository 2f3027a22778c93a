"""Grasps of a filled container from the side, so that its mouth stays free to pour from."""

from __future__ import annotations

import numpy as np

from robosandbox.types import Array, DetectedObject, Grasp, ObservedScene, Pose
from robosandbox.types.robot import GripperGeometry
from robosandbox.world.relations import centre, contents, support, top

_ROUND_DIRECTIONS = 16  # Number of directions around a round object. Chosen.
_ANGLES = tuple(np.radians([80.0, 68.0]))
_LEVEL = 0.55  # Share of its height at which it is held. Chosen over its middle, so that it hangs.
_CLEARANCE = 0.004  # Metres between finger or palm and the object. Chosen.
# Cosine of the tilt up to which an object stands upright. Chosen: 18 degrees, because what it holds stays in it.
_UPRIGHT = 0.95
_UP = np.array([0.0, 0.0, 1.0])


def is_filled(target: DetectedObject, scene: ObservedScene) -> bool:
    """Tell whether an upright container holds something that a hand over its mouth would keep in."""
    upright = float(target.pose.rotation[2, 2]) > _UPRIGHT
    return target.shape.pours and upright and bool(contents(scene.objects, target))


def sideways(target: DetectedObject, geometry: GripperGeometry, base: Array) -> list[Grasp]:
    """Return grasps across an upright container with the hand coming from the side, best first.

    Hands that point away from the robot come first, as arms reach.

    Args:
        target: The container.
        geometry: The gripper.
        base: Where the robot stands, shape (3,).
    """
    middle = centre(target)
    height = top(target) - (2.0 * middle[2] - top(target))
    outward = middle - base
    heading = float(np.arctan2(outward[1], outward[0]))
    found = []
    for azimuth in _headings(target):
        level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        closing = np.cross(_UP, level)
        high, low = support(target, np.array([closing, -closing]))
        width = float(high + low)
        if not geometry.min_aperture + 0.001 < width < geometry.max_aperture - 2.0 * _CLEARANCE:
            continue
        aside = geometry.centre(width)
        aside += np.sign(aside) * 0.004 if abs(aside) > 0.004 else 0.0
        turned = abs(float((azimuth - heading + np.pi) % (2.0 * np.pi) - np.pi))
        for angle in _ANGLES:
            approach = np.sin(angle) * level - np.cos(angle) * _UP
            point = middle + (_LEVEL - 0.5) * height * _UP
            # The palm stays behind what the hand meets first.
            near = float(support(target, -approach[None])[0] + approach @ point)
            point = point - max(0.0, near - geometry.palm_depth + _CLEARANCE) * approach
            for y in (closing, -closing):
                rotation = np.column_stack([np.cross(y, approach), y, approach])
                quality = 2.0 - 0.3 * turned - 0.2 * abs(angle - _ANGLES[0])
                pose = Pose.from_matrix(point - aside * y, rotation)
                found.append(Grasp(object=target.id, tcp_pose=pose, width=width, quality=quality, how="side"))
    return sorted(found, key=lambda grasp: -grasp.quality)


def _headings(target: DetectedObject) -> Array:
    """Return the directions from which it can be held squarely, radians about world z."""
    room = target.shape.room(target.size)
    if room is not None and not room.is_round:
        return np.asarray(target.pose.yaw + np.arange(4) * np.pi / 2.0, dtype=np.float64)
    return np.asarray(np.arange(_ROUND_DIRECTIONS) * 2.0 * np.pi / _ROUND_DIRECTIONS, dtype=np.float64)
