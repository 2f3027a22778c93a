"""Choice of the pictures that a look needs: where a fixed camera still sees what it saw, earlier results stay true."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import cv2
import numpy as np

from robosandbox.driver import Driver
from robosandbox.perception.change_detection import (
    Reference,
    bent,
    changed,
    disparity_of,
    table_disparity,
)
from robosandbox.perception.frame import Mask, TablePrior
from robosandbox.perception.frames import FrameSet
from robosandbox.perception.robot_mask import RobotMask
from robosandbox.types import Array, PictureWindow, Posture, RgbdFrame

_AROUND = 8  # Pixels around a thing that are compared with it. Chosen: what moves by 10 mm moves so far.
_EDGES = 3  # Pixels around the robot in which edges have no depth. Chosen: the `edge_dropout` of `realsense` and one.
_HIDDEN = 0.1  # Share of a thing's place that the robot may hide and a camera still sees it. Chosen.


class Attention:
    """Remembers what fixed cameras saw, and tells whether they still see it.

    Args:
        table: What is watched.

    Attributes:
        table: Likewise.
        references: By camera.
    """

    def __init__(self, table: TablePrior) -> None:
        self.table = table
        self.references: dict[str, Reference] = {}

    def remember(self, frames: FrameSet, fixed: Iterable[str], found: Iterable[Array], left: Iterable[Array]) -> None:
        """Take a look that was perceived for what is known; where the robot hides the scene, what was known before stays.

        Args:
            frames: The look.
            fixed: The cameras that stand still.
            found: Points of the world (n, 3) around each thing that is known now.
            left: The same around each place that a thing has left.
        """
        found, left = tuple(found), tuple(left)
        for camera in fixed:
            segmented = frames.by_camera.get(camera)
            if segmented is None:
                self.references.pop(camera, None)
                continue
            frame = segmented.frame
            rgbd, hidden = frame.rgbd, _widened(segmented.robot, frame.rgbd)
            before = self.references.get(camera)
            known = ~hidden
            rgb, disparity = rgbd.rgb.copy(), disparity_of(rgbd.depth)
            if before is not None and _is_same_view(before.rgbd, rgbd):
                rgb[hidden], disparity[hidden] = before.rgb[hidden], before.disparity[hidden]
                known |= before.known
            else:
                disparity[hidden] = table_disparity(
                    rgbd.intrinsics, frame.rotation, frame.position, frames.table, hidden
                )
            reference = self.references[camera] = Reference(rgbd, rgb, disparity, known)
            # What a thing looks like behind the robot is not known, and that it is there is no news.
            reference.forget(hidden & _shown(rgbd, left))
            reference.forget(hidden & ~known & _shown(rgbd, found))

    def vacate(self, corners: Array) -> None:
        """Take it to be unknown what a place looks like, the hull of these points of the world (n, 3)."""
        for reference in self.references.values():
            reference.forget(_shown(reference.rgbd, [corners]))

    def is_unchanged(
        self,
        driver: Driver,
        places: Mapping[str, Array],
        robot: RobotMask,
        carried: Sequence[Array],
        *,
        everywhere: bool,
    ) -> bool:
        """Look with as few cameras as see these places; tell whether they look as before.

        Args:
            driver: Whose cameras.
            places: Points of the world (n, 3) around each thing that matters.
            robot: Where the robot is in a picture.
            carried: Points around what each hand holds.
            everywhere: Compare what one camera sees of the whole table, too.

        Returns:
            False, too, where no fixed camera sees them all.
        """
        views = self._views(driver, places, robot, carried, everywhere=everywhere)
        return bool(views) and all(
            self._is_as_before(driver, name, window, robot, carried) for name, window in views.items()
        )

    def _views(
        self,
        driver: Driver,
        places: Mapping[str, Array],
        robot: RobotMask,
        carried: Sequence[Array],
        *,
        everywhere: bool,
    ) -> dict[str, PictureWindow]:
        """Return the parts of pictures that tell whether anything has changed, by camera; none where no camera can tell."""
        if not self.references:
            return {}
        before = next(iter(self.references.values())).rgbd.arms
        robot.place(
            {name: Posture(q=arm.state().q, gripper_q=before[name].gripper_q) for name, arm in driver.arms.items()}
        )
        masks = {name: robot.masks(one.rgbd, carried)[0] for name, one in self.references.items()}
        seen = {name: _visible(one.rgbd, masks[name], places) for name, one in self.references.items()}
        order = sorted(seen, key=lambda name: (-len(seen[name]), float(masks[name].mean())))
        # What stands on the table hides some of it.
        tables = {name: _window(self.references[name].rgbd, [self.table.corners()]) for name in order}
        if not set(places) <= set().union(*seen.values()):
            # What the arm hides may have moved, and show beside the arm.
            return tables if everywhere else {}
        views, left = {order[0]: tables[order[0]]} if everywhere else {}, set(places)
        for name in order:
            here = left & seen[name]
            if here and name not in views:
                views[name] = _window(self.references[name].rgbd, [places[place] for place in here])
            left -= here
        return views

    def _is_as_before(
        self, driver: Driver, name: str, window: PictureWindow, robot: RobotMask, carried: Sequence[Array]
    ) -> bool:
        """Take a part of a picture; tell whether it shows what it showed before."""
        reference = self.references[name]
        rgbd = (
            driver.senses.capture(name, window)
            if driver.capabilities.cameras[name].windows
            else driver.senses.capture(name)
        )
        if not _is_same_view(reference.rgbd, rgbd):
            return False
        robot.place(rgbd.arms)
        hidden = _widened(robot.masks(rgbd, carried)[0], rgbd)
        if changed(reference, rgbd, hidden, window):
            return False
        reference.learn(rgbd, hidden, window)
        return True


def _shown(rgbd: RgbdFrame, places: Iterable[Array]) -> Mask:
    """Return where a picture shows these places, or what is close to them."""
    mask = np.zeros(rgbd.depth.shape, dtype=np.bool_)
    for corners in places:
        left, top, right, bottom = _box(rgbd, corners)
        mask[top:bottom, left:right] = True
    return mask


def _is_same_view(before: RgbdFrame, now: RgbdFrame) -> bool:
    same_lens = before.intrinsics == now.intrinsics and before.rgb.shape == now.rgb.shape
    return same_lens and before.pose_camera_in_world == now.pose_camera_in_world


def _widened(robot: Mask, rgbd: RgbdFrame) -> Mask:
    """Return where the robot may be in the picture as delivered: the lens moves pixels, and edges have no depth."""
    size = 2 * (bent(rgbd.intrinsics) + _EDGES) + 1
    return np.asarray(cv2.dilate(robot.view(np.uint8), np.ones((size, size), np.uint8))).view(np.bool_)


def _visible(rgbd: RgbdFrame, robot: Mask, places: Mapping[str, Array]) -> set[str]:
    """Return which places are in the picture, with nearly nothing of the robot before them."""
    height, width = robot.shape
    found = set()
    for name, corners in places.items():
        left, top, right, bottom = _box(rgbd, corners)
        whole = 0 < left < right < width and 0 < top < bottom < height
        if whole and float(robot[top:bottom, left:right].mean()) < _HIDDEN:
            found.add(name)
    return found


def _window(rgbd: RgbdFrame, places: Iterable[Array]) -> PictureWindow:
    """Return the part of the picture that shows all of these places."""
    low, high = np.array([_box(rgbd, corners) for corners in places]).reshape(-1, 2, 2).swapaxes(0, 1)
    (left, top), (right, bottom) = low.min(axis=0), high.max(axis=0)
    return PictureWindow(left=int(left), top=int(top), right=int(right), bottom=int(bottom))


def _box(rgbd: RgbdFrame, corners: Array) -> tuple[int, int, int, int]:
    """Return the part of the picture as delivered that shows a place, with room around it: left, top, right, bottom."""
    lens, pose = rgbd.intrinsics, rgbd.pose_camera_in_world
    local = (corners - pose.position) @ pose.rotation
    if local[:, 2].min() <= 0.0:
        return 0, 0, lens.width, lens.height
    pixels = local[:, :2] / local[:, 2:] * [lens.fx, lens.fy] + [lens.cx, lens.cy]
    room = _AROUND + bent(lens)
    low, high = np.floor(pixels.min(axis=0)) - room, np.ceil(pixels.max(axis=0)) + room + 1
    left, right = np.clip([low[0], high[0]], 0, lens.width).astype(int)
    top, bottom = np.clip([low[1], high[1]], 0, lens.height).astype(int)
    return int(left), int(top), int(right), int(bottom)
