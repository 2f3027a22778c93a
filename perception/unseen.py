"""Parts of the table that the robot has stood before at each look so far, and what another posture would show of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import cv2
import numpy as np

from robosandbox.perception.frame import Image, Mask, TablePrior
from robosandbox.perception.robot_mask import RobotMask
from robosandbox.perception.silhouette import CUT_OFF
from robosandbox.types import Array, Posture, RgbdFrame
from robosandbox.types.robot import RobotSpec

# Metres from one place of the table to the next that is asked about, and how many of them in a row may hide a thing: one of 3 cm.
_PITCH, _PATCH = 0.01, 3
_BESIDE = np.ones((2 * CUT_OFF + 1,) * 2, np.uint8)


class Unseen:
    """Places of the table within a robot's reach that no camera has shown yet because the robot stood before them.

    A place that no camera has in its picture is none of them: the robot could not uncover it.

    Args:
        table: The table.
        robot: Gives base and reach, metres.

    Attributes:
        half_hidden: Surface points, (n, 3) each, of what the last look showed too unclearly to act on, cut off by the robot.
    """

    def __init__(self, table: TablePrior, robot: RobotSpec) -> None:
        xs, ys = (np.arange(low + _PITCH / 2.0, high, _PITCH) for low, high in table.area)
        x, y = np.meshgrid(xs, ys, indexing="ij")
        self._points = np.stack([x, y, np.full_like(x, table.height)], axis=-1).reshape(-1, 3)
        nearest, farthest = robot.reach
        away = np.hypot(x - robot.base_position[0], y - robot.base_position[1])
        self._reached: Mask = (away >= nearest) & (away <= farthest)
        self._shown = np.zeros_like(self._reached)
        self._covered = np.zeros_like(self._reached)
        self.half_hidden: list[Array] = []

    def look(self, views: Iterable[tuple[RgbdFrame, Image]]) -> None:
        """Take a look.

        Args:
            views: Frames, each with the depths from which on the robot hides things, (height, width), as `RobotMask.masks` gives them.
        """
        for rgbd, near in views:
            shown, covered = _seen(self._points, rgbd, near)
            self._shown |= shown.reshape(self._shown.shape)
            self._covered |= covered.reshape(self._shown.shape)

    @property
    def places(self) -> Mask:
        """Where the robot has been in the way at each look, as a map of the table, with room for a thing at each place."""
        never = (self._covered & ~self._shown & self._reached).view(np.uint8)
        opened = cv2.morphologyEx(never, cv2.MORPH_OPEN, np.ones((_PATCH, _PATCH), np.uint8))
        return np.asarray(opened, dtype=np.bool_)

    @property
    def share(self) -> float:
        """Share of the table within reach that the robot has hidden at each look, with what it half hides now."""
        return (float(self.places.sum()) + float(self._areas.sum())) / max(float(self._reached.sum()), 1.0)

    def uncovered(self, views: Sequence[RgbdFrame], robot: RobotMask, arms: Mapping[str, Posture]) -> float:
        """Return the share of what is hidden, or half so, that cameras which stand still would show past robots standing so."""
        robot.place(arms)
        shown = np.zeros_like(self._shown)
        clear = np.zeros(len(self.half_hidden))
        for rgbd in views:
            # What stands close beside the robot in a picture is taken to be cut off by it.
            near = np.asarray(cv2.erode(robot.masks(rgbd)[1], _BESIDE), dtype=np.float32)
            shown |= _seen(self._points, rgbd, near)[0].reshape(shown.shape)
            clear += [_seen(each, rgbd, near)[0].mean() for each in self.half_hidden]
        places, areas = self.places, self._areas
        whole = float(places.sum()) + float(areas.sum())
        # Of what one camera shows half another one shows the rest.
        return (float((places & shown).sum()) + float(areas @ clear) / max(len(views), 1)) / max(whole, 1.0)

    @property
    def _areas(self) -> Array:
        """On how many places what is half hidden stands, (things,)."""
        return np.array([np.ptp(each[:, :2], axis=0).prod() / _PITCH**2 for each in self.half_hidden])


def _seen(points: Array, rgbd: RgbdFrame, near: Image) -> tuple[Mask, Mask]:
    """Return which points (n, 3) a picture shows, and before which of those in it the robot stands."""
    lens, pose = rgbd.intrinsics, rgbd.pose_camera_in_world
    local = (points - pose.position) @ pose.rotation
    depth = local[:, 2]
    before = depth > 0.0
    pixels = local[:, :2] / np.where(before, depth, 1.0)[:, None] * [lens.fx, lens.fy] + [lens.cx, lens.cy]
    within = before & ((pixels >= 0.0) & (pixels < [lens.width, lens.height])).all(axis=1)
    column, row = np.where(within[:, None], pixels, 0.0).astype(int).T
    covered = within & (near[row, column] < depth)
    return within & ~covered, covered
