"""Perception from colour alone: one or two cameras without depth, whose poses are known with an error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from robosandbox.driver import CameraSpec, Driver
from robosandbox.perception.factory import Setup
from robosandbox.perception.frame import TablePrior, check_frame, plane_frame, straightened
from robosandbox.perception.frames import FrameSet, SegmentedFrame
from robosandbox.perception.outlines import outlined
from robosandbox.perception.recognize_outlines import recognize_outlines
from robosandbox.perception.rgbd import RgbdPerception
from robosandbox.perception.size_prior import SizePrior
from robosandbox.perception.table_edges import CorrectedPose, PoseError, corrected_pose
from robosandbox.perception.thing import Thing
from robosandbox.types import Pose, RgbdFrame


class RgbPerception(RgbdPerception):
    """Finds objects in pictures without depth.

    It knows what `RgbdPerception` knows, and how large the things are that the task describes. Depth, where a camera measures
    some, is not used.

    Args:
        setup: What is known before the first look.
        cameras: Which to look through; all that stand still when left out, because the table's edges tell best where those are.
        calibration: A file that `robo-sandbox calibrate` wrote.
        position_error: Standard deviation of each coordinate of a camera's calibrated position, metres.
        rotation_error: The same of its rotation about each axis, radians.

    Attributes:
        poses: The last look's cameras, as the table's edges have them.
    """

    def __init__(
        self,
        *,
        setup: Setup = Setup(),  # noqa: B008  frozen
        cameras: tuple[str, ...] | None = None,
        calibration: Path | None = None,
        position_error: float = 0.005,
        rotation_error: float = float(np.radians(1.0)),
    ) -> None:
        super().__init__(setup=setup, cameras=cameras, calibration=calibration)
        self._error = PoseError(position=position_error, rotation=rotation_error)
        self._known: dict[str, tuple[Pose, CorrectedPose]] = {}
        self.poses: dict[str, CorrectedPose] = {}

    def look(self, captures: list[RgbdFrame]) -> list[Thing]:
        """Return what these frames show, by themselves.

        Args:
            captures: One of each camera.

        Raises:
            SensorError: A frame's arrays do not fit one another or its intrinsics.
        """
        seen = self._frames(captures)
        priors = [
            *SizePrior.of_declared(self._setup.declared),
            *SizePrior.of_known(self._tracker.solids(self._held)),
        ]
        self.things, self.frames = recognize_outlines(seen, self.poses, priors)
        return self.things

    def _usual_cameras(self, specs: Mapping[str, CameraSpec]) -> tuple[str, ...]:
        """Return the cameras that stand still; where none does, all."""
        return tuple(name for name, spec in specs.items() if spec.arm is None) or tuple(specs)

    def _stands(self, driver: Driver, names: Sequence[str] | None) -> bool:
        """Tell that all is to be looked at: without depth a picture alone does not tell that nothing has changed."""
        del driver, names
        return False

    def _frames(self, captures: list[RgbdFrame]) -> FrameSet:
        table = TablePrior(self._setup.scene.table_height)
        robot, carried = self._robot(), self._carried
        by_camera: dict[str, SegmentedFrame] = {}
        notes, views = [], []
        for rgbd in captures:
            problem = check_frame(rgbd, depth=False)
            if problem is not None:
                notes.append(problem)
                continue
            calibrated = rgbd if self._calibration is None else self._calibration.apply(rgbd)
            straight = straightened(calibrated)
            robot.place(rgbd.arms)
            # A camera that is told to be where it was has not been moved, unless what it shows says so.
            given, known = self._known.get(rgbd.camera, (None, None))
            known = known if given == straight.pose_camera_in_world else None
            found = self.poses[rgbd.camera] = corrected_pose(straight, table, robot, self._error, known)
            self._known[rgbd.camera] = straight.pose_camera_in_world, found
            if not found.points:
                notes.append(
                    f"{rgbd.camera}: the table's edges are not seen where its calibration has them, so that places are known "
                    "no better than that; let it see two edges, or calibrate it again"
                )
            straight = replace(straight, pose_camera_in_world=found.pose)
            frame = plane_frame(straight, table)
            mask, near = robot.masks(straight, carried)
            by_camera[rgbd.camera] = outlined(frame, table, mask, near)
            views.append((straight, near))
        self.notes = tuple(notes)
        self._take(views)
        # Beside a camera whose place is known one that is centimetres off would move things, and add nothing.
        placed = {camera: one for camera, one in by_camera.items() if self.poses[camera].points}
        return FrameSet(placed or by_camera, table)
