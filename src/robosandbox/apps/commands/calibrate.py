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
    scene = Scene(robot_urdf=Path(robot) if robot else None)
    if webcams is not None:
        return _calibrate_webcams(webcams, board, scene.table_height, webcams if output is None else output)
    with doing("looking for the board"), closing(open_with_board(scene, board, sensor)) as sim:
        found = {name: find_camera(sim.capture(name), board, scene.table_height) for name in sim.cameras}
    if output is not None:
        calibration_of(found).save(output)
    if json:
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
    else:
        _tell(found)
    return EXIT_DONE if any(item.pose for item in found.values()) else EXIT_FAILED


def _calibrate_webcams(path: Path, board: CalibrationBoard, table_height: float, output: Path) -> int:
    """Write a file of webcams with the poses that pictures of the board give them; those that see no board keep theirs."""
    from robosandbox.driver.webcams import OpenWebcam, WebcamFile, seen_by
    from robosandbox.perception.calibration import find_camera

    file = load_yaml_model(path, WebcamFile)
    found = {}
    for name, webcam in file.webcams.items():
        with closing(OpenWebcam(name, webcam)) as opened:
            found[name] = find_camera(seen_by(name, webcam, opened.picture(), None), board, table_height)
    _tell(found)
    poses = {name: item.pose for name, item in found.items() if item.pose is not None}
    placed = {
        name: webcam.model_copy(update={"pose": poses.get(name, webcam.pose)}) for name, webcam in file.webcams.items()
    }
    try:
        text = yaml.safe_dump(WebcamFile(webcams=placed).model_dump(mode="json"), sort_keys=False)
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"--output: {output}: {error.strerror}") from None
    return EXIT_DONE if poses else EXIT_FAILED


def _tell(found: Mapping[str, CameraPoseEstimate]) -> None:
    for name, item in found.items():
        if item.pose is None:
            print(f"{name:<6} sees {item.tags} tags; move the board with --at to where it sees three or more")
        else:
            print(
                f"{name:<6} {item.shift_mm:.1f} mm and {item.turn_deg:.2f} deg off, by {item.tags} tags, "
                f"{item.error_mm:.1f} mm left"
            )
