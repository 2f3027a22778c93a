"""Extents of a gripper's fingers around its TCP: depth, width and thickness."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.robots.gripper.calibrate import collision_geoms, place
from robosandbox.robots.surfaces import world_points
from robosandbox.types import Array

# Length of a finger from its tip that is measured, metres.
_TIP_LENGTH = 0.02


def finger_extents(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    tcp_site: int,
    R_site_tcp: Array,
    sides: tuple[frozenset[int], frozenset[int]],
    pads: tuple[int, int],
) -> dict[str, float]:
    """Measure the fingers in the TCP frame, posed as they are in `data`."""
    origin = data.site_xpos[tcp_site]
    rotation = data.site_xmat[tcp_site].reshape(3, 3) @ R_site_tcp

    def local(geoms: list[int]) -> Array:
        turned: Array = (world_points(model, data, geoms) - origin) @ rotation
        return turned

    fingers = [local(collision_geoms(model, side)) for side in sides]
    pad_points = [local([pad]) for pad in pads]
    both = np.concatenate(pad_points)
    tip_depth = float(max(points[:, 2].max() for points in fingers))
    near = [points[points[:, 2] > tip_depth - _TIP_LENGTH] for points in fingers]
    thickness = [float(np.ptp(points[:, 1])) for points in near if len(points)]
    palm_body = int(model.site_bodyid[tcp_site])
    palm = [
        g
        for g in collision_geoms(model, frozenset({palm_body}))
        if int(model.geom_bodyid[g]) not in sides[0] | sides[1]
    ]
    palm_top = float(local(palm)[:, 2].max()) if palm else float(np.concatenate(fingers)[:, 2].min())
    width = both[np.abs(both[:, 2]) < _TIP_LENGTH]
    width = width if len(width) else both
    return {
        "tip_depth": max(0.0, tip_depth),
        "palm_depth": max(0.0, -palm_top),
        "finger_thickness": max(0.002, *thickness),
        "finger_width": float(np.ptp(width[:, 0])),
    }


def fingertip_depth(
    model: mujoco.MjModel, data: mujoco.MjData, qpos: Array, tcp_site: int, R_site_tcp: Array, fingers: frozenset[int]
) -> float:
    """Return how far fingers reach beyond the TCP along the approach at a configuration, metres; 0 where they do not."""
    place(model, data, qpos)
    approach = data.site_xmat[tcp_site].reshape(3, 3) @ R_site_tcp[:, 2]
    points = world_points(model, data, collision_geoms(model, fingers))
    return max(0.0, float(((points - data.site_xpos[tcp_site]) @ approach).max()))
