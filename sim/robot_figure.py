"""A picture of a robot with what its sidecar says: TCP frame, closing axis, home, reach."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.errors import InputError, RenderingError
from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.infer.placement import TableWorkspace
from robosandbox.robots.sidecar import Sidecar
from robosandbox.sim.rendering import OffscreenRenderer
from robosandbox.sim.room import add_sky
from robosandbox.types import Array, matrix_from_quat_xyzw

# Height and width of each view, pixels; chosen so that both stand side by side on a screen.
_SIZE = (600, 800)
# Shares of red, green, blue and opacity of the frame's x, y and z; the standard order of colours for axes.
_COLOURS = ([0.9, 0.15, 0.15, 1.0], [0.1, 0.65, 0.15, 1.0], [0.15, 0.3, 0.95, 1.0])
_CAMERA = "robosandbox_portrait"


def draw_robot(imported: ImportedModel, sidecar: Sidecar, space: TableWorkspace, path: Path) -> None:
    """Draw two views, of the whole robot at home and of its gripper.

    Red, green and blue are the TCP's x, closing (y) and approach (z); the band on the ground is what it reaches.

    Args:
        imported: The robot.
        sidecar: Its roles.
        space: Its workspace.
        path: Where the PNG goes.

    Raises:
        RenderingError: No OpenGL on this machine.
        InputError: The picture cannot be written.
    """
    import cv2

    picture = np.hstack(_rendered(imported, sidecar, space))[:, :, ::-1]
    encoded, content = cv2.imencode(".png", picture)
    if not encoded:
        raise RenderingError("the picture could not be encoded as PNG")
    try:
        path.write_bytes(content.tobytes())
    except OSError as error:
        raise InputError(f"--picture: {path}: {error.strerror}") from None


def _rendered(imported: ImportedModel, sidecar: Sidecar, space: TableWorkspace) -> list[NDArray[np.uint8]]:
    """Return both views, RGB."""
    model = compile_spec(imported.spec, imported.path.name)
    data = mujoco.MjData(model)
    for name, value in zip(sidecar.arm.joints, sidecar.arm.home_qpos, strict=True):
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_fwdPosition(model, data)
    tcp, R_tcp = _tcp(model, data, sidecar)
    spec = imported.spec.copy()
    _draw_reach(spec, space)
    _draw_frame(spec, tcp, R_tcp, 0.12 * max(space.far, 0.3))
    spec.worldbody.add_light(pos=[1.0, -1.0, 2.5], dir=[-0.4, 0.4, -1.0], castshadow=False)
    add_sky(spec, "robosandbox_sky")
    spec.visual.global_.offheight, spec.visual.global_.offwidth = _SIZE
    spec.visual.quality.shadowsize = 0
    cameras = _add_views(spec, tcp, space)
    drawn = compile_spec(spec, imported.path.name)
    still = mujoco.MjData(drawn)
    still.qpos[:] = data.qpos
    mujoco.mj_fwdPosition(drawn, still)
    renderer = OffscreenRenderer(drawn, _SIZE)
    try:
        return [renderer.render(still, name) for name in cameras]
    finally:
        renderer.close()


def _tcp(model: mujoco.MjModel, data: mujoco.MjData, sidecar: Sidecar) -> tuple[Array, Array]:
    """Return the TCP's position (3,) and rotation (3, 3) in the world."""
    inject = sidecar.ee_site.inject
    if inject is None:
        raise InputError("--picture: draws an injected TCP; this sidecar names a site")
    body = model.body(inject.attach_body).id
    R_body = data.xmat[body].reshape(3, 3)
    tcp = data.xpos[body] + R_body @ np.array(inject.xyz)
    return tcp, R_body @ matrix_from_quat_xyzw(inject.quat_xyzw or (0.0, 0.0, 0.0, 1.0))


def _add_views(spec: mujoco.MjSpec, tcp: Array, space: TableWorkspace) -> list[str]:
    """Add a camera on the whole robot and one on its gripper; return their names."""
    ahead = np.array([np.cos(space.forward), np.sin(space.forward), 0.0])
    aside = np.array([ahead[1], -ahead[0], 0.0])
    middle = np.array([*space.axis, space.floor]) + 0.4 * space.far * ahead + [0.0, 0.0, 0.25 * space.far]
    views = (
        (middle, middle + space.far * (0.9 * ahead + 1.9 * aside) + [0.0, 0.0, 0.9 * space.far]),
        (tcp, tcp + 0.3 * ahead + 0.28 * aside + [0.0, 0.0, 0.08]),
    )
    names = []
    for number, (target, eye) in enumerate(views):
        names.append(f"{_CAMERA}{number}")
        _add_camera(spec, names[-1], eye, target)
    return names


def _draw_frame(spec: mujoco.MjSpec, origin: Array, rotation: Array, length: float) -> None:
    for axis in range(3):
        tip = origin + length * rotation[:, axis]
        _line(spec, origin, tip, 0.012 * length / 0.12, _COLOURS[axis])
    # The closing axis runs both ways.
    _line(spec, origin - 0.6 * length * rotation[:, 1], origin, 0.006 * length / 0.12, _COLOURS[1])


def _draw_reach(spec: mujoco.MjSpec, space: TableWorkspace) -> None:
    angles = np.linspace(space.forward - 1.2, space.forward + 1.2, 25)
    for radius in (space.near, space.far):
        points = [np.array([*(space.axis + radius * np.array([np.cos(a), np.sin(a)])), space.floor]) for a in angles]
        for first, second in pairwise(points):
            _line(spec, first, second, 0.004, [0.95, 0.6, 0.1, 1.0])


def _line(spec: mujoco.MjSpec, first: Array, second: Array, radius: float, rgba: list[float]) -> None:
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[*first, *second],
        size=[radius, 0.0, 0.0],
        rgba=rgba,
        contype=0,
        conaffinity=0,
        group=1,
    )


def _add_camera(spec: mujoco.MjSpec, name: str, eye: Array, target: Array) -> None:
    back = (eye - target) / np.linalg.norm(eye - target)
    x_axis = np.cross([0.0, 0.0, 1.0], back)
    x_axis /= np.linalg.norm(x_axis)
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.column_stack([x_axis, np.cross(back, x_axis), back]).flatten())
    spec.worldbody.add_camera(name=name, pos=eye, quat=quat, fovy=42.0)
