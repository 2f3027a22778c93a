"""Room for the fingers of a grasp between what stands around."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robosandbox.types import DetectedObject, Grasp, ObservedScene, Pose
from robosandbox.types.robot import GripperGeometry
from robosandbox.world.nearness import nearer
from robosandbox.world.relations import bottom, bounds, support, top

_NEAR = 0.15  # Metres within which something stands near enough to be touched by fingers. Chosen: about an open hand.
_STRAIGHT = 0.999  # Cosine of the angle to the vertical up to which a hand points straight down. Chosen: 2.6 degrees.
_CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
# Metres that each finger opens beyond the object on its way down. Chosen: six times `FINGER_CLEARANCE`.
_OPENING = 0.006


def neighbours(target: DetectedObject, scene: ObservedScene) -> list[DetectedObject]:
    """Return what stands near enough to be touched by fingers that hold the target."""
    low, high = bounds(target)
    found = []
    for item in scene.objects:
        # Grains give way.
        if item.id == target.id or item.shape.is_granular:
            continue
        other_low, other_high = bounds(item)
        if (other_low[:2] < high[:2] + _NEAR).all() and (other_high[:2] > low[:2] - _NEAR).all():
            found.append(item)
    return found


def is_alone(
    target: DetectedObject, near: Sequence[DetectedObject], geometry: GripperGeometry, palm: tuple[float, ...]
) -> bool:
    """Tell whether a hand from above has room around an object whichever way it is turned: a bound that is cheap to tell.

    All that stands near is a finger's way from the object, and lower than a palm over fingertips that touch the ground, or
    beyond the palm.

    Args:
        target: The object.
        near: What stands near it.
        geometry: The gripper's figures.
        palm: x_min, x_max, y_min, y_max of the hand in the TCP frame, metres.
    """
    height = bottom(target) + geometry.tip_depth + geometry.palm_depth - _OPENING
    finger = geometry.finger_thickness + 2.0 * _OPENING
    radius = float(np.hypot(max(-palm[0], palm[1]), max(-palm[2], palm[3]))) + _OPENING
    low, high = bounds(target)
    for item in near:
        other_low, other_high = bounds(item)
        apart = float(np.maximum(other_low - high, low - other_high)[:2].max())
        if top(item) > height and apart < radius:
            return False
        if apart < finger and nearer(target, item, finger):
            return False
    return True


def may_meet(grasp: Grasp, near: Sequence[DetectedObject], geometry: GripperGeometry, palm: tuple[float, ...]) -> bool:
    """Tell whether anything that stands near may be in a hand's way that comes to a grasp; straight from above little may.

    Args:
        grasp: Where the hand closes.
        near: What stands near.
        geometry: The gripper's figures.
        palm: x_min, x_max, y_min, y_max of the hand in the TCP frame, metres.
    """
    if not near:
        return False
    if geometry.cup is not None or grasp.tcp_pose.rotation[2, 2] > -_STRAIGHT:
        return True
    height = grasp.tcp_pose.xyz[2] + geometry.palm_depth - _OPENING
    under = any(top(item) > height and _is_under(item, grasp, palm) for item in near)
    return under or not has_room(grasp, near, geometry)


def _is_under(item: DetectedObject, grasp: Grasp, palm: tuple[float, ...]) -> bool:
    """Tell whether an object is within a palm's bounds as seen along the approach."""
    axes, position = grasp.tcp_pose.rotation[:, :2].T, grasp.tcp_pose.position
    high, low = support(item, axes) - axes @ position, -support(item, -axes) - axes @ position
    (x_low, y_low), (x_high, y_high) = low - _OPENING, high + _OPENING
    return bool(x_low < palm[1] and x_high > palm[0] and y_low < palm[3] and y_high > palm[2])


def has_room(grasp: Grasp, near: Sequence[DetectedObject], geometry: GripperGeometry) -> bool:
    """Tell whether both fingers, opened a little, keep off these objects as seen from above and in height."""
    if not near:
        return True
    rotation, position = grasp.tcp_pose.rotation, grasp.tcp_pose.position
    middle, length = (geometry.tip_depth - geometry.palm_depth) / 2.0, geometry.tip_depth + geometry.palm_depth
    half = (geometry.finger_width / 2.0, geometry.finger_thickness / 2.0, length / 2.0)
    centre = geometry.centre(grasp.width)
    for side in (1.0, -1.0):
        aside = centre + side * (grasp.width / 2.0 + _OPENING + geometry.finger_thickness / 2.0)
        place = position + rotation @ np.array([0.0, aside, middle])
        finger = DetectedObject(
            id="", kind="box", size=half, colour="", rgba=(0, 0, 0, 1), pose=Pose.from_matrix(place, rotation)
        )
        lowest = float(bounds(finger)[0][2])
        if any(top(item) > lowest and nearer(finger, item, 0.0) and _stands_in(item, finger, lowest) for item in near):
            return False
    return True


def _stands_in(item: DetectedObject, finger: DetectedObject, lowest: float) -> bool:
    """Tell whether any of an object comes up under a finger as seen from above; what has a hollow may leave it room.

    Args:
        item: The object, whose hull is under the finger.
        finger: A box.
        lowest: Height of the finger's lowest point, metres.
    """
    rotation = item.pose.rotation
    if item.geometry is None or rotation[2, 2] < _STRAIGHT:
        return True
    corners = finger.pose.position + finger.shape.hull(finger.size).half_extents * _CORNERS @ finger.pose.rotation.T
    local = (corners - item.pose.position) @ rotation
    return item.geometry.grid.highest_in(local[:, :2]) > lowest - item.pose.xyz[2]
