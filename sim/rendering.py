"""Pictures on a CPU: one off-screen context per world, made when somebody first looks."""

from __future__ import annotations

import os
import sys
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.errors import RenderingError
from robosandbox.forks import ForkGuard
from robosandbox.sim.frustum import leave_out_unseen, narrow
from robosandbox.types import PictureWindow

_OPENGL = ForkGuard("OpenGL")
_REMEDY = (
    "install one with `apt-get install libegl1` (then MUJOCO_GL=egl) or `apt-get install libosmesa6` (MUJOCO_GL=osmesa)"
)


class OffscreenRenderer:
    """Renders cameras of one model into arrays.

    Shadows and reflections stay off: on a CPU they cost ten times all the rest.

    Args:
        model: The model to draw.
        size: (height, width) in pixels.

    Raises:
        RenderingError: No OpenGL library works here, and the message says what to install; or pictures were made before this
            process was forked.
    """

    def __init__(self, model: mujoco.MjModel, size: tuple[int, int]) -> None:
        _check_process()
        _OPENGL.begin()
        height, width = size
        limit = (int(model.vis.global_.offheight), int(model.vis.global_.offwidth))
        if height > limit[0] or width > limit[1] or height < 1 or width < 1:
            raise RenderingError(f"render size {height} x {width} is outside 1 x 1 .. {limit[0]} x {limit[1]} pixels")
        self._model = model
        self._rect = mujoco.MjrRect(0, 0, width, height)
        self._gl = _make_gl_context(width, height)
        self._gl.make_current()
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        # Depth from 1 at the near plane to 0 at the far one keeps its precision in float32.
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR.value
        self._scene = mujoco.MjvScene(model, maxgeom=2000)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = 0
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._options = mujoco.MjvOption()
        self._perturb = mujoco.MjvPerturb()

    def render(self, data: mujoco.MjData, camera: str) -> NDArray[np.uint8]:
        """Return the RGB picture (height, width, 3) uint8 of a camera by its name in the model."""
        self._draw(data, camera)
        picture = np.empty((self._rect.height, self._rect.width, 3), dtype=np.uint8)
        mujoco.mjr_readPixels(picture, None, self._rect, self._context)
        return picture[::-1].copy()

    def depth(self, data: mujoco.MjData, camera: str) -> NDArray[np.float32]:
        """Return the distance along the optical axis, metres, (height, width) float32."""
        self._draw(data, camera)
        raw = np.empty((self._rect.height, self._rect.width), dtype=np.float32)
        mujoco.mjr_readPixels(None, raw, self._rect, self._context)
        return self._metres(raw)

    def rgbd(
        self, data: mujoco.MjData, camera: str, window: PictureWindow | None = None
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return the picture and the depth of one drawing, as `render` and `depth` do; of a window of it, that part alone."""
        rect = self._draw(data, camera, window)
        picture = np.empty((rect.height, rect.width, 3), dtype=np.uint8)
        raw = np.empty((rect.height, rect.width), dtype=np.float32)
        mujoco.mjr_readPixels(picture, raw, rect, self._context)
        return picture[::-1].copy(), self._metres(raw)

    def bodies(self, data: mujoco.MjData, camera: str) -> NDArray[np.int32]:
        """Return the body that each pixel shows, (height, width), -1 for none: the truth to measure perception by."""
        flags = (mujoco.mjtRndFlag.mjRND_SEGMENT, mujoco.mjtRndFlag.mjRND_IDCOLOR)
        for flag in flags:
            self._scene.flags[flag] = 1
        try:
            coded = self.render(data, camera).astype(np.int32)
        finally:
            for flag in flags:
                self._scene.flags[flag] = 0
        number = coded[..., 0] + 256 * coded[..., 1] + 65536 * coded[..., 2]
        table = np.full(self._scene.ngeom + 1, -1, dtype=np.int32)
        for geom in self._scene.geoms[: self._scene.ngeom]:
            if geom.objtype == mujoco.mjtObj.mjOBJ_GEOM.value and geom.segid >= 0:
                table[geom.segid + 1] = self._model.geom_bodyid[geom.objid]
        return np.asarray(table[np.minimum(number, self._scene.ngeom)])

    def _metres(self, raw: NDArray[np.float32]) -> NDArray[np.float32]:
        extent = self._model.stat.extent
        near, far = np.float32(self._model.vis.map.znear * extent), np.float32(self._model.vis.map.zfar * extent)
        # The inverse of OpenGL's perspective division, for near at 1 and far at 0.
        metres: NDArray[np.float32] = far * near / (raw[::-1] * (far - near) + near)
        return metres

    def _draw(self, data: mujoco.MjData, camera: str, window: PictureWindow | None = None) -> mujoco.MjrRect:
        _check_process()
        self._gl.make_current()
        self._camera.fixedcamid = self._model.camera(camera).id
        mujoco.mjv_updateScene(
            self._model, data, self._options, self._perturb, self._camera, mujoco.mjtCatBit.mjCAT_ALL.value, self._scene
        )
        rect = self._rect
        if window is not None:
            narrow(self._scene, (rect.height, rect.width), window)
            rect = mujoco.MjrRect(0, 0, window.right - window.left, window.bottom - window.top)
        leave_out_unseen(self._scene, self._model, data, rect.width / rect.height)
        mujoco.mjr_render(rect, self._scene, self._context)
        return rect

    def close(self) -> None:
        """Free the OpenGL context."""
        self._context.free()
        self._gl.free()


def _check_process() -> None:
    """Raise RenderingError where this process was forked after pictures were made."""
    lost = _OPENGL.lost()
    if lost is not None:
        raise RenderingError(lost)


def _make_gl_context(width: int, height: int) -> Any:
    """Return a GL context: what MUJOCO_GL says, else EGL, then OSMesa, where there is no display."""
    chosen = os.environ.get("MUJOCO_GL", "").strip().lower()
    if chosen in ("egl", "osmesa"):
        candidates = [chosen]
    elif sys.platform == "linux" and not os.environ.get("DISPLAY"):
        candidates = ["egl", "osmesa"]
    else:
        candidates = ["native"]
    problems = []
    for candidate in candidates:
        try:
            return _context_class(candidate)(width, height)
        # A missing library is an ImportError or, from PyOpenGL, an AttributeError; a broken one a FatalError.
        except (ImportError, AttributeError, RuntimeError, OSError, mujoco.FatalError) as error:
            problems.append(f"{candidate}: {str(error).splitlines()[0] if str(error) else type(error).__name__}")
    raise RenderingError(f"no OpenGL to render with ({'; '.join(problems)}); {_REMEDY}")


def _context_class(backend: str) -> Any:
    if backend == "egl":
        from mujoco.egl import GLContext as EglContext

        return EglContext
    if backend == "osmesa":
        from mujoco.osmesa import GLContext as OsmesaContext

        return OsmesaContext
    return mujoco.GLContext
