"""A video per camera, encoded while the episode runs."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robosandbox.driver import Driver
from robosandbox.sim.opening import mujoco_behind
from robosandbox.workcell.recording.files import VIDEOS, VideoMeta
from robosandbox.workcell.recording.settings import VideoSettings, rows_per_frame

# Every key frame begins a fragment of its own, so that a film whose process died plays up to the last whole second.
_FRAGMENTED = "frag_keyframe+empty_moov+default_base_moof"


class Film:
    """An H.264 film in an MP4 file.

    Args:
        path: The file.
        fps: Frames per second.
        size: (height, width) of the pictures, pixels; both even.
    """

    def __init__(self, path: Path, fps: float, size: tuple[int, int]) -> None:
        import av

        height, width = size
        rate = Fraction(fps).limit_denominator(1000)
        self.frames: int = 0
        self._container: Any = av.open(str(path), "w", format="mp4", options={"movflags": _FRAGMENTED})
        self._stream: Any = self._container.add_stream("libx264", rate=rate)
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, "yuv420p"
        self._stream.time_base = 1 / rate
        # Without look-ahead and frame reordering the encoder holds one picture and a fragment ends every second.
        self._stream.options = {"preset": "veryfast", "tune": "zerolatency", "crf": "20", "g": str(max(1, round(fps)))}
        self._make = av.VideoFrame.from_ndarray

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Add a frame, RGB (height, width, 3) uint8."""
        frame = self._make(picture, format="rgb24")
        frame.pts = self.frames
        self.frames += 1
        self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        """Write what the encoder holds, and the end."""
        if self.frames:
            self._container.mux(self._stream.encode(None))
        self._container.close()


class VideoWriter:
    """Films one camera of a world while an episode runs.

    Args:
        folder: The episode's.
        camera: Its name.
        driver: Whose camera.
        settings: What is filmed.
    """

    def __init__(self, folder: Path, camera: str, driver: Driver, settings: VideoSettings) -> None:
        world = mujoco_behind(driver)
        size = driver.state((camera,)).images[camera].shape[:2] if world is None else world.render_size
        height, width = size
        every = rows_per_frame(settings.fps, driver.control_timestep, "--video-fps")
        self.meta: VideoMeta = VideoMeta(camera=camera, every=every, fps=settings.fps, width=width, height=height)
        self._driver = driver
        (folder / VIDEOS).mkdir(exist_ok=True)
        self._film = Film(folder / VIDEOS / f"{camera}.mp4", settings.fps, (height, width))

    def add(self, row: int) -> None:
        """Film the world as it is at a row of the steps, if a frame is due."""
        if row % self.meta.every == 0:
            self._film.add(self._driver.state((self.meta.camera,)).images[self.meta.camera])

    def close(self) -> None:
        """End the film."""
        self._film.close()
