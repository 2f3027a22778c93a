"""Top-down grasps from an object's shape: closing directions across parallel faces or through an axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robosandbox.perception.relations import centre, support
from robosandbox.robots.robot import GripperGeometry, Robot
from robosandbox.types import Array, DetectedObject, Grasp, ObservedScene, Pose

_UP = np.array([0.0, 0.0, 1.0])
_ROUND_DIRECTIONS = 8
_HORIZONTAL = 0.2
_UPRIGHT = 0.9
_FINGER_CLEARANCE = 0.003
_FLOOR_CLEARANCE = 0.003
_LEAST_OVERLAP = 0.004
_JAW_CLEARANCE = 0.004
_TILTS = tuple(np.radians([0.0, 15.0, 30.0, 45.0, -20.0]))
_TILT_COST = 1.0


class AnalyticTopDown:
    """Candidates with the TCP pointing straight down, over all yaws at which the object fits the gripper.

    After them come the same tilted away from the robot's base, for arms and places where straight down is out of reach.
    """

    def candidates(self, target: DetectedObject, scene: ObservedScene, robot: Robot) -> Sequence[Grasp]:
        """Return grasps, best first; empty when the object is too wide, too flat, or there is no gripper.

        Args:
            target: What to hold.
            scene: Where it stands among others.
            robot: Its gripper's measured figures decide width and depth.
        """
        if robot.gripper is None:
            return ()
        geometry = robot.gripper.geometry
        grasps = []
        for tilt in _TILTS:
            height = self._tcp_height(target, geometry, tilt)
            if height is None:
                continue
            turn = lean(centre(target) - robot.base_position, tilt)
            for direction in closing_directions(target):
                width = width_along(target, direction)
                if not geometry.min_aperture + 0.001 < width < geometry.max_aperture - 2.0 * _FINGER_CLEARANCE:
                    continue
                point = centre(target)
                # The middle between the two touched surfaces, which for a tilted shape is not the centre.
                reach = support(target, np.array([direction, -direction]))
                point = point + direction * ((reach[0] - reach[1]) / 2.0 - direction @ point)
                # Beside a jaw that stands still, what is held is not at the TCP but half its width away.
                aside = geometry.centre(width)
                aside += np.sign(aside) * _JAW_CLEARANCE if abs(aside) > _JAW_CLEARANCE else 0.0
                quality = 1.0 - width / geometry.max_aperture - 5.0 * abs(height - point[2]) - _TILT_COST * abs(tilt)
                for closing in (direction, -direction):
                    rotation = turn @ np.column_stack([np.cross(closing, -_UP), closing, -_UP])
                    position = np.array([point[0], point[1], height]) - aside * rotation[:, 1]
                    pose = Pose.from_matrix(position, rotation)
                    grasps.append(Grasp(object=target.id, tcp_pose=pose, width=width, quality=quality))
        return sorted(grasps, key=lambda grasp: -grasp.quality)

    def _tcp_height(self, target: DetectedObject, geometry: GripperGeometry, tilt: float) -> float | None:
        """Return the TCP's height: at the object's middle, kept off what it stands on and off the palm."""
        top, negative_bottom = support(target, np.array([_UP, -_UP]))
        bottom = -negative_bottom
        tip = geometry.tip_depth * np.cos(tilt) + 0.5 * geometry.finger_width * abs(np.sin(tilt))
        lowest = bottom + tip + _FLOOR_CLEARANCE
        lowest = max(lowest, top - geometry.palm_depth + _FLOOR_CLEARANCE)
        height = max(float(centre(target)[2]), lowest)
        return height if height - geometry.tip_depth <= top - _LEAST_OVERLAP else None


def lean(outward: Array, tilt: float) -> Array:
    """Return the rotation (3, 3) that tilts what points down by an angle, its tip away from the base."""
    away = np.array([outward[0], outward[1], 0.0])
    length = float(np.linalg.norm(away))
    if tilt == 0.0 or length < 1e-6:
        return np.eye(3)
    axis = np.cross(away / length, _UP)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    rotation: Array = np.eye(3) - np.sin(tilt) * skew + (1.0 - np.cos(tilt)) * skew @ skew
    return rotation if (rotation @ -_UP) @ away * tilt > 0.0 else rotation.T


def closing_directions(target: DetectedObject) -> list[Array]:
    """Return horizontal unit vectors (3,) along which fingers meet the object squarely, each up to its sign."""
    axes = target.pose.rotation.T
    if target.kind in ("box", "mesh", "bin", "drawer"):
        level = [axis for axis in axes if abs(axis[2]) < _HORIZONTAL]
        if len(level) >= 2:
            return [_flat(axis) for axis in level]
    if target.kind in ("cylinder", "capsule") and abs(axes[2][2]) < _UPRIGHT:
        return [_flat(np.cross(axes[2], _UP))]
    angles = np.arange(_ROUND_DIRECTIONS) * np.pi / _ROUND_DIRECTIONS
    return [np.array([np.cos(a), np.sin(a), 0.0]) for a in angles]


def width_along(target: DetectedObject, direction: Array) -> float:
    """Return the object's extent along a unit vector (3,), metres."""
    return float(support(target, np.array([direction, -direction])).sum())


def _flat(vector: Array) -> Array:
    flat = np.array([vector[0], vector[1], 0.0])
    flat /= np.linalg.norm(flat)
    return flat
