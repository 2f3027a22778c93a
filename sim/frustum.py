"""Frustum of a camera narrowed to a part of its picture, with what lies outside left undrawn."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.types import PictureWindow

_NOTHING = mujoco.mjtGeom.mjGEOM_NONE.value
_GEOM = mujoco.mjtObj.mjOBJ_GEOM.value


def narrow(scene: mujoco.MjvScene, size: tuple[int, int], window: PictureWindow) -> None:
    """Let the scene's camera see a part of its picture alone; pixels are those of the whole picture.

    Args:
        scene: As updated for a camera.
        size: (height, width) of the whole picture, pixels.
        window: The part.
    """
    height, width = size
    for camera in scene.camera:
        pixel = (camera.frustum_top - camera.frustum_bottom) / height
        left = camera.frustum_center - pixel * width / 2.0
        top = camera.frustum_top
        camera.frustum_top, camera.frustum_bottom = top - pixel * window.top, top - pixel * window.bottom
        camera.frustum_center = left + pixel * (window.left + window.right) / 2.0
        # Half of it, as MuJoCo's header has it.
        camera.frustum_width = pixel * (window.right - window.left) / 2.0


def leave_out_unseen(scene: mujoco.MjvScene, model: mujoco.MjModel, data: mujoco.MjData, aspect: float) -> None:
    """Leave undrawn what is outside of the frustum; nothing of it would be seen.

    Args:
        scene: As updated for a camera.
        model: What is drawn.
        data: In which state.
        aspect: Width over height of the picture.
    """
    camera = scene.camera[0]
    forward, up = np.array(camera.forward, dtype=np.float64), np.array(camera.up, dtype=np.float64)
    axes = np.column_stack([np.cross(forward, up), up, forward])
    x, y, z = ((data.geom_xpos - np.array(camera.pos, dtype=np.float64)) @ axes).T
    half = float(camera.frustum_width) or aspect * (camera.frustum_top - camera.frustum_bottom) / 2.0
    sides = (
        (x, camera.frustum_center + half, 1.0),
        (x, camera.frustum_center - half, -1.0),
        (y, camera.frustum_top, 1.0),
        (y, camera.frustum_bottom, -1.0),
    )
    radius = model.geom_rbound
    outside = z < -radius
    for across, limit, sign in sides:
        slope = float(limit) / float(camera.frustum_near)
        # Distance from the plane through the lens and this side of the picture.
        outside |= sign * (across - slope * z) > radius * np.hypot(1.0, slope)
    # A plane has no bounds.
    unseen = set(np.flatnonzero(outside & (radius > 0.0)).tolist())
    for geom in scene.geoms[: scene.ngeom]:
        if geom.objid in unseen and geom.objtype == _GEOM:
            geom.type = _NOTHING
