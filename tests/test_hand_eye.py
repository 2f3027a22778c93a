"""Place of a camera on a hand, or beside an arm: from rendered pictures of the board, and from how the hand stood."""

from __future__ import annotations

import numpy as np
import pytest
from support.seen_board import BOARD, LENS, pose, seen

from robosandbox.errors import SensorError
from robosandbox.perception.hand_eye import HandViews
from robosandbox.types import Pose, matrix_from_rotation_vector

pytestmark = pytest.mark.gl


def around(count: int, tilt: float = 0.5) -> list[Pose]:
    """Return poses of optical frames that look at the board from all sides."""
    random, found = np.random.default_rng(2), []
    for _ in range(count):
        turn = matrix_from_rotation_vector(np.array([0.0, 0.0, random.uniform(-0.8, 0.8)]))
        lean = matrix_from_rotation_vector(np.append(random.uniform(-tilt, tilt, 2), 0.0))
        looks = turn @ lean @ np.diag([1.0, -1.0, -1.0])
        back = -looks[:, 2] * random.uniform(0.2, 0.35)
        found.append(Pose.from_matrix(back + np.append(random.uniform(-0.03, 0.03, 2), 0.0), looks))
    return found


ON_HAND = pose([0.3, -0.2, 1.4], [0.02, 0.05, -0.06])
LIES = pose([0.05, -0.1, 0.7], [0.25, -0.1, 0.04])


def test_a_camera_on_the_hand_is_found_wherever_the_board_lies() -> None:
    views = HandViews(BOARD)
    cameras = around(18)
    for camera, picture in zip(cameras, seen(cameras), strict=True):
        views.take(picture, LIES @ camera @ ON_HAND.inverse(), moves=False)
    found = views.measure(LENS)
    off = ON_HAND.inverse() @ found.pose
    assert np.linalg.norm(off.position) < 0.001 and np.linalg.norm(off.rotation - np.eye(3)) < 0.004
    assert found.views == len(views) >= 14 and found.error_px < 0.7 and found.apart_mm < 3.0


def test_a_camera_beside_the_arm_is_found_from_a_board_in_the_hand() -> None:
    stands, in_hand = pose([2.2, 0.1, -0.3], [0.6, 0.3, 0.5]), pose([0.1, 3.0, 0.2], [0.0, 0.02, 0.08])
    views = HandViews(BOARD, is_held=True)
    cameras = around(18)
    for camera, picture in zip(cameras, seen(cameras), strict=True):
        # The board is where the camera, which stands, sees it so.
        views.take(picture, stands @ camera.inverse() @ in_hand.inverse(), moves=False)
    off = stands.inverse() @ views.measure(LENS).pose
    assert np.linalg.norm(off.position) < 0.0015 and np.linalg.norm(off.rotation - np.eye(3)) < 0.005


def test_an_arm_whose_encoders_are_off_tells_it() -> None:
    views, random = HandViews(BOARD), np.random.default_rng(1)
    cameras = around(18)
    for camera, picture in zip(cameras, seen(cameras), strict=True):
        shaken = pose(random.normal(0.0, 0.05, 3).tolist(), random.normal(0.0, 0.02, 3).tolist())
        views.take(picture, LIES @ camera @ ON_HAND.inverse() @ shaken, moves=False)
    with pytest.raises(SensorError, match=r"two halves of the 1. views place the camera .* mm and .* degrees apart"):
        views.measure(LENS)


def test_views_that_tell_no_place_are_refused() -> None:
    views = HandViews(BOARD)
    cameras = around(12, tilt=0.0)
    for camera, picture in zip(cameras, seen(cameras), strict=True):
        views.take(picture, LIES @ camera @ ON_HAND.inverse(), moves=False)
    with pytest.raises(SensorError, match="the hand turned about one axis alone"):
        views.measure(LENS)
    with pytest.raises(SensorError, match="0 views show the board in different ways, and 10 are needed"):
        HandViews(BOARD).measure(LENS)


def test_a_picture_is_taken_once_and_when_nothing_moves() -> None:
    views = HandViews(BOARD)
    first, second = around(2)
    pictures = list(seen([first, first, first, second, second]))
    taken = [views.take(picture, pose([0, 0, 0], [0, 0, 0]), moves=True) for picture in pictures]
    assert taken == [False, True, False, False, True] and len(views) == 2
