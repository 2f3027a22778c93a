"""Pictures for models that see: with the ids of what perception sees drawn on them, and the camera's calibration as data.

Marks let a model name what it points at (set-of-mark prompting, Yang and others 2023).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robosandbox.agent.goal import GoalContext
from robosandbox.errors import InputError
from robosandbox.types import ObservedScene, RgbdFrame
from robosandbox.validation import did_you_mean
from robosandbox.world.relations import centre

_FONT_SCALE = 0.4  # Of OpenCV's plain font, whose capitals are then 9 pixels high. Chosen: readable at 320 x 240.
_NEAREST = 1e-3  # Metres before a camera from which a point is in its picture. Chosen: a lens sees nothing nearer.
_LONGEST = 32  # Characters of an id that are drawn. Chosen: what fits beside a thing.


def png(picture: NDArray[Any]) -> bytes:
    """Return an RGB picture (height, width, 3) uint8 as a PNG file's bytes."""
    import cv2

    # OpenCV's order of channels is blue, green, red.
    _, data = cv2.imencode(".png", picture[:, :, ::-1])
    return data.tobytes()


def marked_picture(ctx: GoalContext, camera: str, scene: ObservedScene) -> tuple[bytes, Mapping[str, Any]]:
    """Return a camera's picture with ids drawn on it as a PNG file, and its calibration with the pixel of each id.

    Raises:
        InputError: There is no such camera.
        RenderingError: This machine makes no pictures.
    """
    cameras = ctx.cameras()
    if camera not in cameras:
        offered = ", ".join(cameras) or "none"
        raise InputError(f"camera: {camera[:60]!r} is not there; there is {offered}{did_you_mean(camera, cameras)}")
    frame = ctx.capture(camera)
    pixels = _pixels(frame, scene)
    lens, pose = frame.intrinsics, frame.pose_camera_in_world
    data = {
        "camera": camera,
        "size": [lens.width, lens.height],
        "focal_length": [lens.fx, lens.fy],
        "principal_point": [lens.cx, lens.cy],
        "position": list(pose.xyz),
        "quat_xyzw": list(pose.quat_xyzw),
        "pixels": {name: [round(x), round(y)] for name, (x, y) in pixels.items()},
    }
    return png(_drawn(frame.rgb, pixels)), data


def _pixels(frame: RgbdFrame, scene: ObservedScene) -> dict[str, tuple[float, float]]:
    """Return the pixel at the middle of each thing that is within the picture."""
    lens, pose = frame.intrinsics, frame.pose_camera_in_world
    found = {}
    for item in scene.objects:
        x, y, depth = pose.rotation.T @ (centre(item) - pose.position)
        if depth < _NEAREST:
            continue
        column, row = lens.fx * x / depth + lens.cx, lens.fy * y / depth + lens.cy
        if 0.0 <= column < lens.width and 0.0 <= row < lens.height:
            found[item.id] = (float(column), float(row))
    return found


def _drawn(picture: NDArray[np.uint8], pixels: Mapping[str, tuple[float, float]]) -> NDArray[np.uint8]:
    """Return a picture with a dot and the id at each pixel, in white on black so that both show on any ground."""
    import cv2

    canvas = np.ascontiguousarray(picture)
    for name, (column, row) in pixels.items():
        at = (round(column), round(row))
        # OpenCV draws other characters as question marks.
        label = name[:_LONGEST].encode("ascii", "replace").decode()
        for colour, width in (((0, 0, 0), 3), ((255, 255, 255), 1)):
            cv2.circle(canvas, at, width, colour, -1)
            cv2.putText(canvas, label, (at[0] + 4, at[1] - 4), cv2.FONT_HERSHEY_SIMPLEX, _FONT_SCALE, colour, width)
    return canvas
