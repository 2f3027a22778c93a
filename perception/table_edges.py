"""Camera poses corrected by the edges of the table, which lie where the table is known to be.

Points along each edge are looked for across it, and the pose moves to where all are met (Harris and Stennett, RAPID: a video
rate object tracker, 1990), held to where calibration has put it.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np

from robosandbox.perception.frame import LEAST_DEPTH, Mask, PointCloudFrame, TablePrior, plane_frame
from robosandbox.perception.quantiles import MAD, median
from robosandbox.perception.robot_mask import RobotMask
from robosandbox.perception.table_colour import painted
from robosandbox.types import Array, Pose, RgbdFrame, matrix_from_rotation_vector
from robosandbox.values import frozen

_SIGMAS = 3.0  # Standard deviations of the calibration within which the edges are looked for. Chosen.
# Number of times that the edges are looked for, each nearer to where they are expected, because the last one changes hundredths
# of a pixel; and of times that what stands on an edge is weighed.
_ROUNDS = 3
_SPACING = 0.01  # Metres along an edge between the points that are looked for. Chosen: some pixels apart in any view.
_PIXEL = 0.5  # Standard deviation of one point, pixels, at the least: a pixel is the table's or not.
_STEP = _PIXEL / 2.0  # Pixels between the places that are looked at across an edge.
_CLEAR = 2.0  # Pixels that must be the table before an edge, and must be none after it: noise makes single ones.
_LEAST_POINTS = 24  # Number of points that tell a pose. Chosen as four times its six unknowns.
# Share of an edge's length, or of a place's distance from the middle, between places whose pixels differ by a slope. Chosen.
_NEARBY = 1e-4
# Number of points that err alike, because light and lens change slowly along an edge. Chosen: 8 cm.
_CORRELATED = 8.0


@frozen(kw_only=True)
class PoseError:
    """Standard deviations of a camera's calibrated pose.

    Attributes:
        position: Of each coordinate, metres.
        rotation: About each axis, radians.
    """

    position: float
    rotation: float


@frozen(eq=False, kw_only=True)
class CorrectedPose:
    """A camera's pose as the table's edges have it.

    Attributes:
        pose: Of its optical frame in the world.
        covariance: Of a small turn about the world's axes, radians, and a shift, metres, (6, 6).
        points: How many points of the edges were found.
    """

    pose: Pose
    covariance: Array
    points: int

    def error_at(self, place: Array) -> Array:
        """Return the covariance (3, 3), square metres, that the camera's pose gives a place (3,) that it sees."""
        x, y, z = place - self.pose.position
        moved = np.hstack([np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]), np.eye(3)])
        return np.asarray(moved @ self.covariance @ moved.T)


def corrected_pose(
    rgbd: RgbdFrame, table: TablePrior, robot: RobotMask, error: PoseError, known: CorrectedPose | None = None
) -> CorrectedPose:
    """Return the pose of a straightened frame's camera such that the table's edges lie where they are seen.

    Args:
        rgbd: Straight; its depth is not used.
        table: Where its top is, how large it is.
        robot: Placed as it stood.
        error: Of the calibrated pose, to which the result is held.
        known: What an earlier frame of the same camera said, if it has not been moved on purpose: it stays where it still
            explains the edges, and where the robot hides them.

    Returns:
        The calibrated pose with `error`, and no points, where the edges are not seen or are seen nowhere near.
    """
    if known is not None and known.points and _explains(known, rgbd, table, robot):
        return known
    before = rgbd.pose_camera_in_world
    prior = np.diag([error.rotation**-2] * 3 + [error.position**-2] * 3)
    uncorrected = CorrectedPose(pose=before, covariance=np.linalg.inv(prior), points=0)
    turn, shift, spread, found, sigma = np.zeros(3), np.zeros(3), uncorrected.covariance, 0, 0.0
    for _ in range(_ROUNDS):
        pose = _moved(before, turn, shift)
        frame = plane_frame(replace(rgbd, pose_camera_in_world=pose), table)
        places, across, reach = _edge_points(frame, table, pose, spread)
        off, _ = _offsets(frame, table, robot.masks(frame.rgbd)[0], places, across, reach)
        seen = np.isfinite(off)
        found = int(seen.sum())
        if found < _LEAST_POINTS:
            return uncorrected
        slopes = np.einsum("nij,ni->nj", _slopes(frame, pose, places[seen]), across[seen])
        sigma = max(_PIXEL, MAD * float(median(np.abs(off[seen] - median(off[seen])))))
        step, normal = np.zeros(6), prior
        moved = np.concatenate([turn, shift])
        for _ in range(_ROUNDS):
            rest = np.abs(off[seen] - slopes @ step)
            # Huber's weights: what stands on an edge hides it.
            weight = np.minimum(1.0, sigma / np.maximum(rest, 1e-9)) / (_CORRELATED * sigma**2)
            normal = (slopes * weight[:, None]).T @ slopes + prior
            step = np.linalg.solve(normal, slopes.T @ (weight * off[seen]) - prior @ moved)
        turn, shift, spread = turn + step[:3], shift + step[3:], np.asarray(np.linalg.inv(normal))
    if sigma > _CLEAR:
        # Something else than the table's edges was found.
        return uncorrected
    return CorrectedPose(pose=_moved(before, turn, shift), covariance=spread, points=found)


def _explains(known: CorrectedPose, rgbd: RgbdFrame, table: TablePrior, robot: RobotMask) -> bool:
    """Tell whether the edges that a frame shows are where a pose has them; hidden ones say nothing."""
    frame = plane_frame(replace(rgbd, pose_camera_in_world=known.pose), table)
    places, across, reach = _edge_points(frame, table, known.pose, known.covariance)
    off, usable = _offsets(frame, table, robot.masks(frame.rgbd)[0], places, across, reach)
    if np.count_nonzero(usable) < _LEAST_POINTS:
        return True
    # NaN where an edge should be seen, and is not.
    return bool(np.mean(np.abs(off[usable]) < _CLEAR) > 0.5)


def _moved(pose: Pose, turn: Array, shift: Array) -> Pose:
    return Pose.from_matrix(pose.position + shift, matrix_from_rotation_vector(turn) @ pose.rotation)


def _slopes(frame: PointCloudFrame, pose: Pose, places: Array) -> Array:
    """Return how pixels of places (n, 3) change with a turn about the world's axes and a shift of the camera, (n, 2, 6)."""
    local = (places - pose.position) @ pose.rotation
    x, y, z = local.T
    fx, fy = frame.matrix[0, 0], frame.matrix[1, 1]
    none = np.zeros(len(x))
    by_local = np.stack([np.stack([fx / z, none, -fx * x / z**2], -1), np.stack([none, fy / z, -fy * y / z**2], -1)], 1)
    a, b, c = (places - pose.position).T
    # The camera turns by w: what it sees turns by -w, and -w x r = r x w.
    turned = np.stack([np.stack([none, -c, b], -1), np.stack([c, none, -a], -1), np.stack([-b, a, none], -1)], 1)
    moved = np.concatenate([turned, np.broadcast_to(-np.eye(3), turned.shape)], axis=2)
    return np.asarray(by_local @ pose.rotation.T @ moved)


def _edge_points(frame: PointCloudFrame, table: TablePrior, pose: Pose, spread: Array) -> tuple[Array, Array, Array]:
    """Return points of the edges (n, 3), outward directions across them in the picture (n, 2), and how far to look, pixels (n,)."""
    a, b, c, d = table.corners()
    ring = np.array([a, b, d, c, a])
    every, outward = [], []
    for start, end in pairwise(ring):
        count = max(2, int(np.linalg.norm(end - start) / _SPACING))
        shares = ((np.arange(count) + 0.5) / count)[:, None]
        places = start + shares * (end - start)
        local = (places - pose.position) @ pose.rotation
        seen = local[:, 2] > LEAST_DEPTH
        ahead = _project(frame, places + _NEARBY * (end - start)) - _project(frame, places - _NEARBY * (end - start))
        across = (
            np.column_stack([ahead[:, 1], -ahead[:, 0]]) / np.maximum(np.linalg.norm(ahead, axis=1), 1e-12)[:, None]
        )
        inwards = _project(frame, places * [1.0 - _NEARBY, 1.0 - _NEARBY, 1.0]) - _project(frame, places)
        across *= np.where((across * inwards).sum(axis=1) > 0.0, -1.0, 1.0)[:, None]
        every.append(places[seen])
        outward.append(across[seen])
    places, across = np.concatenate(every), np.concatenate(outward)
    slopes = np.einsum("nij,ni->nj", _slopes(frame, pose, places), across)
    return places, across, _SIGMAS * np.sqrt(np.einsum("ni,ij,nj->n", slopes, spread, slopes)) + 2.0 * _CLEAR


def _project(frame: PointCloudFrame, places: Array) -> Array:
    return frame.project(places)[0]


def _offsets(
    frame: PointCloudFrame, table: TablePrior, robot: Mask, places: Array, across: Array, reach: Array
) -> tuple[Array, Mask]:
    """Return how far outside of where it is expected each point of an edge is seen, (n,), pixels, and which may be seen.

    The first is NaN where no edge is found; the second is False out of the picture and near the robot.
    """
    height, width = frame.depth.shape
    # Surely the table, wherever the camera is; nothing of the robot, wherever it is.
    farthest = float(reach.max(initial=0.0))
    room = np.ones((2 * int(np.ceil(farthest)) + 1,) * 2, np.uint8)
    inside = frame.valid & table.within(frame.xyz[0], frame.xyz[1])
    bordered = cv2.copyMakeBorder(inside.view(np.uint8), 1, 1, 1, 1, cv2.BORDER_REPLICATE)
    sure = cv2.erode(bordered, room)[1:-1, 1:-1].view(np.bool_)
    near_robot = cv2.dilate(robot.view(np.uint8), room).view(np.bool_)
    bare = sure & ~near_robot
    if not bare.any():
        return np.full(len(places), np.nan), np.zeros(len(places), dtype=bool)
    # The colours of things would bend the one that is fitted to the table between them.
    unlike = np.abs(frame.rgb - median(frame.rgb[bare].astype(np.float64))).sum(axis=2)
    bare &= unlike < _SIGMAS * MAD * median(unlike[bare])
    other = painted(frame, bare, np.s_[0:height, 0:width])
    pixels = frame.project(places)[0]
    steps = np.arange(-farthest, farthest + _STEP, _STEP)
    spots = pixels[:, None] + steps[None, :, None] * across[:, None]
    columns, rows = np.rint(np.nan_to_num(spots, nan=-1.0)).astype(int).transpose(2, 0, 1)
    asked = np.abs(steps)[None] <= reach[:, None]
    out = (columns < 0) | (columns >= width) | (rows < 0) | (rows >= height)
    rows, columns = np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)
    usable = ~((out | near_robot[rows, columns]) & asked).any(axis=1)
    off = other[rows, columns] & asked
    on = ~other[rows, columns] & asked
    clear = int(_CLEAR / _STEP)
    ends = np.full(len(places), np.nan)
    for index in np.flatnonzero(usable):
        after = np.convolve(off[index], np.ones(clear), mode="valid") == clear
        before = np.convolve(on[index], np.ones(clear), mode="valid") == clear
        # The table ends where it is followed by something else all along.
        edge = np.flatnonzero(before[:-clear] & after[clear:])
        if len(edge):
            ends[index] = steps[edge[0] + clear] - _STEP / 2.0
    return ends, usable
