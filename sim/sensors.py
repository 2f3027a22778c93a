"""What cameras make of a scene: depth noise, dropout, colour noise, lens, calibration error, latency; by preset."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robosandbox.errors import InputError
from robosandbox.types import Intrinsics, Pose, RgbdFrame, matrix_from_rotation_vector
from robosandbox.validation import did_you_mean

# Height and width of frames, pixels; as of VGA, which RGB-D cameras deliver at full rate.
FRAME_SIZE = (480, 640)

# Difference of depth between neighbouring pixels that makes an edge, metres; chosen above what a table seen at a slant
# has (5 mm) and below the thickness of what can be held.
_EDGE_STEP = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """An RGB-D camera's imperfections.

    Stereo depth errs with the square of the distance: sigma_z = sigma_disparity z^2 / (f b), correlated over the matching
    window, and comes in steps of the disparity's resolution (Keselman et al., Intel RealSense Stereoscopic Depth
    Cameras, 2017).

    Attributes:
        name: Of the preset.
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

    def sense(self, frame: RgbdFrame) -> RgbdFrame:
        """Return a perfect frame as this sensor delivers it; the same frame gets the same noise."""
        if self.name == "ideal":
            return frame
        rng = np.random.default_rng([self.seed, zlib.crc32(frame.camera.encode()), round(1e6 * frame.time)])
        rgb, depth = _distort(frame, self.distortion)
        return replace(
            frame,
            rgb=self._colours(rgb, rng),
            depth=self._depths(depth, rng),
            intrinsics=replace(frame.intrinsics, distortion=self._calibrated_lens(frame.camera)),
            pose_camera_in_world=self._calibrated_pose(frame.camera, frame.pose_camera_in_world),
        )

    def _depths(self, depth: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
        import cv2

        height, width = depth.shape
        # Half of the variance is shared by neighbours, as by what falls into one matching window.
        coarse = rng.standard_normal((-(-height // 3), -(-width // 3)), dtype=np.float32)
        noise = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
        noise += 0.7 * rng.standard_normal((height, width), dtype=np.float32)
        square = depth * depth
        noisy = depth + np.float32(self.depth_noise) * square * noise
        if self.depth_step > 0.0:
            # Disparity is what is quantized: a step of depth is a constant step of 1 / z.
            step = np.float32(self.depth_step)
            noisy = 1.0 / (np.round(1.0 / np.maximum(noisy, 0.05) / step) * step)
        lost = rng.random((height, width), dtype=np.float32) < self.missing
        if self.edge_dropout:
            near = cv2.erode(depth, np.ones((3, 3), np.uint8))
            far = cv2.dilate(depth, np.ones((3, 3), np.uint8))
            edges = (far - near > _EDGE_STEP).astype(np.uint8)
            size = 2 * self.edge_dropout - 1
            around = cv2.dilate(edges, np.ones((size, size), np.uint8)) > 0
            lost |= around & (rng.random((height, width), dtype=np.float32) < 0.7)
        noisy[lost] = 0.0
        return np.asarray(noisy, dtype=np.float32)

    def _colours(self, rgb: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
        gain = 1.0 + rng.uniform(-1.0, 1.0) * self.exposure
        noise = self.colour_noise * rng.standard_normal(rgb.shape, dtype=np.float32)
        return np.clip(np.float32(gain) * rgb + noise + 0.5, 0.0, 255.0).astype(np.uint8)

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


def _distort(
    frame: RgbdFrame, distortion: tuple[float, float, float, float, float]
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return picture and depth of a pinhole camera as a lens with this distortion shows them."""
    if not any(distortion):
        return frame.rgb, frame.depth
    import cv2

    straight = _undistorted(frame.intrinsics, distortion)
    # Both maps are in one array; the stubs know no other way than two.
    nothing: Any = None
    rgb = cv2.remap(frame.rgb, straight, nothing, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    depth = cv2.remap(frame.depth, straight, nothing, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
    return rgb.astype(np.uint8), depth.astype(np.float32)


@lru_cache(maxsize=8)
def _undistorted(lens: Intrinsics, distortion: tuple[float, float, float, float, float]) -> NDArray[np.float32]:
    """Return where a pinhole sees what each pixel behind a lens sees, (height, width, 2)."""
    import cv2

    matrix = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
    columns, rows = np.meshgrid(np.arange(lens.width, dtype=np.float32), np.arange(lens.height, dtype=np.float32))
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 1, 2)
    straight = cv2.undistortPoints(pixels, matrix, np.array(distortion), P=matrix)
    return np.asarray(straight, dtype=np.float32).reshape(lens.height, lens.width, 2)


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
