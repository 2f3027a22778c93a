"""Place of a camera on a hand, or beside an arm, from pictures of a board of tags and from how the hand stood in each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.errors import SensorError
from robosandbox.perception.lens_calibration import BoardView, BoardViews
from robosandbox.sim.calibration_board import CalibrationBoard
from robosandbox.types import Array, Intrinsics, Pose, matrix_from_rotation_vector
from robosandbox.values import frozen

# Views that it is measured from at least and at most: three tell all turns and shifts, and each half of the least has twice as many.
_LEAST_VIEWS, MOST_VIEWS = 10, 15
# How far two halves of the views may place the camera from each other, metres, and turn it, rad: perception is measured with cameras
# whose calibration is as far off.
_MOST_APART, _MOST_TURNED = 0.005, math.radians(1.0)
# A fit to views of one turn alone tells no shift along its axis: about two axes, at least this far apart, rad, the hand has to turn.
_LEAST_TURN = math.radians(10.0)


@frozen(kw_only=True)
class HandEyeEstimate:
    """A camera's place as views of the board tell it.

    Attributes:
        pose: Of its optical frame (z forward, y down): in the hand's TCP frame where it rides on it, else in the world.
        views: How many it follows from.
        error_px: Root mean square distance of the tags' corners from where it puts them, pixels: noise, and how far the arm's encoders
            are off.
        apart_mm: How far the places that two halves of the views tell are from each other.
        apart_deg: How far they are turned from each other.
    """

    pose: Pose
    views: int
    error_px: float
    apart_mm: float
    apart_deg: float


class HandViews:
    """Views of the board, as they come, each with how the hand stood.

    Args:
        board: That lies still somewhere, or is held.
        is_held: Whether the hand holds the board, and the camera stands; else the camera rides on the hand.
    """

    def __init__(self, board: CalibrationBoard, *, is_held: bool = False) -> None:
        # A picture from as near as a hand is shows few tags.
        self._views = BoardViews(board, least_tags=2)
        self._hands: list[Pose] = []
        self._is_held = is_held

    def __len__(self) -> int:
        return len(self._hands)

    def take(self, picture: NDArray[np.uint8], hand: Pose, *, moves: bool) -> bool:
        """Take a picture, RGB, (height, width, 3), and the TCP's pose in the world in it, where it is another view; return whether it was.

        Args:
            picture: The next.
            hand: Where the hand was in it.
            moves: Whether it may be in motion: it is taken where the last picture shows the board in the same place.
        """
        if not self._views.take(picture, moves=moves):
            return False
        self._hands.append(hand)
        return True

    def measure(self, lens: Intrinsics) -> HandEyeEstimate:
        """Return the camera's place with which the corners are least off.

        Raises:
            SensorError: The views do not tell it; it says why.
        """
        views, count = self._views.views, len(self)
        if count < _LEAST_VIEWS:
            raise SensorError(
                f"{count} views show the board in different ways, and {_LEAST_VIEWS} are needed: lead the hand to another place and "
                "another turn each time, and hold it still there for a moment"
            )
        if self._turned() < _LEAST_TURN:
            raise SensorError("the hand turned about one axis alone: tilt it to all sides, and turn it")
        ways = [hand if self._is_held else hand.inverse() for hand in self._hands]
        error, pose = _fitted(views, ways, lens)
        halves = [_fitted(views[half::2], ways[half::2], lens)[1] for half in (0, 1)]
        between = halves[0].inverse() @ halves[1]
        apart, turned = float(np.linalg.norm(between.position)), _angle(between.rotation)
        if apart > _MOST_APART or turned > _MOST_TURNED:
            raise SensorError(
                f"two halves of the {count} views place the camera {1e3 * apart:.0f} mm and {math.degrees(turned):.1f} degrees apart, and "
                f"{1e3 * _MOST_APART:.0f} mm and {math.degrees(_MOST_TURNED):.0f} degree are allowed: look whether the camera, the board "
                "and the lens sit tight, and tilt the hand more"
            )
        return HandEyeEstimate(
            pose=pose, views=count, error_px=error, apart_mm=1e3 * apart, apart_deg=math.degrees(turned)
        )

    def _turned(self) -> float:
        """Return by how much the hand turned about the second of its axes, rad: the root mean square over the views."""
        first = self._hands[0].rotation
        turns = np.array([cv2.Rodrigues(first.T @ hand.rotation)[0].reshape(3) for hand in self._hands])
        return float(np.linalg.svd(turns, compute_uv=False)[1] / math.sqrt(len(turns)))


def _fitted(views: Sequence[BoardView], ways: Sequence[Pose], lens: Intrinsics) -> tuple[float, Pose]:
    """Return the root mean square error, pixels, of the place X of a camera with the least one, and X.

    The board is seen at X^-1 way B, B being where it lies, or in the hand: first X and B by how the views differ (Park and Martin, 1994),
    then both together with the least error in the pictures.
    """
    from scipy.optimize import least_squares

    matrix = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
    bend = np.array(lens.distortion)
    seen = []
    for view in views:
        _, turn, shift = cv2.solvePnP(view.board, view.pixels, matrix, bend, flags=cv2.SOLVEPNP_IPPE)
        seen.append(Pose.from_matrix(np.asarray(shift, dtype=np.float64).reshape(3), _rotation(turn)))
    back = [way.inverse() for way in ways]
    camera = _by_differences(back, seen)
    board = back[0] @ camera @ seen[0]

    def off(numbers: Array) -> Array:
        eye, lies = _pose(numbers[:6]).inverse(), _pose(numbers[6:])
        left = []
        for view, way in zip(views, ways, strict=True):
            there = eye @ way @ lies
            put, _ = cv2.projectPoints(view.board, cv2.Rodrigues(there.rotation)[0], there.position, matrix, bend)
            left.append((put.reshape(-1, 2) - view.pixels).ravel())
        return np.concatenate(left)

    # A tag that is read wrongly, or a hand that was not still, counts little.
    best = least_squares(off, np.concatenate([_numbers(camera), _numbers(board)]), loss="soft_l1", x_scale="jac")
    return float(np.sqrt(2.0 * np.mean(off(best.x) ** 2))), _pose(best.x[:6])


def _by_differences(hands: Sequence[Pose], boards: Sequence[Pose]) -> Pose:
    """Return X from how hands and boards seen go from one view to another: hand X board is the same in all (Park and Martin, 1994)."""
    pairs = [
        (hands[j].inverse() @ hands[i], boards[j] @ boards[i].inverse())
        for i in range(len(hands))
        for j in range(i + 1, len(hands))
    ]
    turns = [(cv2.Rodrigues(a.rotation)[0].reshape(3), cv2.Rodrigues(b.rotation)[0].reshape(3)) for a, b in pairs]
    u, _, vt = np.linalg.svd(sum(np.outer(a, b) for a, b in turns))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    rows = np.concatenate([a.rotation - np.eye(3) for a, _ in pairs])
    wanted = np.concatenate([rotation @ b.position - a.position for a, b in pairs])
    shift: Array = np.linalg.lstsq(rows, wanted, rcond=None)[0].astype(np.float64)
    return Pose.from_matrix(shift, rotation)


def _rotation(turn: Any) -> Array:
    return np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)


def _numbers(pose: Pose) -> Array:
    return np.asarray(np.concatenate([cv2.Rodrigues(pose.rotation)[0].reshape(3), pose.position]), dtype=np.float64)


def _pose(numbers: Array) -> Pose:
    return Pose.from_matrix(numbers[3:], matrix_from_rotation_vector(numbers[:3]))


def _angle(rotation: Array) -> float:
    return float(np.arccos(np.clip((np.trace(rotation) - 1.0) / 2.0, -1.0, 1.0)))
