"""`calibrate`: where the cameras really are, from a board of AprilTags on the table."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
import yaml

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, print_json
from robosandbox.apps.commands.options import Json, RobotName, SensorName
from robosandbox.errors import InputError
from robosandbox.progress import doing
from robosandbox.validation import load_yaml_model

if TYPE_CHECKING:
    from robosandbox.perception.calibration import CameraPoseEstimate
    from robosandbox.sim.calibration_board import CalibrationBoard


def calibrate(
    robot: RobotName = None,
    sensor: SensorName = "realsense",
    at: Annotated[
        tuple[float, float], typer.Option("--at", help="Where the board's middle lies, world x and y, metres.")
    ] = (0.2, -0.22),
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write the calibration here, for `look` and `run`.")
    ] = None,
    webcams: Annotated[
        Path | None,
        typer.Option(
            "--webcams", help="Look through these webcams, as the file says, and write it anew with their poses."
        ),
    ] = None,
    print_to: Annotated[
        Path | None, typer.Option("--print", help="Write the board's picture (PNG), to be printed 46 cm wide, and end.")
    ] = None,
    json: Json = False,
) -> int:
    """Find each camera's pose from a board of tags, and how far it is off."""
    from robosandbox.perception.calibration import calibration_of, find_camera
    from robosandbox.sim.calibration_board import CalibrationBoard
    from robosandbox.sim.opening import open_with_board
    from robosandbox.types import Scene

    if not all(abs(value) <= 0.5 for value in at):
        raise InputError(f"--at: {at[0]:g} {at[1]:g} is off the table, which spans -0.5..0.5 m")
    board = CalibrationBoard(centre=at)
    if print_to is not None:
        return _print_board(board, print_to)
    scene = Scene(robot_urdf=Path(robot) if robot else None)
    if webcams is not None:
        return _calibrate_webcams(webcams, board, scene.table_height, output or webcams, json=json)
    with doing("looking for the board"), closing(open_with_board(scene, board, sensor)) as sim:
        found = {name: find_camera(sim.capture(name), board, scene.table_height) for name in sim.cameras}
    if output is not None:
        calibration_of(found).save(output)
    if json:
        _tell_as_json(found)
    else:
        _tell(found)
    return EXIT_DONE if any(item.pose for item in found.values()) else EXIT_FAILED


def _print_board(board: CalibrationBoard, path: Path) -> int:
    """Write a board's picture."""
    import cv2

    try:
        path.write_bytes(cv2.imencode(".png", board.picture())[1].tobytes())
    except OSError as error:
        raise InputError(f"--print: {path}: {error.strerror}") from None
    wide, high = 100.0 * board.size
    print(
        f"{path}: print it {wide:.0f} x {high:.0f} cm large, so that the edge of a tag measures {100.0 * board.tag:g} cm"
    )
    return EXIT_DONE


def _calibrate_webcams(path: Path, board: CalibrationBoard, table_height: float, output: Path, *, json: bool) -> int:
    """Write a file of webcams with the poses that pictures of the board give them; those that see no board keep theirs."""
    from robosandbox.driver.webcams import OpenWebcam, WebcamFile, without_depth
    from robosandbox.perception.calibration import find_camera
    from robosandbox.types import Pose

    file = load_yaml_model(path, WebcamFile)
    found = {}
    for name, webcam in file.webcams.items():
        with closing(OpenWebcam(name, webcam)) as opened:
            # Without a pose it is told how far it is from the world's origin.
            taken = webcam.pose or Pose(xyz=(0.0, 0.0, 0.0))
            picture = without_depth(name, opened.picture(), webcam.lens.intrinsics, taken)
        found[name] = find_camera(picture, board, table_height)
    poses = {name: item.pose for name, item in found.items() if item.pose is not None}
    if json:
        _tell_as_json(found)
    else:
        _tell({name: item for name, item in found.items() if item.pose is None or file.webcams[name].pose is not None})
        for name in poses:
            if file.webcams[name].pose is None:
                x, y, z = poses[name].xyz
                tags, left = found[name].tags, found[name].error_mm
                print(f"{name:<6} stands at {x:.3f} {y:.3f} {z:.3f} m, by {tags} tags, {left:.1f} mm left")
    placed = {
        name: webcam.model_copy(update={"pose": poses.get(name, webcam.pose)}) for name, webcam in file.webcams.items()
    }
    try:
        text = yaml.safe_dump(WebcamFile(webcams=placed).model_dump(mode="json"), sort_keys=False)
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"--output: {output}: {error.strerror}") from None
    return EXIT_DONE if poses else EXIT_FAILED


def _tell_as_json(found: Mapping[str, CameraPoseEstimate]) -> None:
    print_json(
        {
            name: {
                "tags": item.tags,
                "pose": item.pose.model_dump(mode="json") if item.pose else None,
                "error_mm": item.error_mm,
                "shift_mm": item.shift_mm,
                "turn_deg": item.turn_deg,
            }
            for name, item in found.items()
        }
    )


def _tell(found: Mapping[str, CameraPoseEstimate]) -> None:
    for name, item in found.items():
        if item.pose is None:
            print(f"{name:<6} sees {item.tags} tags; move the board with --at to where it sees three or more")
        else:
            print(
                f"{name:<6} {item.shift_mm:.1f} mm and {item.turn_deg:.2f} deg off, by {item.tags} tags, "
                f"{item.error_mm:.1f} mm left"
            )
