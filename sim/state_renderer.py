"""Pictures of saved states of a simulated world, which goes on meanwhile."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.rendering import OffscreenRenderer
from robosandbox.sim.saved_state import put_state
from robosandbox.sim.sensors import perfect_intrinsics
from robosandbox.types import Array, Intrinsics, Pose

# MuJoCo's cameras look along -z with y up.
_OPTICAL = np.diag([1.0, -1.0, -1.0])


class StateRenderer:
    """Draws states of one compiled model; for the thread that made it, since an OpenGL context belongs to that.

    Args:
        sim: Whose model and picture size.
    """

    def __init__(self, sim: MuJoCoBackend) -> None:
        self._model = sim.model
        self._data = mujoco.MjData(sim.model)
        self._renderer = OffscreenRenderer(sim.model, sim.render_size)

    def draws(self, sim: MuJoCoBackend) -> bool:
        """Return whether it is of this sim's model as it is compiled now."""
        return self._model is sim.model

    def draw(
        self, state: Array, camera: str, *, depth: bool
    ) -> tuple[NDArray[np.uint8] | NDArray[np.float32], Intrinsics, Pose]:
        """Return a picture with the camera's intrinsics and its pose in the world.

        Args:
            state: As `snapshot` returned it.
            camera: As the model calls it.
            depth: Whether to draw metres (height, width) float32 in place of RGB (height, width, 3) uint8.
        """
        model, data = self._model, self._data
        put_state(model, data, state)
        mujoco.mj_forward(model, data)
        drawn = self._renderer.depth(data, camera) if depth else self._renderer.render(data, camera)
        number = model.camera(camera).id
        pose = Pose.from_matrix(data.cam_xpos[number], data.cam_xmat[number].reshape(3, 3) @ _OPTICAL)
        height, width = drawn.shape[:2]
        return drawn, perfect_intrinsics((height, width), math.radians(float(model.cam_fovy[number]))), pose

    def close(self) -> None:
        """Free the OpenGL context."""
        self._renderer.close()
