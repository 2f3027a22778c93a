"""Grasps on the wall of an open container, one finger inside and one outside."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robosandbox.grasp.hand import UP, hand_pose, turned
from robosandbox.robots.robot import GripperGeometry
from robosandbox.types import CONTAINER_WALL, ROUND_CONTAINERS, Array, DetectedObject, Grasp

OPEN_CONTAINERS = frozenset({"bin", "bowl", "cup"})
_ROUND = 16
_ALONG = (0.0, 0.5, -0.5)
_UPRIGHT = 0.9
_FLOOR_CLEARANCE = 0.003
_OVERLAPS = (0.018, 0.012)
_ANGLES = tuple(np.radians([0.0, 15.0, -15.0, 30.0, -30.0]))
_COST = 0.6


def rim_tiers(target: DetectedObject, geometry: GripperGeometry, floor: float) -> Iterator[list[Grasp]]:
    """Yield lists of grasps on a container's wall, the upright ones first; nothing for what has no rim on top.

    Args:
        target: A bin, bowl or cup.
        geometry: The gripper; its finger has to fit inside.
        floor: Height of what the container stands on, metres.
    """
    axis = target.pose.rotation[:, 2]
    thin = geometry.min_aperture >= CONTAINER_WALL
    if target.kind not in OPEN_CONTAINERS or axis[2] < _UPRIGHT or thin:
        return
    height = target.size[1] if target.kind in ROUND_CONTAINERS else target.size[2]
    inside = height - CONTAINER_WALL - _FLOOR_CLEARANCE
    for angle in _ANGLES:
        for overlap in _OVERLAPS:
            # The fingertips reach `overlap` below the rim; the TCP less.
            depth = min(overlap, inside) - geometry.tip_depth
            found = []
            for rim, outward in _rim(target, height):
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


def _rim(target: DetectedObject, height: float) -> Iterator[tuple[Array, Array]]:
    """Yield points in the middle of the wall's top, world (3,), and the outward directions there (3,)."""
    rotation, origin = target.pose.rotation, target.pose.position
    top = height * UP
    half_wall = CONTAINER_WALL / 2.0
    if target.kind in ROUND_CONTAINERS:
        for angle in np.arange(_ROUND) * 2.0 * np.pi / _ROUND:
            outward = np.array([np.cos(angle), np.sin(angle), 0.0])
            yield origin + rotation @ ((target.size[0] + half_wall) * outward + top), rotation @ outward
        return
    for side in range(4):
        across, along = side % 2, 1 - side % 2
        outward, edge = np.zeros(3), np.zeros(3)
        outward[across] = 1.0 if side < 2 else -1.0
        edge[along] = target.size[along]
        for share in _ALONG:
            local = (target.size[across] + half_wall) * outward + share * edge + top
            yield origin + rotation @ local, rotation @ outward
