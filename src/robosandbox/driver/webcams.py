"""Webcams as senses: colour pictures of OpenCV's VideoCapture, with the lens and the place that a file gives each camera."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.driver.bare import BareSenses
from robosandbox.driver.capabilities import CameraSpec
from robosandbox.driver.realsense import REALSENSE, OpenRealsense
from robosandbox.driver.webcam_file import Webcam, WebcamFile, known_lens
from robosandbox.errors import InputError, SensorError
from robosandbox.types import Intrinsics, PictureWindow, Pose, RgbdFrame
from robosandbox.validation import load_yaml_model

if TYPE_CHECKING:
    from robosandbox.driver.wall_clock import WallClockDriver

# Seconds for which a device may deliver one picture: in the dark webcams take five a second, and one may be lost.
_SAME_SECONDS = 1.0


class OpenWebcam:
    """A webcam that delivers pictures; a device that went is opened again when it is asked for the next.

    Args:
        name: What it is called.
        webcam: What its file says of it.

    Attributes:
        is_device: Whether it is one, or a file.

    Raises:
        InputError: Its source does not open.
    """

    def __init__(self, name: str, webcam: Webcam) -> None:
        self._name, self._webcam = name, webcam
        self.is_device = isinstance(webcam.source, int) or webcam.source.startswith("/dev/")
        self._last: NDArray[np.uint8] | None = None
        self._last_new = 0.0
        self._open()
        if not self._capture.isOpened():
            raise InputError(
                f"webcams: {name}: nothing opens at the source {webcam.source!r}; give the number of a device that is plugged "
                "in and that no other program uses, or the path of a video"
            )

    @property
    def lens(self) -> Intrinsics:
        """Its lens as its file has it; pixels."""
        assert self._webcam.lens is not None
        return self._webcam.lens.intrinsics

    def frame(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return its next picture, and no depth: zeros, (height, width); errors as of `picture`."""
        picture = self.picture()
        return picture, np.zeros(picture.shape[:2], dtype=np.float32)

    def picture(self) -> NDArray[np.uint8]:
        """Return its next picture, RGB, (height, width, 3).

        Raises:
            SensorError: It delivers none, the same for over a second, or one of another size than its lens has.
        """
        picture = self._next()
        if isinstance(picture, str) and self.is_device:
            # It may have been plugged in again, or be one that begins anew.
            self._capture.release()
            self._open()
            picture = self._next()
        if isinstance(picture, str):
            raise SensorError(f"camera {self._name!r}: {self._webcam.source!r} {picture}")
        lens = self._webcam.lens
        if lens is not None and picture.shape[:2] != (lens.height, lens.width):
            height, width = picture.shape[:2]
            raise SensorError(
                f"camera {self._name!r}: its pictures are {width} x {height} pixels, and its lens is given for "
                f"{lens.width} x {lens.height}; give the lens as calibrated for that size"
            )
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), dtype=np.uint8)

    def close(self) -> None:
        """Let go of its source."""
        self._capture.release()

    def _open(self) -> None:
        lens = self._webcam.lens
        self._capture = cv2.VideoCapture(self._webcam.source)
        # A device is asked for the size that the lens was measured at; files have theirs.
        if self.is_device and self._capture.isOpened():
            if lens is not None:
                self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, lens.width)
                self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, lens.height)
            self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)

    def _next(self) -> NDArray[np.uint8] | str:
        """Return the next picture, BGR, or what is the matter with it.

        No two pictures of a sensor are the same, for its noise: a device that delivers the last one again is asked until there is
        another, and has stopped where there is none for long.
        """
        if self.is_device:
            # The picture that a device has ready may be older than the question.
            self._capture.grab()
        while True:
            good, read = self._capture.read()
            if not good:
                return "delivers no picture; look at its cable, or whether a video has ended"
            picture, now = np.asarray(read, dtype=np.uint8), time.monotonic()
            if self._last is None or not self.is_device or not np.array_equal(picture, self._last):
                self._last, self._last_new = picture, now
                return picture
            if now - self._last_new > _SAME_SECONDS:
                return (
                    f"delivers the same picture for {now - self._last_new:.1f} s; look whether it is covered or hangs, and plug it in "
                    "anew"
                )


def open_camera(path: Path, name: str, webcam: Webcam) -> OpenWebcam | OpenRealsense:
    """Return a camera of a file, opened, with a lens that is known.

    Raises:
        InputError: It does not open, or neither its file nor itself tells its lens.
    """
    if str(webcam.source).partition(":")[0] == REALSENSE:
        return OpenRealsense(name, webcam)
    known_lens(path, name, webcam)
    return OpenWebcam(name, webcam)


class Webcams(BareSenses):
    """Cameras of a driver that stand beside the arm, or ride on its hand.

    Args:
        driver: Whose arm they see.
        path: YAML as of `robosandbox.driver.webcam_file.WebcamFile`.

    Attributes:
        cameras: By name.

    Raises:
        InputError: The file does not fit, a lens or a pose is missing, or a source does not open.
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
        self._open: dict[str, OpenWebcam | OpenRealsense] = {}
        for name, webcam in webcams.items():
            assert webcam.pose is not None
            self._open[name] = opened = open_camera(path, name, webcam)
            cameras[name] = CameraSpec(intrinsics=opened.lens, pose=webcam.pose, arm=webcam.arm)
        self.cameras: Mapping[str, CameraSpec] = cameras

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return a picture, with the depth that its camera measures, and how the arm stood when it came; always a whole one.

        Raises:
            SensorError: The camera delivers none, or the same for over a second.
        """
        del window
        spec, driver = self.cameras[camera], self._wall_clock
        picture, depth = self._open[camera].frame()
        pose = spec.pose if spec.arm is None else driver.arms[spec.arm].state().tcp_pose @ spec.pose
        frame = without_depth(camera, picture, spec.intrinsics, pose)
        return replace(frame, depth=depth, time=driver.time, arms=driver.posture())


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
