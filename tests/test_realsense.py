"""A RealSense camera, as its maker's library has one without hardware: a software device that is fed with pictures."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import closing
from typing import Any

import numpy as np
import pytest

# Its library needs libusb beside the wheel.
pytest.importorskip("pyrealsense2", reason="the extra `realsense` is not installed", exc_type=ImportError)

import pyrealsense2 as rs

from robosandbox.driver.realsense import OpenRealsense
from robosandbox.driver.webcam_file import Lens, Webcam
from robosandbox.errors import InputError, SensorError

WIDE, HIGH = 640, 480
# Millimetres of a depth of 1, and metres by which the colour camera stands to the right of the depth camera.
_UNIT, _BESIDE = 0.5, 0.015


class Camera:
    """A software device before a wall, a metre away, on whose right half stands a box, 0.8 m away."""

    def __init__(self, coeffs: tuple[float, ...] = (0.0,) * 5, model: Any = None) -> None:
        self.device = rs.software_device()
        self._depth, self._colour = self.device.add_sensor("Depth"), self.device.add_sensor("Color")
        self._depth.add_read_only_option(rs.option.depth_units, 1e-3 * _UNIT)
        self._streams = (
            (self._depth, self._depth.add_video_stream(_stream(rs.stream.depth, rs.format.z16, 2, 400.0))),
            (
                self._colour,
                self._colour.add_video_stream(_stream(rs.stream.color, rs.format.rgb8, 3, 600.0, coeffs, model)),
            ),
        )
        beside = rs.extrinsics()
        beside.rotation, beside.translation = [1, 0, 0, 0, 1, 0, 0, 0, 1], [-_BESIDE, 0, 0]
        self._streams[0][1].register_extrinsics_to(self._streams[1][1], beside)
        self.device.create_matcher(rs.matchers.default)
        self._unplugged = threading.Event()
        self._feeding = threading.Thread(target=self._feed)

    def __enter__(self) -> Camera:
        self._feeding.start()
        return self

    def unplug(self) -> None:
        self._unplugged.set()
        self._feeding.join()

    def __exit__(self, *_: object) -> None:
        self.unplug()

    def _feed(self) -> None:
        depth = np.full((HIGH, WIDE), round(1000 / _UNIT), np.uint16)
        depth[:, WIDE // 2 :] = round(800 / _UNIT)
        colour = np.zeros((HIGH, WIDE, 3), np.uint8)
        colour[..., 0] = 200
        number = 0
        while not self._unplugged.wait(0.03):
            number += 1
            for (sensor, profile), pixels, size in zip(self._streams, (depth, colour), (2, 3), strict=True):
                frame = rs.software_video_frame()
                frame.pixels, frame.stride, frame.bpp = pixels, WIDE * size, size
                frame.timestamp, frame.frame_number, frame.domain = (
                    33.0 * number,
                    number,
                    rs.timestamp_domain.hardware_clock,
                )
                frame.profile = profile.as_video_stream_profile()
                if size == 2:
                    frame.depth_units = 1e-3 * _UNIT
                sensor.on_video_frame(frame)


def _stream(
    kind: Any, form: Any, size: int, focal: float, coeffs: tuple[float, ...] = (0.0,) * 5, model: Any = None
) -> Any:
    lens = rs.intrinsics()
    lens.width, lens.height, lens.fx, lens.fy, lens.ppx, lens.ppy = WIDE, HIGH, focal, focal, WIDE / 2, HIGH / 2
    lens.model, lens.coeffs = model or rs.distortion.none, list(coeffs)
    stream = rs.video_stream()
    stream.type, stream.uid, stream.width, stream.height, stream.fps = kind, size, WIDE, HIGH, 30
    stream.bpp, stream.fmt, stream.intrinsics = size, form, lens
    return stream


@pytest.fixture
def camera() -> Iterator[Camera]:
    with Camera() as camera:
        yield camera


def test_depth_is_told_in_metres_where_the_colour_camera_sees_it(camera: Camera) -> None:
    with closing(OpenRealsense("above", Webcam(source="realsense"), camera.device)) as opened:
        picture, depth = opened.frame()
    assert picture.shape == (HIGH, WIDE, 3) and (picture == [200, 0, 0]).all()
    assert depth.shape == (HIGH, WIDE) and depth.dtype == np.float32
    middle = depth[HIGH // 2]
    assert middle[50] == pytest.approx(1.0) and middle[-50] == pytest.approx(0.8)
    # The box begins in the middle of the depth camera's picture, and farther left in that of one that stands to its right.
    assert np.flatnonzero(middle > 0.0)[np.argmax(middle[middle > 0.0] < 0.9)] == pytest.approx(
        WIDE / 2 - 600.0 * _BESIDE / 0.8, abs=2
    )
    assert opened.lens.fx == 600.0 and opened.lens.cx == WIDE / 2 and opened.lens.distortion == (0.0,) * 5


def test_a_camera_that_went_is_told() -> None:
    with Camera() as camera, closing(OpenRealsense("above", Webcam(source="realsense"), camera.device)) as opened:
        opened.frame()
        camera.unplug()
        with pytest.raises(SensorError, match=r"camera 'above': .*; look at its cable, and plug it in anew"):
            for _ in range(40):
                opened.frame()


def test_a_lens_that_opencv_does_not_have_is_not_taken_for_one_that_it_has() -> None:
    bent = (0.1, 0.01, 0.0, 0.0, 0.001)
    with (
        Camera(bent, rs.distortion.brown_conrady) as camera,
        closing(OpenRealsense("above", Webcam(source="realsense"), camera.device)) as opened,
    ):
        assert opened.lens.distortion == pytest.approx(bent)
    with Camera(bent, rs.distortion.inverse_brown_conrady) as camera:
        with pytest.raises(InputError, match="webcams: above: its lens is told as inverse_brown_conrady"):
            OpenRealsense("above", Webcam(source="realsense"), camera.device)
        measured = Lens(width=WIDE, height=HIGH, fx=610.0, fy=610.0, cx=320.0, cy=240.0)
        with closing(OpenRealsense("above", Webcam(source="realsense", lens=measured), camera.device)) as opened:
            assert opened.lens.fx == 610.0


def test_what_is_not_there_is_told(camera: Camera) -> None:
    with pytest.raises(InputError, match=r"0 RealSense cameras are plugged in \(none\)"):
        OpenRealsense("above", Webcam(source="realsense"))
    with pytest.raises(InputError, match="no RealSense of serial number 42 is plugged in; there are none"):
        OpenRealsense("above", Webcam(source="realsense:42"))
    small = Lens(width=320, height=240, fx=300.0, fy=300.0, cx=160.0, cy=120.0)
    with pytest.raises(InputError, match="it has no depth of 320 x 240 pixels, 30 a second"):
        OpenRealsense("above", Webcam(source="realsense", lens=small), camera.device)
