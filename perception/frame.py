"""A camera frame prepared for segmentation: checked, undistorted, with its points in the world and the table at its height."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from robosandbox.errors import SensorError
from robosandbox.perception.quantiles import MAD, median
from robosandbox.types import Array, Intrinsics, RgbdFrame
from robosandbox.types.objects import TABLE_AREA, Area
from robosandbox.values import frozen

Image = NDArray[np.float32]
Mask = NDArray[np.bool_]

LEAST_DEPTH = 0.05  # Least depth, metres, that counts as measured. Chosen below what any sensor gives.
MOST_DEPTH = 4.0  # Largest depth, metres. Chosen beyond the table from every camera.
_DARK, _BRIGHT = 12, 250
_PLANE_STRIDE = 8  # Number of pixels between those to which the table's plane is fitted. Chosen.
# Metres from the table's height within which pixels may be the table. Chosen: what a badly calibrated camera is off.
_PLANE_BAND = 0.03
_PLANE_LEAST = 170  # Number of such pixels that tell the plane. Chosen.
_PLANE_TRIMS = 4  # Number of times that what is off is left out and the plane fitted anew. Chosen.
_LEAST_TRIM = 0.001  # Metres within which nothing is left out. Chosen.
# Standard deviation of depth where the table is not seen, metres. Chosen: that of `rough` at its distance.
_USUAL_NOISE = 0.0035
# Standard deviation of a camera's tilt, radians. Chosen: four times `calibration_rotation` of `realsense` in sim/sensors.py.
_TILT_PRIOR = 0.003
_SHIFT_PRIOR = 0.004  # Standard deviation of its height, metres. Chosen likewise.
_CORRELATED = 4.0  # Number of pixels whose depth errs alike, of those that are used. Chosen.
_MOST_SHIFT = 0.02  # Correction of the height, metres, beyond which it is none of the camera's. Chosen.
_MOST_TILT = 0.025  # The same of the tilt, radians. Chosen.


@frozen(eq=False)
class TablePrior:
    """Prior knowledge of the table.

    Attributes:
        height: Of its top, metres.
        area: Least and largest x, then y, of its top, metres.
        rgb: Its colour, channels 0..1: the reference against which other colours are read.
    """

    height: float
    area: Area = TABLE_AREA
    rgb: tuple[float, float, float] = (0.80, 0.74, 0.66)

    def corners(self) -> Array:
        """Return the corners of its top in the world, (4, 3), metres."""
        xs, ys = self.area
        return np.array([[x, y, self.height] for x in xs for y in ys])

    def within(self, x: NDArray[Any], y: NDArray[Any], margin: float = 0.0) -> Mask:
        """Tell which points of the world, metres, are over its top, `margin` metres from its edges at least; any shape."""
        (x0, x1), (y0, y1) = ((np.float32(low + margin), np.float32(high - margin)) for low, high in self.area)
        return np.asarray((x > x0) & (x < x1) & (y > y0) & (y < y1))


@frozen(eq=False)
class PointCloudFrame:
    """A frame with a point of the world for each pixel.

    Attributes:
        camera: Its name.
        rgb: Straightened, (height, width, 3) uint8.
        depth: Straightened and freed of single outliers, (height, width), metres; 0 where there is none.
        xyz: World coordinates, three images (3, height, width), metres.
        valid: Where depth is usable.
        matrix: Pinhole matrix, (3, 3).
        rotation: Camera axes in the world, (3, 3), the table plane taken into account.
        position: The camera's place in the world, (3,).
        noise: Standard deviation of heights on the table, metres.
        rgbd: The camera frame that it was made from.
    """

    camera: str
    rgb: NDArray[np.uint8]
    depth: Image
    xyz: Image
    valid: Mask
    matrix: Array
    rotation: Array
    position: Array
    noise: float
    rgbd: RgbdFrame

    @property
    def focal(self) -> float:
        """Focal length, pixels."""
        return float(self.matrix[0, 0])

    def rays(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Array:
        """Return the directions of pixels, of depth 1, in the world, (n, 3)."""
        matrix = self.matrix
        flat = np.column_stack(
            [(columns - matrix[0, 2]) / matrix[0, 0], (rows - matrix[1, 2]) / matrix[1, 1], np.ones(len(rows))]
        )
        return np.asarray(flat @ self.rotation.T)

    def project(self, points: Array) -> tuple[Array, Array]:
        """Return the pixels (n, 2) and depths (n,) of world points (n, 3)."""
        local = (points - self.position) @ self.rotation
        depth = local[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = local[:, :2] / depth[:, None] * [self.matrix[0, 0], self.matrix[1, 1]]
        return pixels + self.matrix[:2, 2], depth


def check_frame(rgbd: RgbdFrame, *, depth: bool = True) -> str | None:
    """Return why a sound frame shows nothing (too dark, over-exposed, without depth), or None.

    Args:
        rgbd: The frame.
        depth: Whether it has to have depth.

    Raises:
        SensorError: The frame's arrays do not fit one another or its intrinsics.
    """
    lens = rgbd.intrinsics
    size = (lens.height, lens.width)
    for name, array, shape, kind in (
        ("rgb", rgbd.rgb, (*size, 3), np.uint8),
        ("depth", rgbd.depth, size, np.float32),
    ):
        if array.shape != shape or array.dtype != kind:
            raise SensorError(
                f"camera {rgbd.camera!r}: {name} is {array.shape} {array.dtype}; its intrinsics ask for {shape} "
                f"{np.dtype(kind)}; fix the camera driver or its calibration"
            )
    if not all(np.isfinite([lens.fx, lens.fy, lens.cx, lens.cy, *lens.distortion])) or min(lens.fx, lens.fy) <= 0.0:
        raise SensorError(f"camera {rgbd.camera!r}: its intrinsics hold a focal length or number that is none: {lens}")
    channels = cv2.split(np.ascontiguousarray(rgbd.rgb[::8, ::8]))
    if np.mean(np.maximum.reduce(channels) <= _DARK) > 0.95:
        return f"{rgbd.camera}: too dark to see anything; give it light or a longer exposure"
    if np.mean(np.minimum.reduce(channels) >= _BRIGHT) > 0.8:
        return f"{rgbd.camera}: over-exposed; give it less light or a shorter exposure"
    some = rgbd.depth[::8, ::8]
    usable = np.isfinite(some) & (some > LEAST_DEPTH) & (some < MOST_DEPTH)
    if depth and np.mean(usable) < 0.05:
        return f"{rgbd.camera}: the depth picture is empty; something covers the camera, or it has failed"
    return None


def as_image(array: ArrayLike) -> Image:
    """Return what OpenCV made as the type that it is."""
    return np.asarray(array, dtype=np.float32)


def as_picture(array: ArrayLike) -> NDArray[np.uint8]:
    """Return what OpenCV made as the type that it is."""
    return np.asarray(array, dtype=np.uint8)


def straightened(rgbd: RgbdFrame) -> RgbdFrame:
    """Return the frame as a pinhole with the same matrix would deliver it."""
    lens = rgbd.intrinsics
    if not any(lens.distortion):
        return rgbd
    places, shares, nearest = _straightening(lens)
    # Four channels are straightened in little more than half of the time that three take.
    padded = cv2.cvtColor(rgbd.rgb, cv2.COLOR_RGB2RGBA)
    padded = cv2.remap(padded, places, shares, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    nothing: Any = None
    return replace(
        rgbd,
        rgb=as_picture(cv2.cvtColor(padded, cv2.COLOR_RGBA2RGB)),
        depth=as_image(cv2.remap(rgbd.depth, nearest, nothing, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)),
        intrinsics=replace(lens, distortion=(0.0, 0.0, 0.0, 0.0, 0.0)),
    )


def make_frame(rgbd: RgbdFrame, table: TablePrior, robot: Mask) -> PointCloudFrame:
    """Return the frame with its points in the world.

    Args:
        rgbd: Sound, as `check_frame` says.
        table: Where the table is known to be; what the camera sees of it corrects its calibrated tilt and height.
        robot: Where the robot is in the straightened picture.
    """
    lens = rgbd.intrinsics
    straight = straightened(rgbd)
    rgb, depth = straight.rgb, straight.depth
    finite = np.isfinite(depth)
    if not finite.all():
        depth = np.where(finite, depth, np.float32(0.0))
    depth = as_image(cv2.medianBlur(np.ascontiguousarray(depth), 3))
    valid: Mask = (depth > LEAST_DEPTH) & (depth < MOST_DEPTH)
    matrix = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
    pose = rgbd.pose_camera_in_world
    frame = PointCloudFrame(
        camera=rgbd.camera,
        rgb=rgb,
        depth=depth,
        xyz=np.empty((3, 0, 0), dtype=np.float32),
        valid=valid,
        matrix=matrix,
        rotation=pose.rotation,
        position=pose.position,
        noise=0.0,
        rgbd=rgbd,
    )
    rotation, position, noise = _on_the_table(frame, table, robot)
    return replace(
        frame,
        rotation=rotation,
        position=position,
        noise=noise,
        xyz=_world(depth, *_rays(lens), rotation, position),
    )


def plane_frame(rgbd: RgbdFrame, table: TablePrior) -> PointCloudFrame:
    """Return a straightened frame as if nothing but the plane of the table's top were seen, whatever depth it has.

    Args:
        rgbd: Straight, as `straightened` returns it.
        table: Where the plane is.
    """
    lens, pose = rgbd.intrinsics, rgbd.pose_camera_in_world
    x, y = _rays(lens)
    rotation, position = pose.rotation, pose.position
    slope = (rotation[2, 0] * x)[None, :] + (rotation[2, 1] * y + rotation[2, 2])[:, None]
    depth = as_image((table.height - position[2]) / np.where(slope == 0.0, -1e-9, slope))
    depth = np.where((depth > LEAST_DEPTH) & (depth < MOST_DEPTH), depth, np.float32(0.0))
    return PointCloudFrame(
        camera=rgbd.camera,
        rgb=rgbd.rgb,
        depth=depth,
        xyz=_world(depth, x, y, rotation, position),
        valid=depth > 0.0,
        matrix=np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]]),
        rotation=rotation,
        position=position,
        noise=0.0,
        rgbd=rgbd,
    )


def with_depth(frame: PointCloudFrame, depth: Image) -> PointCloudFrame:
    """Return the frame with other depths, (height, width), metres."""
    xyz = _world(depth, *_rays(frame.rgbd.intrinsics), frame.rotation, frame.position)
    return replace(frame, depth=depth, xyz=xyz, valid=depth > 0.0)


def _world(depth: Image, x: Image, y: Image, rotation: Array, position: Array) -> Image:
    """Return world coordinates (3, h, w) of depths (h, w) along the rays (x, y, 1), x (w,) and y (h,)."""
    turned = np.empty((3, *depth.shape), dtype=np.float32)
    turn, offset = rotation.astype(np.float32), position.astype(np.float32)
    for k in range(3):
        np.add((turn[k, 1] * y + turn[k, 2])[:, None], (turn[k, 0] * x)[None, :], out=turned[k])
        turned[k] *= depth
        turned[k] += offset[k]
    return turned


def _on_the_table(frame: PointCloudFrame, table: TablePrior, robot: Mask) -> tuple[Array, Array, float]:
    """Return the camera's rotation and position such that the table that it sees lies at its height, and the noise."""
    step = _PLANE_STRIDE
    depth = frame.depth[::step, ::step]
    x, y = _rays(frame.rgbd.intrinsics)
    xyz = _world(depth, x[::step], y[::step], frame.rotation, frame.position)
    near = frame.valid[::step, ::step] & ~robot[::step, ::step]
    near &= np.abs(xyz[2] - np.float32(table.height)) < _PLANE_BAND
    near &= table.within(xyz[0], xyz[1], 0.02)
    if np.count_nonzero(near) < _PLANE_LEAST:
        return frame.rotation, frame.position, _USUAL_NOISE
    points = xyz[:, near].astype(np.float64)
    off = points[2] - table.height
    middle = points[:2].mean(axis=1)
    design = np.column_stack([points[0] - middle[0], points[1] - middle[1], np.ones(len(off))])
    plane = np.array([0.0, 0.0, float(median(off))])
    noise = float(MAD * median(np.abs(off - plane[2])))
    prior = np.diag([_TILT_PRIOR**-2, _TILT_PRIOR**-2, _SHIFT_PRIOR**-2])
    for _ in range(_PLANE_TRIMS):
        rest = off - design @ plane
        keep = np.abs(rest) < max(2.5 * noise, _LEAST_TRIM)
        if np.count_nonzero(keep) < _PLANE_LEAST // 2:
            # The points near the table's height are no plane.
            return frame.rotation, frame.position, _USUAL_NOISE
        seen, weight = design[keep], 1.0 / (_CORRELATED * max(noise, _LEAST_TRIM) ** 2)
        plane = np.linalg.solve(weight * seen.T @ seen + prior, weight * seen.T @ off[keep])
        noise = float(MAD * median(np.abs(rest[keep])))
    if abs(plane[2]) > _MOST_SHIFT or max(abs(plane[0]), abs(plane[1])) > _MOST_TILT:
        return frame.rotation, frame.position, noise
    # The small rotation that takes the seen plane's normal (-a, -b, 1) to the vertical, about the middle of what is seen.
    turn, _ = cv2.Rodrigues(np.array([-plane[1], plane[0], 0.0]))
    turn = turn.T if (turn @ [-plane[0], -plane[1], 1.0])[2] < (turn.T @ [-plane[0], -plane[1], 1.0])[2] else turn
    pivot = np.array([middle[0], middle[1], table.height + plane[2]])
    position = turn @ (frame.position - pivot) + pivot - [0.0, 0.0, plane[2]]
    return turn @ frame.rotation, position, noise


@lru_cache(maxsize=8)
def _rays(lens: Intrinsics) -> tuple[Image, Image]:
    """Return the straightened pixels' directions at depth 1: x of each column (width,), y of each row (height,)."""
    columns, rows = np.arange(lens.width), np.arange(lens.height)
    return as_image((columns - lens.cx) / lens.fx), as_image((rows - lens.cy) / lens.fy)


@lru_cache(maxsize=8)
def _straightening(lens: Intrinsics) -> tuple[NDArray[np.int16], NDArray[np.uint16], NDArray[np.int16]]:
    """Return where in the raw picture each straightened pixel lies: whole pixels and what is left over; and the nearest."""
    matrix = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
    columns, rows = cv2.initUndistortRectifyMap(
        matrix, np.array(lens.distortion), None, matrix, (lens.width, lens.height), cv2.CV_32FC1
    )
    places, shares = cv2.convertMaps(columns, rows, cv2.CV_16SC2)
    nearest, _ = cv2.convertMaps(columns, rows, cv2.CV_16SC2, nninterpolation=True)
    return np.asarray(places, dtype=np.int16), np.asarray(shares, dtype=np.uint16), np.asarray(nearest, dtype=np.int16)
