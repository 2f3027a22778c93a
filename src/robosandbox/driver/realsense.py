"""RealSense depth cameras by their maker's library: colour, and depth seen from where the colour is taken."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robosandbox.driver.webcam_file import Webcam
from robosandbox.errors import InputError, SensorError
from robosandbox.extras import missing_extra
from robosandbox.types import Intrinsics

# The word before the colon of a source.
REALSENSE = "realsense"
# Size and rate of both pictures where no lens is given: each camera of the D400 and the L500 series has them.
_SIZE, _RATE = (640, 480), 30
# Milliseconds without a picture after which there is none: in the dark, and after a start, a camera takes that long.
_PATIENCE_MS = 2000
# Pictures after a start in which its exposure settles.
_SETTLING = 10


class OpenRealsense:
    """A RealSense camera that delivers pictures; one that went is opened again when it is asked for the next.

    Args:
        name: What it is called.
        webcam: What its file says of it: its source is "realsense", or "realsense:" and its serial number.
        device: The device of `pyrealsense2`; looked for by the source when left out.

    Attributes:
        is_device: That it is one, and no file.
        lens: Of its colour camera, as the factory measured it, or as its file has it.

    Raises:
        InputError: The extra is not installed, no such camera is plugged in, or it has no pictures of that size.
    """

    is_device = True

    def __init__(self, name: str, webcam: Webcam, device: Any = None) -> None:
        try:
            self._library: Any = import_module("pyrealsense2")
        except ImportError as error:
            raise missing_extra(error, f"webcams: {name}: {REALSENSE}", "realsense") from None
        self._name, self._webcam, self._given = name, webcam, device
        self._sensors: list[Any] = []
        self.lens: Intrinsics
        try:
            self._open()
        except RuntimeError as error:
            raise InputError(f"webcams: {name}: {error}") from None

    def picture(self) -> NDArray[np.uint8]:
        """Return its next picture, RGB, (height, width, 3); errors as of `frame`."""
        return self.frame()[0]

    def frame(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return its next picture, RGB, (height, width, 3), and the depth of each of its pixels, metres, 0 where none is measured.

        Raises:
            SensorError: It delivers none within two seconds.
        """
        try:
            if not self._sensors:
                self._open()
            # What waits there may be older than the question.
            self._frames.poll_for_frames()
            found = self._together()
        except RuntimeError as error:
            self.close()
            raise SensorError(f"camera {self._name!r}: {error}; look at its cable, and plug it in anew") from None
        depth = found.get_depth_frame()
        metres = np.asarray(depth.get_data(), dtype=np.float32) * np.float32(depth.get_units())
        return np.array(found.get_color_frame().get_data(), dtype=np.uint8), metres

    def close(self) -> None:
        """Let go of it."""
        for sensor in self._sensors:
            try:
                sensor.stop()
                sensor.close()
            except RuntimeError:
                # It is gone.
                continue
        self._sensors = []

    def _together(self) -> Any:
        """Return the next pair of pictures, the depth as from the colour's place; RuntimeError where none comes."""
        while True:
            frames = self._frames.wait_for_frames(_PATIENCE_MS)
            if frames.get_depth_frame() and frames.get_color_frame():
                return self._align.process(frames)

    def _open(self) -> None:
        """Start it; RuntimeError where that cannot be."""
        library, device = self._library, self._given or self._plugged_in()
        lens = self._webcam.lens
        size = _SIZE if lens is None else (lens.width, lens.height)
        profiles = [
            self._profile(device, stream, form, size)
            for stream, form in (
                (library.stream.depth, library.format.z16),
                (library.stream.color, library.format.rgb8),
            )
        ]
        self.lens = lens.intrinsics if lens is not None else _lens_of(library, profiles[1][1].get_intrinsics())
        self._frames, self._align = library.syncer(), library.align(library.stream.color)
        for sensor, profile in profiles:
            sensor.open(profile)
            sensor.start(self._frames)
            self._sensors.append(sensor)
        if self._given is None:
            for _ in range(_SETTLING):
                self._frames.wait_for_frames(_PATIENCE_MS)

    def _plugged_in(self) -> Any:
        library = self._library
        serial = str(self._webcam.source).partition(":")[2]
        found = {each.get_info(library.camera_info.serial_number): each for each in library.context().query_devices()}
        if serial and serial not in found:
            raise RuntimeError(
                f"no RealSense of serial number {serial} is plugged in; there are {sorted(found) or 'none'}"
            )
        if not serial and len(found) != 1:
            raise RuntimeError(
                f"{len(found)} RealSense cameras are plugged in ({', '.join(sorted(found)) or 'none'}); give `source: realsense:SERIAL`"
            )
        return found[serial] if serial else next(iter(found.values()))

    def _profile(self, device: Any, stream: Any, form: Any, size: tuple[int, int]) -> tuple[Any, Any]:
        """Return a sensor of a device and what it is to be opened with; RuntimeError where it has no such pictures."""
        for sensor in device.query_sensors():
            for profile in sensor.get_stream_profiles():
                if profile.stream_type() != stream or profile.format() != form or profile.fps() != _RATE:
                    continue
                video = profile.as_video_stream_profile()
                if (video.width(), video.height()) == size:
                    return sensor, video
        raise RuntimeError(
            f"it has no {stream.name} of {size[0]} x {size[1]} pixels, {_RATE} a second; give its lens in another size"
        )


def _lens_of(library: Any, told: Any) -> Intrinsics:
    """Return a pinhole and lens as OpenCV has them; RuntimeError where they are of another kind."""
    bends = any(abs(value) > 0.0 for value in told.coeffs)
    if bends and told.model != library.distortion.brown_conrady:
        raise RuntimeError(
            f"its lens is told as {told.model.name}, which is not known here; measure it by `calibrate --lens`"
        )
    k1, k2, p1, p2, k3 = (float(value) for value in (told.coeffs if bends else (0.0,) * 5))
    return Intrinsics(
        width=told.width,
        height=told.height,
        fx=told.fx,
        fy=told.fy,
        cx=told.ppx,
        cy=told.ppy,
        distortion=(k1, k2, p1, p2, k3),
    )
