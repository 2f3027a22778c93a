"""Pictures of a small board of tags from anywhere, rendered, as a camera near it takes them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing

import mujoco
import numpy as np

from robosandbox.sim.calibration_board import CalibrationBoard
from robosandbox.sim.rendering import OffscreenRenderer
from robosandbox.types import Intrinsics, Pose, matrix_from_rotation_vector

BOARD = CalibrationBoard(centre=(0.0, 0.0), tag=0.03, gap=0.007)
WIDTH, HEIGHT, FOCAL = 640, 480, 560.0
LENS = Intrinsics(width=WIDTH, height=HEIGHT, fx=FOCAL, fy=FOCAL, cx=(WIDTH - 1) / 2, cy=(HEIGHT - 1) / 2)


def pose(turn: list[float], position: list[float]) -> Pose:
    return Pose.from_matrix(np.array(position), matrix_from_rotation_vector(np.array(turn)))


def seen(cameras: list[Pose]) -> Iterator[np.ndarray]:
    """Render the board, whose middle is the origin, from poses of optical frames, with noise."""
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = WIDTH, HEIGHT
    BOARD.lay(spec, -0.0005)
    spec.worldbody.add_light(pos=[0, 0, 3], dir=[0, 0, -1])
    spec.worldbody.add_camera(name="eye", fovy=float(np.degrees(2.0 * np.arctan(HEIGHT / 2.0 / FOCAL))))
    model = spec.compile()
    data, random = mujoco.MjData(model), np.random.default_rng(0)
    with closing(OffscreenRenderer(model, (HEIGHT, WIDTH))) as renderer:
        for camera in cameras:
            # MuJoCo's cameras look along -z.
            mujoco.mju_mat2Quat(model.cam_quat[0], (camera.rotation @ np.diag([1.0, -1.0, -1.0])).ravel())
            model.cam_pos[0] = camera.position
            mujoco.mj_forward(model, data)
            picture = renderer.render(data, "eye")
            yield np.clip(picture + random.normal(0.0, 3.0, picture.shape), 0, 255).astype(np.uint8)
