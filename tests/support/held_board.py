"""Pictures of the calibration board, held before a camera by hand in different ways, as a lens bends them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing

import cv2
import mujoco
import numpy as np

from robosandbox.sim.calibration_board import CalibrationBoard
from robosandbox.sim.rendering import OffscreenRenderer

BOARD = CalibrationBoard(centre=(0.0, 0.0))
WIDTH, HEIGHT = 640, 480


def held(matrix: np.ndarray, bend: np.ndarray, tilts: float = 0.5, views: int = 24) -> Iterator[np.ndarray]:
    """Return noisy pictures of the board from all sides, up to `tilts` rad from straight above, BGR."""
    # The camera sees more than the lens shows, and twice as fine.
    wide, high, focal = 1600, 1200, 1000.0
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = wide, high
    BOARD.lay(spec, 0.0)
    spec.worldbody.add_light(pos=[0, 0, 3], dir=[0, 0, -1])
    fovy = float(np.degrees(2.0 * np.arctan(high / 2.0 / focal)))
    spec.worldbody.add_camera(name="eye", pos=[0, 0, 1], fovy=fovy)
    model = spec.compile()
    data = mujoco.MjData(model)
    pixels = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), axis=-1).reshape(-1, 1, 2).astype(float)
    rays = cv2.undistortPoints(pixels, matrix, bend).reshape(HEIGHT, WIDTH, 2)
    where = (rays * focal + [(wide - 1) / 2.0, (high - 1) / 2.0]).astype(np.float32)
    random = np.random.default_rng(1)
    with closing(OffscreenRenderer(model, (high, wide))) as renderer:
        for _ in range(views):
            turn, tilt, away = random.uniform(-0.6, 0.6), random.uniform(-tilts, tilts, 2), random.uniform(0.45, 0.9)
            (ux, uy), aside = tilt, random.uniform(-0.12, 0.12, 2)
            about = [
                np.array([np.cos(a / 2), *(np.sin(a / 2) * np.eye(3)[axis])])
                for axis, a in ((2, turn), (0, ux), (1, uy))
            ]
            quat, both = np.zeros(4), np.zeros(4)
            mujoco.mju_mulQuat(both, about[0], about[1])
            mujoco.mju_mulQuat(quat, both, about[2])
            back = np.zeros(3)
            mujoco.mju_rotVecQuat(back, np.array([0.0, 0.0, away]), quat)
            model.cam_pos[0], model.cam_quat[0] = back + [*aside, 0.0], quat
            mujoco.mj_forward(model, data)
            seen = cv2.remap(renderer.render(data, "eye"), where, None, cv2.INTER_LINEAR)
            noisy = seen + random.normal(0.0, 3.0, seen.shape)
            yield np.clip(noisy, 0, 255).astype(np.uint8)[..., ::-1]
