"""Whether the fingers of a grasp have room between what stands around."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robosandbox.robots.spec import GripperGeometry
from robosandbox.types import DetectedObject, Grasp, ObservedScene, Pose
from robosandbox.world.relations import bounds, gap, top

_NEAR = 0.15  # Metres within which something stands near enough to be touched by fingers. Chosen: about an open hand.
_OPENING = 0.006  # Metres that each finger opens beyond the object on its way down. Chosen: twice `FINGER_CLEARANCE`.


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
        lowest = bounds(finger)[0][2]
        if any(top(item) > lowest and gap(finger, item) < 0.0 for item in near):
            return False
    return True
