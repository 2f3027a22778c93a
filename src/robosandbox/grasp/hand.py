"""Hand pose whose fingers close along a given line; depth, table and palm are taken into account."""

from __future__ import annotations

import numpy as np

from robosandbox.types import Array, Pose, cross
from robosandbox.types.robot import GripperGeometry

UP = np.array([0.0, 0.0, 1.0])
# Coefficient between pads and what they hold; chosen as what most pairs of materials have at least: friction is not seen.
# Halved it asks for twice the force of a grip.
FRICTION = 0.5
# Metres between each finger and the object on its way down. Chosen as what the way there keeps.
FINGER_CLEARANCE = 0.001
# Metres that what is held is wider than the closed fingers, so that they press: what position servos still act on.
THINNEST = 0.0005
FLOOR_CLEARANCE = 0.003  # Metres that fingertips stay over what the object stands on. Chosen.
_PALM_CLEARANCE = 0.003  # Metres between the palm and the object. Chosen.
_LEAST_OVERLAP = 0.004  # Metres of fingertip that must reach past the object's near side. Chosen.
# Metres between a jaw that stands still and the object. Chosen: it comes down beside it, not moving.
_JAW_CLEARANCE = 0.004
_DOWNWARD = 0.5


def hand_pose(
    geometry: GripperGeometry,
    *,
    point: Array,
    closing: Array,
    approach: Array,
    width: float,
    near: float,
    floor: float,
    ceiling: float,
    depth: float | None = None,
) -> Pose | None:
    """Return the TCP pose that closes on `width` around a point, or None where fingers and palm have no room.

    Args:
        geometry: The gripper.
        point: Middle between the touched surfaces, world, shape (3,).
        closing: Unit vector from one to the other, shape (3,).
        approach: Unit vector at a right angle to it in which the hand comes, shape (3,).
        width: Distance between the surfaces, metres.
        near: How far what is held reaches from the point against the approach, metres.
        floor: Height under which no fingertip may come, metres.
        ceiling: Height of what is held, metres: a hand from the side is raised no further.
        depth: How deep the TCP goes below what the hand meets first; to the point when left out.
    """
    palm = near - (geometry.palm_depth - _PALM_CLEARANCE)
    back = max(0.0 if depth is None else near - depth, palm)
    side = cross(closing, approach)
    # Distance by which a tilted fingertip's corners lie below its middle.
    corner = 0.5 * geometry.finger_width * abs(side[2])
    corner += (0.5 * width + geometry.finger_thickness) * abs(closing[2])
    lowest = (point - back * approach + geometry.tip_depth * approach)[2] - corner
    short = floor + FLOOR_CLEARANCE - float(lowest)
    lift = 0.0
    if short > 0.0:
        if -approach[2] > _DOWNWARD:
            back += short / float(-approach[2])
        else:
            lift = short
    if back > near + geometry.tip_depth - _LEAST_OVERLAP:
        return None
    position = point - back * approach + lift * UP
    if lift and position[2] + geometry.tip_depth * approach[2] > ceiling - _LEAST_OVERLAP:
        return None
    # Beside a jaw that stands still, what is held is not at the TCP but half its width away.
    aside = geometry.centre(width)
    aside += np.sign(aside) * _JAW_CLEARANCE if abs(aside) > _JAW_CLEARANCE else 0.0
    rotation = np.column_stack([side, closing, approach])
    return Pose.from_matrix(position - aside * closing, rotation)


def turned(vector: Array, axis: Array, angle: float) -> Array:
    """Return the vector (3,) turned about a unit axis (3,) by an angle, radians (Rodrigues' formula)."""
    c, s = np.cos(angle), np.sin(angle)
    result: Array = vector * c + cross(axis, vector) * s + axis * (axis @ vector) * (1.0 - c)
    return result


def unit(vector: Array) -> Array:
    """Return the vector (3,) at length one."""
    result: Array = vector / np.linalg.norm(vector)
    return result


def lean(outward: Array, tilt: float) -> Array:
    """Return the rotation (3, 3) that tilts what points down by an angle, its tip away from the base."""
    away = np.array([outward[0], outward[1], 0.0])
    length = float(np.linalg.norm(away))
    if tilt == 0.0 or length < 1e-6:
        return np.eye(3)
    axis = cross(away / length, UP)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    rotation: Array = np.eye(3) - np.sin(tilt) * skew + (1.0 - np.cos(tilt)) * skew @ skew
    return rotation if (rotation @ -UP) @ away * tilt > 0.0 else rotation.T
