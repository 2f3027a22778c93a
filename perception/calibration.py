"""Calibration of camera poses from tags at known places, kept in a file, applied to every frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray

from robosandbox.errors import InputError
from robosandbox.perception.frame import TablePrior, make_frame
from robosandbox.sim.calibration_board import CalibrationBoard
from robosandbox.types import Array, Intrinsics, Pose, RgbdFrame, StrictModel, matrix_from_rotation_vector
from robosandbox.validation import load_yaml_model
from robosandbox.values import frozen

# Root mean square distance of the tags' corners from where a pose puts them, pixels. They are found to 0.2 to 0.4;
# this is half a pixel both ways, as if they were told to whole ones: above it the lens, the board or its rest is not as told.
MOST_LEFT_PX = 0.5**0.5
_LEAST_TAGS = 3  # Number of tags that must be seen of the board, so that its pose is certain. Chosen.


class Calibration(StrictModel):
    """Content of the file that `robo-sandbox calibrate` writes.

    Attributes:
        cameras: By camera: its true frame in the one that it was taken to have.
    """

    cameras: dict[str, Pose]

    def apply(self, frame: RgbdFrame) -> RgbdFrame:
        """Return the frame with its camera where it really is."""
        correction = self.cameras.get(frame.camera)
        return (
            frame
            if correction is None
            else replace(frame, pose_camera_in_world=frame.pose_camera_in_world @ correction)
        )

    def save(self, path: Path) -> None:
        """Write the file.

        Raises:
            InputError: It cannot be written.
        """
        try:
            path.write_text(yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False), encoding="utf-8")
        except OSError as error:
            raise InputError(f"--output: {path}: {error.strerror}") from None

    @classmethod
    def load(cls, path: Path) -> Calibration:
        """Read a file.

        Raises:
            InputError: There is none, or it is no calibration.
        """
        return load_yaml_model(path, cls)


@frozen(kw_only=True)
class CameraPoseEstimate:
    """A camera's pose as the tags say.

    Attributes:
        camera: Its name.
        tags: How many it saw.
        pose: Of its optical frame in the world; None with too few tags.
        error_mm: Root mean square distance on the board of the tags' corners from where that pose puts them.
        error_px: The same in the picture; 0 where depth was measured.
        shift_mm: How far it is from where it was taken to be.
        turn_deg: How far it is turned from that.
        correction: For `Calibration`.
    """

    camera: str
    tags: int
    pose: Pose | None = None
    error_mm: float = 0.0
    error_px: float = 0.0
    shift_mm: float = 0.0
    turn_deg: float = 0.0
    correction: Pose | None = None


def find_tags(picture: NDArray[np.uint8], board: CalibrationBoard) -> tuple[list[Array], NDArray[np.int32]]:
    """Return the corners of each tag (4, 2), pixels, and the tags' numbers (n,); Olson's AprilTags of family 36h11.

    Args:
        picture: RGB, (height, width, 3).
        board: Whose tags.
    """
    parameters = cv2.aruco.DetectorParameters()
    # Corners where lines through a tag's edges meet: a third of the error that a search about each corner leaves.
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
    detector = cv2.aruco.ArucoDetector(board.grid.getDictionary(), parameters)
    corners, numbers, _ = detector.detectMarkers(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY))
    if numbers is None:
        return [], np.zeros(0, dtype=np.int32)
    # By this method the middle of the first pixel is at 0.5, and at 0 everywhere else.
    found: Any = [corner.reshape(4, 2) - 0.5 for corner in corners]
    # A tag that the picture's border cuts is taken for a smaller one, as far in as brightness is compared over the border.
    margin, (height, width) = parameters.adaptiveThreshWinSizeMax / 2.0, picture.shape[:2]
    inside = [bool((corner > margin).all() and (corner < [width - margin, height - margin]).all()) for corner in found]
    whole = [corner for corner, is_whole in zip(found, inside, strict=True) if is_whole]
    return whole, np.asarray(numbers, dtype=np.int32).reshape(-1)[inside]


def find_camera(rgbd: RgbdFrame, board: CalibrationBoard, table_height: float) -> CameraPoseEstimate:
    """Return where the camera of a frame is, from the table and the board that it sees; without depth from the board alone.

    A flat board alone tells tilt and distance badly. Those come from the depth of the table, height and two tilts; what is
    left, two shifts and a turn in the plane, from where rays through the tags' corners meet the board (Umeyama, 1991).
    """
    corners, numbers = find_tags(rgbd.rgb, board)
    if len(numbers) < _LEAST_TAGS:
        return CameraPoseEstimate(camera=rgbd.camera, tags=len(numbers))
    flat, pixels = board.grid.matchImagePoints([corner[None] for corner in corners], numbers[:, None])
    known = board.in_world(flat.reshape(-1, 3).astype(np.float64), table_height)
    lens, taken = rgbd.intrinsics, rgbd.pose_camera_in_world
    if not rgbd.depth.any():
        return _by_board(rgbd.camera, lens, taken, known, pixels.reshape(-1, 2).astype(np.float64), len(numbers))
    frame = make_frame(rgbd, TablePrior(table_height), np.zeros(rgbd.depth.shape, dtype=bool))
    straight = cv2.undistortPoints(pixels.reshape(-1, 1, 2), frame.matrix, np.array(lens.distortion)).reshape(-1, 2)
    rays = np.column_stack([straight, np.ones(len(straight))]) @ frame.rotation.T
    met = frame.position + rays * ((known[:, 2] - frame.position[2]) / rays[:, 2])[:, None]
    a, b = met[:, :2] - met[:, :2].mean(axis=0), known[:, :2] - known[:, :2].mean(axis=0)
    turn = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    c, s = np.cos(turn), np.sin(turn)
    about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    shift = np.append(known[:, :2].mean(axis=0) - about_z[:2, :2] @ met[:, :2].mean(axis=0), 0.0)
    left = known[:, :2] - (met @ about_z.T + shift)[:, :2]
    spread = float(np.sqrt((left**2).sum(axis=1).mean()))
    pose = Pose.from_matrix(about_z @ frame.position + shift, about_z @ frame.rotation)
    return _estimate(rgbd.camera, len(numbers), taken, pose, spread)


def find_webcam(
    camera: str,
    pictures: Sequence[NDArray[np.uint8]],
    lens: Intrinsics,
    taken: Pose,
    board: CalibrationBoard,
    table_height: float,
) -> CameraPoseEstimate:
    """Return where a camera without depth is, from several pictures of the board that lies still.

    Args:
        camera: Its name.
        pictures: RGB, each (height, width, 3).
        lens: Its intrinsics.
        taken: Where it is taken to be.
        board: That lies on the table.
        table_height: World z, metres.
    """
    known, pixels, seen = [np.zeros((0, 3))], [np.zeros((0, 2))], set[int]()
    for picture in pictures:
        corners, numbers = find_tags(picture, board)
        if len(numbers) >= _LEAST_TAGS:
            flat, found = board.grid.matchImagePoints([corner[None] for corner in corners], numbers[:, None])
            known.append(board.in_world(flat.reshape(-1, 3).astype(np.float64), table_height))
            pixels.append(found.reshape(-1, 2).astype(np.float64))
            seen.update(numbers.tolist())
    if not seen:
        tags = max((len(find_tags(picture, board)[1]) for picture in pictures), default=0)
        return CameraPoseEstimate(camera=camera, tags=tags)
    return _by_board(camera, lens, taken, np.concatenate(known), np.concatenate(pixels), len(seen))


def _by_board(camera: str, lens: Intrinsics, taken: Pose, known: Array, pixels: Array, tags: int) -> CameraPoseEstimate:
    """Return where the camera is from pixels (n, 2) of known places (n, 3) alone: the least error in the picture."""
    matrix, bend = (
        np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]]),
        np.array(lens.distortion),
    )
    good, turn, shift = cv2.solvePnP(known, pixels, matrix, bend)
    if not good:
        return CameraPoseEstimate(camera=camera, tags=tags)
    rotation = matrix_from_rotation_vector(np.asarray(turn, dtype=np.float64).reshape(3)).T
    pose = Pose.from_matrix(-rotation @ shift.reshape(3), rotation)
    seen, _ = cv2.projectPoints(known, turn, shift, matrix, bend)
    off = np.linalg.norm(seen.reshape(-1, 2) - pixels, axis=1)
    distance = np.linalg.norm(known - pose.position, axis=1)
    spread = float(np.sqrt(((off / lens.fx * distance) ** 2).mean()))
    return replace(_estimate(camera, tags, taken, pose, spread), error_px=float(np.sqrt((off**2).mean())))


def _estimate(camera: str, tags: int, taken: Pose, pose: Pose, spread: float) -> CameraPoseEstimate:
    correction = taken.inverse() @ pose
    cosine = (float(np.trace(correction.rotation)) - 1.0) / 2.0
    return CameraPoseEstimate(
        camera=camera,
        tags=tags,
        pose=pose,
        error_mm=1e3 * spread,
        shift_mm=1e3 * float(np.linalg.norm(correction.position)),
        turn_deg=float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))),
        correction=correction,
    )


def calibration_of(findings: Mapping[str, CameraPoseEstimate]) -> Calibration:
    """Return what the findings say of the cameras that saw enough."""
    return Calibration(cameras={name: item.correction for name, item in findings.items() if item.correction})
