"""Rendering of a driver's cameras: as little as possible in the world's thread, encoding beside it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from robosandbox.driver import Driver
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.opening import mujoco_behind
from robosandbox.sim.state_renderer import StateRenderer
from robosandbox.types import Intrinsics, Pose, RgbdFrame

# Pictures a second of a stream that is drawn from copies of the state; chosen as cameras deliver them.
_DRAWN_HZ = 30.0
# Pictures a second of a stream that the driver is asked for between two control ticks; chosen because an engine that draws
# them there takes 50 to 150 ms for each.
_CAPTURED_HZ = 5.0
# Of 100, as OpenCV counts; chosen where edges of objects show no blocks.
_JPEG_QUALITY = 85

Kind = Literal["rgb", "depth"]
Format = Literal["jpeg", "png", "raw"]
ENCODINGS: dict[Format, str] = {"jpeg": "image/jpeg", "png": "image/png", "raw": "application/octet-stream"}
# RGB (height, width, 3) uint8, or depth in metres (height, width) float32.
Pixels = NDArray[np.uint8] | NDArray[np.float32]
# Returns the pixels of a camera, with its pinhole and the pose of its optical frame in the world.
Develop = Callable[[str, Kind], tuple[Pixels, Intrinsics, Pose]]


class Photographer(Protocol):
    """Takes pictures of one driver's cameras."""

    @property
    def hz(self) -> float:
        """Largest rate at which each camera may be asked, Hz."""
        ...

    def sizes(self) -> Mapping[str, tuple[int, int]]:
        """Return (height, width) in pixels by camera."""
        ...

    def expose(self, cameras: Collection[str]) -> Develop:
        """Take down the present moment, in the world's thread; what is returned makes pictures of it in another one."""
        ...

    def close(self) -> None:
        """Free what it draws with; in the thread that develops."""
        ...


def photographer(driver: Driver) -> Photographer:
    """Return who takes pictures of a driver: drawn from a copy of the state where it has a model, else as its cameras see."""
    world = mujoco_behind(driver)
    return _Capturing(driver) if world is None else _Drawing(world)


class _Drawing:
    """Draws copies of a simulated state, while the simulation goes on."""

    hz = _DRAWN_HZ

    def __init__(self, sim: MuJoCoBackend) -> None:
        self._sim = sim
        self._renderer: StateRenderer | None = None

    def sizes(self) -> Mapping[str, tuple[int, int]]:
        return dict.fromkeys(self._sim.cameras, self._sim.render_size)

    def expose(self, cameras: Collection[str]) -> Develop:
        del cameras
        sim, state = self._sim, self._sim.snapshot()

        def develop(camera: str, kind: Kind) -> tuple[Pixels, Intrinsics, Pose]:
            name = sim.camera_in_model(camera)
            if self._renderer is None or not self._renderer.draws(sim):
                self.close()
                self._renderer = StateRenderer(sim)
            return self._renderer.draw(state, name, depth=kind == "depth")

        return develop

    def close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = None


class _Capturing:
    """Has the driver's cameras deliver their frames."""

    hz = _CAPTURED_HZ

    def __init__(self, driver: Driver) -> None:
        self._driver = driver

    def sizes(self) -> Mapping[str, tuple[int, int]]:
        cameras = self._driver.capabilities.cameras.items()
        return {name: (spec.intrinsics.height, spec.intrinsics.width) for name, spec in cameras}

    def expose(self, cameras: Collection[str]) -> Develop:
        frames: dict[str, RgbdFrame | Exception] = {}
        for camera in cameras:
            try:
                frames[camera] = self._driver.senses.capture(camera)
            except Exception as error:
                # Told to whoever asked for this camera; the others have delivered.
                frames[camera] = error

        def develop(camera: str, kind: Kind) -> tuple[Pixels, Intrinsics, Pose]:
            frame = frames[camera]
            if isinstance(frame, Exception):
                raise frame
            pixels: Pixels = frame.depth if kind == "depth" else frame.rgb
            return pixels, frame.intrinsics, frame.pose_camera_in_world

        return develop

    def close(self) -> None:
        pass


def encode(picture: Pixels, format: Format) -> bytes:
    """Return a picture as bytes.

    Args:
        picture: RGB (height, width, 3) uint8, or depth in metres (height, width) float32.
        format: `jpeg` (RGB only), `png` (depth as 16-bit millimetres), or `raw` (the array's bytes).

    Raises:
        ValueError: Depth as JPEG.
    """
    if format == "raw":
        return picture.tobytes()
    import cv2

    if picture.ndim == 3:
        flags = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY] if format == "jpeg" else [cv2.IMWRITE_PNG_COMPRESSION, 1]
        _, encoded = cv2.imencode(".jpg" if format == "jpeg" else ".png", picture[..., ::-1], flags)
    elif format == "png":
        millimetres = np.clip(np.round(1000.0 * picture), 0, 65535).astype(np.uint16)
        _, encoded = cv2.imencode(".png", millimetres, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    else:
        raise ValueError("depth has no JPEG form; ask for png or raw")
    return bytes(encoded)
