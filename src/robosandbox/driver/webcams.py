"""Webcams as senses: colour pictures of OpenCV's VideoCapture, with the lens and the place that a file gives each camera."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.driver.bare import BareSenses
from robosandbox.driver.capabilities import CameraSpec
from robosandbox.errors import InputError, SensorError
from robosandbox.types import Intrinsics, PictureWindow, Pose, RgbdFrame, StrictModel
from robosandbox.validation import load_yaml_model

if TYPE_CHECKING:
    from robosandbox.driver.wall_clock import WallClockDriver


class Lens(StrictModel):
    """A camera's pinhole and lens, as in `robosandbox.types.Intrinsics`; pixels."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    @property
    def intrinsics(self) -> Intrinsics:
        """The same for frames."""
        return Intrinsics(**self.model_dump())


class Webcam(StrictModel):
    """A camera as its file describes it.

    Attributes:
        source: Number of the device, or its path, or that of a video or of numbered pictures (`seen_%03d.png`).
        lens: Its intrinsics.
        pose: Of its optical frame (z forward, y down) in the world; None before `robo-sandbox calibrate` has written it.
    """

    source: int | str
    lens: Lens
    pose: Pose | None = None


class WebcamFile(StrictModel):
    """Content of a file of webcams.

    Attributes:
        webcams: By name.
    """

    webcams: dict[str, Webcam]


class OpenWebcam:
    """A webcam that delivers pictures.

    Args:
        name: What it is called.
        webcam: What its file says of it.

    Raises:
        InputError: Its source does not open.
    """

    def __init__(self, name: str, webcam: Webcam) -> None:
        self._name, self._webcam = name, webcam
        # A device is asked for the size that the lens was measured at; files have theirs.
        self._is_device = isinstance(webcam.source, int) or webcam.source.startswith("/dev/")
        self._capture = cv2.VideoCapture(webcam.source)
        if not self._capture.isOpened():
            raise InputError(
                f"webcams: {name}: nothing opens at the source {webcam.source!r}; give the number of a device that is plugged "
                "in and that no other program uses, or the path of a video"
            )
        if self._is_device:
            self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, webcam.lens.width)
            self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, webcam.lens.height)
            self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)

    def picture(self) -> NDArray[np.uint8]:
        """Return its next picture, RGB, (height, width, 3).

        Raises:
            SensorError: It delivers none, or one of another size than its lens has.
        """
        if self._is_device:
            # The picture that a device has ready may be older than the question.
            self._capture.grab()
        good, picture = self._capture.read()
        lens = self._webcam.lens
        if not good:
            raise SensorError(
                f"camera {self._name!r}: {self._webcam.source!r} delivers no picture; look at its cable, or whether a video "
                "has ended"
            )
        if picture.shape[:2] != (lens.height, lens.width):
            height, width = picture.shape[:2]
            raise SensorError(
                f"camera {self._name!r}: its pictures are {width} x {height} pixels, and its lens is given for "
                f"{lens.width} x {lens.height}; give the lens as calibrated for that size"
            )
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), dtype=np.uint8)

    def close(self) -> None:
        """Let go of its source."""
        self._capture.release()


class Webcams(BareSenses):
    """Cameras of a driver that stand beside the arm.

    Args:
        driver: Whose arm they see.
        path: YAML as of `WebcamFile`.

    Attributes:
        cameras: By name.

    Raises:
        InputError: The file does not fit, a pose is missing, or a source does not open.
    """

    def __init__(self, driver: WallClockDriver, path: Path) -> None:
        super().__init__(driver)
        self._wall_clock = driver
        cameras = {}
        webcams = load_yaml_model(path, WebcamFile).webcams
        for name, webcam in webcams.items():
            if webcam.pose is None:
                raise InputError(
                    f"{path}: webcams.{name}.pose is missing; lay the board on the table and run "
                    f"`robo-sandbox calibrate --webcams {path}`"
                )
            cameras[name] = CameraSpec(intrinsics=webcam.lens.intrinsics, pose=webcam.pose)
        self._open = {name: OpenWebcam(name, webcam) for name, webcam in webcams.items()}
        self.cameras: Mapping[str, CameraSpec] = cameras

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return a picture without depth, and how the arm stood when it came; always a whole one.

        Raises:
            SensorError: The camera delivers none.
        """
        del window
        spec, driver = self.cameras[camera], self._wall_clock
        picture = self._open[camera].picture()
        return replace(
            without_depth(camera, picture, spec.intrinsics, spec.pose), time=driver.time, arms=driver.posture()
        )


def without_depth(camera: str, picture: NDArray[np.uint8], lens: Intrinsics, pose: Pose) -> RgbdFrame:
    """Return a picture as a frame that measures no depth and shows no arm.

    Args:
        camera: Its name.
        picture: RGB, (height, width, 3).
        lens: Of its camera.
        pose: Of its camera's optical frame in the world.
    """
    return RgbdFrame(
        camera=camera,
        time=0.0,
        rgb=picture,
        depth=np.zeros(picture.shape[:2], dtype=np.float32),
        intrinsics=lens,
        pose_camera_in_world=pose,
        arms={},
    )
