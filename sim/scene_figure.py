"""A picture of somebody's scene with the robot in it, names beside what was found."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.sim.opening import open_mujoco
from robosandbox.types import Array, Scene

_SIZE = (720, 960)
# Colours of names by what they are of: things, fixtures, parts.
_COLOURS = {"thing": (200, 40, 30), "fixture": (40, 60, 110), "part": (20, 120, 60)}


def draw_scene(scene: Scene, path: Path) -> None:
    """Write a picture of a populated scene, as its best camera sees it.

    Raises:
        InputError: The picture cannot be written.
        RenderingError: No OpenGL on this machine.
    """
    from PIL import Image, ImageDraw

    sim = open_mujoco(scene, render_size=_SIZE)
    try:
        truth = sim.truth()
        picture = Image.fromarray(sim.state(["scene"]).images["scene"])
        drawing = ImageDraw.Draw(picture)
        data = mujoco.MjData(sim.model)
        mujoco.mj_setState(sim.model, data, sim.snapshot()[: mujoco.mj_stateSize(sim.model, _STATE)], _STATE)
        mujoco.mj_forward(sim.model, data)
        for item in scene.objects:
            seen = truth.objects[item.id].detected()
            middle = item.shape.centre(seen)
            point = _pixel(sim.model, data, sim.camera_in_model("scene"), middle)
            kind = "thing" if not item.is_fixed else "part" if item.kind == "part" else "fixture"
            if point is not None:
                text = item.id if seen.opening is None else f"{item.id} {seen.opening:.2f}"
                drawing.text(point, text, fill=_COLOURS[kind], anchor="mm", stroke_width=2, stroke_fill=(255, 255, 255))
        try:
            picture.save(path)
        except (OSError, ValueError) as error:
            raise InputError(f"--picture: {path}: {error}") from None
    finally:
        sim.close()


_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


def _pixel(model: mujoco.MjModel, data: mujoco.MjData, camera: str, point: Array) -> tuple[float, float] | None:
    """Return where a point (3,) is in the picture; None behind the camera or outside."""
    number = model.camera(camera).id
    local = data.cam_xmat[number].reshape(3, 3).T @ (point - data.cam_xpos[number])
    if local[2] > -1e-3:
        return None
    scale = _SIZE[0] / 2.0 / np.tan(np.radians(float(model.cam_fovy[number])) / 2.0)
    x, y = _SIZE[1] / 2.0 - scale * local[0] / local[2], _SIZE[0] / 2.0 + scale * local[1] / local[2]
    return (float(x), float(y)) if 0.0 <= x < _SIZE[1] and 0.0 <= y < _SIZE[0] else None
