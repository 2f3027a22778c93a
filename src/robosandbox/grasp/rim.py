"""Grasps on the wall of an open container, one finger inside and one outside."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robosandbox.grasp.hand import hand_pose, turned
from robosandbox.shapes import CONTAINER_WALL, Room
from robosandbox.types import Array, DetectedObject, Grasp
from robosandbox.types.robot import GripperGeometry

_UPRIGHT = 0.9  # Cosine of the tilt up to which a container stands upright. Chosen: 26 degrees.
_FLOOR_CLEARANCE = 0.003  # Metres that a fingertip stays over the floor of a container. Chosen.
_OVERLAPS = (0.018, 0.012)  # Metres of the wall between the fingers, the surest first. Chosen.
_ANGLES = tuple(np.radians([0.0, 15.0, -15.0, 30.0, -30.0]))
_COST = 0.6  # Quality, as a fraction, that a grasp by the rim loses, so that one around the whole comes first. Chosen.


def rim_tiers(target: DetectedObject, geometry: GripperGeometry, floor: float) -> Iterator[list[Grasp]]:
    """Yield lists of grasps on a container's wall, the upright ones first; nothing for what has no rim on top.

    Args:
        target: An open container.
        geometry: The gripper; its finger has to fit inside.
        floor: Height of what the container stands on, metres.
    """
    axis = target.pose.rotation[:, 2]
    thin = geometry.min_aperture >= CONTAINER_WALL
    room = target.shape.room(target.size) if target.shape.is_open_container else None
    if room is None or axis[2] < _UPRIGHT or thin:
        return
    inside = room.rim - CONTAINER_WALL - _FLOOR_CLEARANCE
    for angle in _ANGLES:
        for overlap in _OVERLAPS:
            # The fingertips reach `overlap` below the rim; the TCP less.
            depth = min(overlap, inside) - geometry.tip_depth
            found = []
            for rim, outward in _rim(target, room):
                approach = turned(-axis, outward, angle)
                for closing in (outward, -outward):
                    pose = hand_pose(
                        geometry,
                        point=rim,
                        closing=closing,
                        approach=approach,
                        width=CONTAINER_WALL,
                        near=0.0,
                        floor=floor,
                        ceiling=float(rim[2]),
                        depth=depth,
                    )
                    if pose is not None:
                        quality = 1.0 - _COST - abs(angle) - 2.0 * abs(_OVERLAPS[0] - overlap)
                        found.append(
                            Grasp(
                                object=target.id,
                                tcp_pose=pose,
                                width=CONTAINER_WALL,
                                quality=quality,
                                how="rim",
                            )
                        )
            yield found


def _rim(target: DetectedObject, room: Room) -> Iterator[tuple[Array, Array]]:
    """Yield points in the middle of the wall's top, world (3,), and the outward directions there (3,)."""
    rotation, origin = target.pose.rotation, target.pose.position
    for place, outward in room.rim_places():
        yield origin + rotation @ place, rotation @ outward
