"""Sensor models of cameras by preset: depth noise, dropout, colour noise, lens, calibration error, latency."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robosandbox.errors import InputError
from robosandbox.types import Intrinsics, PictureWindow, Pose, RgbdFrame, matrix_from_rotation_vector
from robosandbox.validation import did_you_mean
from robosandbox.values import frozen

if TYPE_CHECKING:
    from robosandbox.sim.sensor_noise import NoiseTables

# Height and width of frames, pixels; as of VGA, which RGB-D cameras deliver at full rate.
FRAME_SIZE = (480, 640)

# Difference of depth between neighbouring pixels that makes an edge, metres; chosen above what a table seen at a slant
# has (5 mm) and below the thickness of what can be held.
_EDGE_STEP = 0.02
# Share of the pixels around an edge that get no depth. Chosen.
_LOST_AT_EDGES = 0.7
# Metres between which depth is measured at all; chosen wider than any preset's scene.
_NEAREST, _FARTHEST = 0.05, 100.0
_NEIGHBOURS = np.ones((3, 3), np.uint8)


@frozen(kw_only=True)
class Sensor:
    """An RGB-D camera's imperfections.

    Stereo depth errs with the square of the distance: sigma_z = sigma_disparity z^2 / (f b), correlated over the matching
    window, and comes in steps of the disparity's resolution (Keselman et al., Intel RealSense Stereoscopic Depth
    Cameras, 2017).

    Attributes:
        name: Of the preset.
        depth: Whether it measures depth; else its frames have 0 everywhere.
        depth_noise: Standard deviation at one metre, metres; grows with the square of the distance.
        depth_step: Quantization at one metre, metres; grows likewise.
        edge_dropout: Pixels around depth edges that get no depth.
        missing: Share of pixels elsewhere that get none.
        colour_noise: Standard deviation per channel, of 255.
        exposure: How far brightness may be off, a fraction either way.
        distortion: Of the lens; what is calibrated differs from it by `calibration_distortion`.
        calibration_distortion: Standard deviation of k1 as calibrated.
        calibration_position: Standard deviation of each coordinate of the camera's calibrated position, metres.
        calibration_rotation: Standard deviation of its rotation about each axis, radians.
        latency: Seconds between exposure and delivery.
        seed: Of its noise.
    """

    name: str
    depth: bool = True
    depth_noise: float = 0.0
    depth_step: float = 0.0
    edge_dropout: int = 0
    missing: float = 0.0
    colour_noise: float = 0.0
    exposure: float = 0.0
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    calibration_distortion: float = 0.0
    calibration_position: float = 0.0
    calibration_rotation: float = 0.0
    latency: float = 0.0
    seed: int = 0

    def needs(self, lens: Intrinsics, window: PictureWindow) -> PictureWindow:
        """Return the part of a pinhole's picture that shows all that a part of this sensor's picture depends on."""
        padded, size = self._padded(lens, window), (lens.height, lens.width)
        if not any(self.distortion) or padded == PictureWindow(left=0, top=0, right=lens.width, bottom=lens.height):
            return padded
        columns, rows = np.moveaxis(_undistorted(lens, self.distortion)[0][padded.rows, padded.columns], -1, 0)
        found = PictureWindow(
            left=int(columns.min()), top=int(rows.min()), right=int(columns.max()) + 1, bottom=int(rows.max()) + 1
        )
        return found.widened(1, size)

    def _padded(self, lens: Intrinsics, window: PictureWindow) -> PictureWindow:
        """Return a part of the picture with those around it whose edges may cost it depth."""
        return window.widened(self.edge_dropout + 1, (lens.height, lens.width))

    def sense(self, frame: RgbdFrame, window: PictureWindow | None = None) -> RgbdFrame:
        """Return a perfect frame as this sensor delivers it; the same frame gets the same noise.

        Args:
            frame: Its picture and depth are those of a pinhole; of a window, of the part that `needs` says.
            window: The part of the picture that is delivered: as it is in the whole one, the rest black and without depth.
        """
        lens = frame.intrinsics
        size = (lens.height, lens.width)
        whole = PictureWindow(left=0, top=0, right=lens.width, bottom=lens.height)
        if window is None:
            window = whole
        if self.name == "ideal":
            return _pasted(frame, frame.rgb, frame.depth, self._padded(lens, window), window)
        # OpenCV, which takes half a second to import, is needed only where pictures are taken.
        from robosandbox.sim.sensor_noise import noise_tables

        noise, rng = noise_tables(self.seed), self._random(frame)
        padded = self._padded(lens, window)
        rgb, depth = frame.rgb, frame.depth
        if any(self.distortion):
            rgb, depth = _distorted(rgb, depth, _undistorted(lens, self.distortion), self.needs(lens, window), padded)
        gain = 1.0 + float(rng.uniform(-1.0, 1.0)) * self.exposure
        rgb = noise.coloured(rgb, gain, self.colour_noise, size, padded, rng)
        depth = self._depths(depth, noise, size, padded, rng) if self.depth else np.zeros_like(depth)
        delivered = _pasted(frame, rgb, depth, padded, window)
        return replace(
            delivered,
            intrinsics=replace(lens, distortion=self._calibrated_lens(frame.camera)),
            pose_camera_in_world=self._calibrated_pose(frame.camera, frame.pose_camera_in_world),
        )

    def _random(self, frame: RgbdFrame) -> np.random.Generator:
        return np.random.default_rng([self.seed, zlib.crc32(frame.camera.encode()), round(1e6 * frame.time)])

    def _depths(
        self,
        depth: NDArray[np.float32],
        noise: NoiseTables,
        size: tuple[int, int],
        window: PictureWindow,
        rng: np.random.Generator,
    ) -> NDArray[np.float32]:
        import cv2

        # Stereo measures disparity, 1 / z: its noise and its steps are the same at every distance.
        disparity = np.reciprocal(np.maximum(depth, np.float32(_NEAREST)))
        disparity = cv2.scaleAdd(noise.disparity(size, window, rng), self.depth_noise, disparity)
        if self.depth_step > 0.0:
            disparity *= np.float32(1.0 / self.depth_step)
            np.rint(disparity, out=disparity)
            disparity *= np.float32(self.depth_step)
        np.maximum(disparity, np.float32(1.0 / _FARTHEST), out=disparity)
        noisy = np.reciprocal(disparity, out=disparity)
        lost = noise.lost(self.missing, size, window, rng)
        if self.edge_dropout:
            near, far = cv2.erode(depth, _NEIGHBOURS), cv2.dilate(depth, _NEIGHBOURS)
            edges = (far - near > _EDGE_STEP).view(np.uint8)
            side = 2 * self.edge_dropout - 1
            around = cv2.dilate(edges, np.ones((side, side), np.uint8)).view(np.bool_)
            lost = lost | (around & noise.lost(_LOST_AT_EDGES, size, window, rng))
        noisy[lost] = 0.0
        return np.asarray(noisy, dtype=np.float32)

    def _calibrated_lens(self, camera: str) -> tuple[float, float, float, float, float]:
        rng = np.random.default_rng([self.seed, zlib.crc32(camera.encode()), 1])
        k1, *rest = self.distortion
        return (k1 + float(rng.standard_normal()) * self.calibration_distortion, rest[0], rest[1], rest[2], rest[3])

    def _calibrated_pose(self, camera: str, true: Pose) -> Pose:
        rng = np.random.default_rng([self.seed, zlib.crc32(camera.encode()), 2])
        offset = rng.standard_normal(3) * self.calibration_position
        vector = rng.standard_normal(3) * self.calibration_rotation
        return Pose.from_matrix(true.position + offset, true.rotation @ matrix_from_rotation_vector(vector))


SENSORS: Mapping[str, Sensor] = {
    sensor.name: sensor
    for sensor in (
        Sensor(name="ideal"),
        Sensor(
            name="realsense",
            depth_noise=0.0014,
            depth_step=0.0006,
            edge_dropout=2,
            missing=0.005,
            colour_noise=2.0,
            exposure=0.03,
            distortion=(-0.02, 0.005, 0.0, 0.0, 0.0),
            calibration_distortion=0.0005,
            calibration_position=0.0005,
            calibration_rotation=0.0007,
            latency=0.03,
        ),
        Sensor(
            name="rough",
            depth_noise=0.006,
            depth_step=0.003,
            edge_dropout=4,
            missing=0.05,
            colour_noise=8.0,
            exposure=0.15,
            distortion=(-0.08, 0.02, 0.001, 0.0, 0.0),
            calibration_distortion=0.004,
            calibration_position=0.003,
            calibration_rotation=0.004,
            latency=0.1,
        ),
        # A lens and noise as of cheap USB cameras; the pose as a board that was read once and a camera that was touched since leave it.
        Sensor(
            name="webcam",
            depth=False,
            colour_noise=4.0,
            exposure=0.1,
            distortion=(-0.05, 0.01, 0.0, 0.0, 0.0),
            calibration_distortion=0.001,
            calibration_position=0.005,
            calibration_rotation=float(np.radians(1.0)),
            latency=0.05,
        ),
    )
}


def find_sensor(name: str) -> Sensor:
    """Return a preset.

    Raises:
        InputError: There is none of that name.
    """
    if name not in SENSORS:
        raise InputError(
            f"--sensor: no sensor {name[:60]!r}; there is {', '.join(SENSORS)}{did_you_mean(name, SENSORS)}"
        )
    return SENSORS[name]


def _pasted(
    frame: RgbdFrame, rgb: NDArray[np.uint8], depth: NDArray[np.float32], have: PictureWindow, window: PictureWindow
) -> RgbdFrame:
    """Return the frame with a window of its picture, cut out of the part that is there, and nothing around it."""
    lens = frame.intrinsics
    if (window.right - window.left, window.bottom - window.top) == (lens.width, lens.height):
        return replace(frame, rgb=rgb, depth=depth)
    picture = np.zeros((lens.height, lens.width, 3), dtype=np.uint8)
    metres = np.zeros((lens.height, lens.width), dtype=np.float32)
    inside = (
        slice(window.top - have.top, window.bottom - have.top),
        slice(window.left - have.left, window.right - have.left),
    )
    picture[window.rows, window.columns], metres[window.rows, window.columns] = rgb[inside], depth[inside]
    return replace(frame, rgb=picture, depth=metres)


def _distorted(
    rgb: NDArray[np.uint8],
    depth: NDArray[np.float32],
    maps: tuple[NDArray[np.int16], NDArray[np.uint16], NDArray[np.int16]],
    have: PictureWindow,
    window: PictureWindow,
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return a window of a pinhole's picture and depth as a lens shows them.

    Args:
        rgb: A part of the pinhole's picture.
        depth: The same of its depth.
        maps: As `_undistorted` returns them.
        have: Which part.
        window: Of the picture behind the lens.
    """
    import cv2

    places, shares, nearest = (each[window.rows, window.columns] for each in maps)
    if have.left or have.top:
        corner = np.array([have.left, have.top], dtype=np.int16)
        places, nearest = places - corner, nearest - corner
    # Four channels are moved in little more than half of the time that three take.
    padded = cv2.cvtColor(rgb, cv2.COLOR_RGB2RGBA)
    padded = cv2.remap(padded, places, shares, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    shown = cv2.cvtColor(padded, cv2.COLOR_RGBA2RGB)
    # Whole pixels are in one array; the stubs know no other way than two.
    nothing: Any = None
    metres = cv2.remap(depth, nearest, nothing, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(shown, dtype=np.uint8), np.asarray(metres, dtype=np.float32)


@lru_cache(maxsize=8)
def _undistorted(
    lens: Intrinsics, distortion: tuple[float, float, float, float, float]
) -> tuple[NDArray[np.int16], NDArray[np.uint16], NDArray[np.int16]]:
    """Return where a pinhole sees what each pixel behind a lens sees: whole pixels and what is left over; and the nearest."""
    import cv2

    matrix = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
    columns, rows = np.meshgrid(np.arange(lens.width, dtype=np.float32), np.arange(lens.height, dtype=np.float32))
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 1, 2)
    straight = cv2.undistortPoints(pixels, matrix, np.array(distortion), P=matrix)
    straight = np.asarray(straight, dtype=np.float32).reshape(lens.height, lens.width, 2)
    nothing: Any = None
    places, shares = cv2.convertMaps(straight, nothing, cv2.CV_16SC2)
    nearest, _ = cv2.convertMaps(straight, nothing, cv2.CV_16SC2, nninterpolation=True)
    return np.asarray(places, dtype=np.int16), np.asarray(shares, dtype=np.uint16), np.asarray(nearest, dtype=np.int16)


def perfect_intrinsics(size: tuple[int, int], fovy: float) -> Intrinsics:
    """Return a rendered camera's intrinsics: no distortion, the axis through the middle of the picture.

    Args:
        size: (height, width), pixels.
        fovy: Vertical field of view, radians.
    """
    height, width = size
    focal = height / 2.0 / float(np.tan(fovy / 2.0))
    # Pixel centres are at whole numbers, so the middle lies between two of them.
    return Intrinsics(width=width, height=height, fx=focal, fy=focal, cx=(width - 1) / 2.0, cy=(height - 1) / 2.0)
