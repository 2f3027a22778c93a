"""A camera's pinhole and lens, measured from pictures of a flat board of tags that somebody holds before it in different ways."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.errors import SensorError
from robosandbox.perception.calibration import MOST_LEFT_PX, find_tags
from robosandbox.sim.calibration_board import CalibrationBoard
from robosandbox.types import Array, Intrinsics
from robosandbox.values import frozen

# Tags that a picture must show: half of the board, so that it tells the board's tilt.
_LEAST_TAGS = 6
# Pictures that are measured from at least and at most: each half of the least tells its own focal length, centre and distortion.
_LEAST_VIEWS, MOST_VIEWS = 8, 20
# How far a tag's corners must have gone since every earlier picture, share of the picture's width, for another view of it.
_OTHERWISE = 0.05
# How far the board may go between two pictures, pixels, and be still: a corner is found to half of one.
_STILL_PX = 1.0
# How far two halves of the pictures may place a thing a metre away from each other, metres: perception without depth is measured
# with cameras whose calibration is as far off.
_MOST_APART = 0.005


@frozen(kw_only=True)
class LensEstimate:
    """A lens as pictures of the board tell it.

    Attributes:
        lens: Its intrinsics.
        views: How many pictures it follows from.
        error_px: Root mean square distance of the tags' corners from where it puts them, pixels.
        apart_px: How far at most the lenses that two halves of the pictures tell are from each other, anywhere in the picture.
    """

    lens: Intrinsics
    views: int
    error_px: float
    apart_px: float


@frozen
class BoardView:
    """The board in a picture: corners on it, (n, 3), metres, and in the picture, (n, 2), pixels, with each tag's number, (n,)."""

    board: NDArray[np.float32]
    pixels: NDArray[np.float32]
    numbers: NDArray[np.int32]


class BoardViews:
    """Pictures of the board that differ, as they come.

    Args:
        board: That is held before the camera, or before which the camera is led.
        least_tags: How many of its tags a picture must show.

    Attributes:
        views: Those that were taken.
    """

    def __init__(self, board: CalibrationBoard, least_tags: int = _LEAST_TAGS) -> None:
        self._board, self._least = board, least_tags
        self.views: list[BoardView] = []
        self._last: BoardView | None = None
        self._size = (0, 0)

    def __len__(self) -> int:
        return len(self.views)

    def take(self, picture: NDArray[np.uint8], *, moves: bool) -> bool:
        """Take a picture, RGB, (height, width, 3), where it shows the board as no earlier one does; return whether it was taken.

        Args:
            picture: The next.
            moves: Whether the board may be in motion, which blurs it: it is taken where the last one shows it in the same place.
        """
        corners, numbers = find_tags(picture, self._board)
        if len(numbers) < self._least:
            self._last = None
            return False
        flat, pixels = self._board.grid.matchImagePoints([corner[None] for corner in corners], numbers[:, None])
        view = BoardView(
            np.asarray(flat, dtype=np.float32).reshape(-1, 3),
            np.asarray(pixels, dtype=np.float32).reshape(-1, 2),
            np.repeat(numbers, 4),
        )
        still = not moves or (self._last is not None and _gone(view, self._last) < _STILL_PX)
        self._last = view
        if not still or any(_gone(view, other) < _OTHERWISE * picture.shape[1] for other in self.views):
            return False
        self._size = (picture.shape[1], picture.shape[0])
        self.views.append(view)
        return True


class LensViews(BoardViews):
    """Pictures of the board from which a lens is measured."""

    def measure(self) -> LensEstimate:
        """Return the lens with which the corners are least off.

        Raises:
            SensorError: The pictures do not tell it; it says why.
        """
        if len(self.views) < _LEAST_VIEWS:
            raise SensorError(
                f"{len(self.views)} pictures show the board in different ways, and {_LEAST_VIEWS} are needed, with {_LEAST_TAGS} or "
                "more of its tags each: hold it still for a moment, then otherwise: near, far, tilted to each side, in each corner"
            )
        error, lens = _fitted(self.views, self._size)
        apart = _apart(*(_fitted(self.views[half::2], self._size)[1] for half in (0, 1)))
        if error > MOST_LEFT_PX:
            raise SensorError(
                f"the lens that fits best leaves the tags' corners {error:.1f} pixels off, and {MOST_LEFT_PX:.1f} are allowed: look "
                "whether the board is glued to something flat, autofocus is off, and the lens is no fisheye"
            )
        if apart > _MOST_APART * lens.fx:
            raise SensorError(
                f"two halves of the {len(self.views)} pictures tell lenses that are {apart:.0f} pixels apart, and "
                f"{_MOST_APART * lens.fx:.0f} are allowed: tilt the board more, and bring it into each corner of the picture"
            )
        return LensEstimate(lens=lens, views=len(self.views), error_px=error, apart_px=apart)


def _gone(one: BoardView, other: BoardView) -> float:
    """Return how far the corners that both show are apart at most, pixels; nothing is known to be near where they share none."""
    shared = np.intersect1d(one.numbers, other.numbers)
    if not len(shared):
        return float("inf")
    # Each tag has its corners in one order.
    here, there = (np.concatenate([view.pixels[view.numbers == number] for number in shared]) for view in (one, other))
    return float(np.linalg.norm(here - there, axis=1).max())


def _fitted(views: Sequence[BoardView], size: tuple[int, int]) -> tuple[float, Intrinsics]:
    """Return the root mean square error, pixels, of the lens with the least one, and the lens (Zhang, 2000)."""
    width, height = size
    # The third radial term tells noise from no more pictures than these.
    error, matrix, bend, _, _ = cv2.calibrateCamera(
        [view.board for view in views],
        [view.pixels for view in views],
        size,
        np.eye(3),
        np.zeros(5),
        flags=cv2.CALIB_FIX_K3,
    )
    k1, k2, p1, p2, k3 = np.asarray(bend, dtype=np.float64).reshape(-1)[:5].tolist()
    fx, fy, cx, cy = (float(matrix[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
    return error, Intrinsics(width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy, distortion=(k1, k2, p1, p2, k3))


def _apart(one: Intrinsics, other: Intrinsics) -> float:
    """Return how far two lenses put the same ray apart at most, pixels, over a grid of the picture."""
    columns, rows = np.meshgrid(np.linspace(0, one.width - 1, 9), np.linspace(0, one.height - 1, 7))
    pixels = np.stack([columns.ravel(), rows.ravel()], axis=-1)
    rays = cv2.undistortPoints(pixels[:, None], _matrix(one), np.array(one.distortion)).reshape(-1, 2)
    ahead = np.column_stack([rays, np.ones(len(rays))])
    seen, _ = cv2.projectPoints(ahead, np.zeros(3), np.zeros(3), _matrix(other), np.array(other.distortion))
    return float(np.linalg.norm(seen.reshape(-1, 2) - pixels, axis=1).max())


def _matrix(lens: Intrinsics) -> Array:
    return np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
