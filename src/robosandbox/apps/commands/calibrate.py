"""`calibrate`: where the cameras really are, from a board of AprilTags on the table."""

from __future__ import annotations

import dataclasses
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, print_json
from robosandbox.apps.commands.options import DriverName, Json, RobotName, SensorName
from robosandbox.errors import InputError, SensorError
from robosandbox.progress import doing
from robosandbox.validation import load_yaml_model

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from robosandbox.driver.realsense import OpenRealsense
    from robosandbox.driver.webcams import OpenWebcam
    from robosandbox.perception.calibration import CameraPoseEstimate
    from robosandbox.sim.calibration_board import CalibrationBoard
    from robosandbox.types import Scene

# Gap between tags as a share of a tag's edge; and edges that can be printed and seen, metres.
_GAP, _SMALLEST, _LARGEST = 2.0 / 9.0, 0.01, 0.2
# How far joints may be apart before and after a picture, rad or m, for a hand that stood still in it: a hand shakes some.
_STOOD = 0.005
# Pictures of the board that a webcam's pose follows from: noise of a corner goes down to a third.
_PICTURES = 10


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
        typer.Option("--webcams", help="Look through the webcams of this file, and write their poses into it."),
    ] = None,
    lens: Annotated[
        str | None,
        typer.Option(
            "--lens", help="Measure the lens of this one of --webcams: hold the board before it, still, in many ways."
        ),
    ] = None,
    hand: Annotated[
        str | None,
        typer.Option(
            "--hand",
            help="Measure where this one of --webcams rides on the hand of --driver, or with --held where it stands: lead the hand "
            "to many views of the board.",
        ),
    ] = None,
    held: Annotated[
        bool, typer.Option("--held", help="Of --hand: the hand holds the board, and the camera stands.")
    ] = False,
    driver: DriverName = "mujoco",
    tag: Annotated[float, typer.Option("--tag", help="Edge of a tag of the board, metres.")] = 0.09,
    seconds: Annotated[float, typer.Option("--seconds", help="Of --lens and --hand: how long to look at most.")] = 90.0,
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
    if not _SMALLEST <= tag <= _LARGEST:
        raise InputError(f"--tag: {tag:g} m; give {_SMALLEST:g} to {_LARGEST:g}")
    board = CalibrationBoard(centre=at, tag=tag, gap=_GAP * tag)
    if print_to is not None:
        return _print_board(board, print_to)
    if lens is not None:
        if webcams is None:
            raise InputError("--lens: give --webcams, the file that the webcam is in")
        return _measure_lens(webcams, lens, board, output or webcams, seconds, json=json)
    scene = Scene(robot_urdf=Path(robot) if robot else None)
    if hand is not None:
        if webcams is None:
            raise InputError("--hand: give --webcams, the file that the camera is in")
        return _measure_hand(webcams, hand, board, output or webcams, seconds, driver, scene, is_held=held, json=json)
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
    """Write into a file of webcams the poses that pictures of the board give them; all else of it stays as it is."""
    from robosandbox.driver.webcam_file import WebcamFile, write_entries
    from robosandbox.driver.webcams import open_camera
    from robosandbox.perception.calibration import MOST_LEFT_PX, find_webcam
    from robosandbox.types import Pose

    file = load_yaml_model(path, WebcamFile)
    found, entries = {}, {}
    for name, webcam in file.webcams.items():
        if webcam.arm is not None:
            print(f"{name} rides on a hand: `calibrate --webcams {path} --hand {name}`", file=sys.stderr)
            continue
        # Without a pose it is told how far it is from the world's origin.
        taken = webcam.pose or Pose(xyz=(0.0, 0.0, 0.0))
        with closing(open_camera(path, name, webcam)) as opened:
            item = find_webcam(name, _pictures(opened), opened.lens, taken, board, table_height)
        found[name] = item
        if item.pose is not None and item.error_px <= MOST_LEFT_PX:
            entries[name] = webcam.model_copy(update={"pose": item.pose})
    if entries:
        write_entries(path, entries, output)
    if json:
        _tell_as_json(found)
        return EXIT_DONE if entries else EXIT_FAILED
    for name, item in found.items():
        if item.pose is None or (name in entries and file.webcams[name].pose is not None):
            _tell({name: item})
        elif name in entries:
            x, y, z = item.pose.xyz
            print(f"{name:<6} stands at {x:.3f} {y:.3f} {z:.3f} m, by {item.tags} tags, {item.error_mm:.1f} mm left")
        else:
            print(
                f"{name:<6} is not written: the tags' corners are {item.error_px:.1f} pixels off where its best pose puts them, and "
                f"{MOST_LEFT_PX:.1f} are allowed; measure its lens (`--lens {name}`), and look whether the board lies flat and still"
            )
    if not entries:
        print(f"{path} stays as it is")
    return EXIT_DONE if entries else EXIT_FAILED


def _pictures(opened: OpenWebcam | OpenRealsense) -> list[NDArray[np.uint8]]:
    """Return some pictures of a camera; a file that has fewer gives what it has, but one."""
    pictures = [opened.picture()]
    for _ in range(_PICTURES - 1):
        try:
            pictures.append(opened.picture())
        except SensorError:
            break
    return pictures


def _meanwhile(opened: OpenWebcam | OpenRealsense, seconds: float) -> Iterator[NDArray[np.uint8]]:
    """Yield a camera's pictures for some seconds, or all that a file has."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            yield opened.picture()
        except SensorError:
            if opened.is_device:
                raise
            return


def _measure_lens(path: Path, name: str, board: CalibrationBoard, output: Path, seconds: float, *, json: bool) -> int:
    """Write into a file of webcams the lens of one, as pictures of the board tell it that somebody holds before it."""
    from robosandbox.driver.webcam_file import Lens, WebcamFile, write_entries
    from robosandbox.driver.webcams import OpenWebcam
    from robosandbox.perception.lens_calibration import MOST_VIEWS, LensViews

    file = load_yaml_model(path, WebcamFile)
    webcam = file.webcams.get(name)
    if webcam is None:
        raise InputError(f"--lens: {path} has no webcam {name!r}; it has {', '.join(file.webcams)}")
    views = LensViews(board)
    with closing(OpenWebcam(name, webcam)) as opened:
        for picture in _meanwhile(opened, seconds):
            if views.take(picture, moves=opened.is_device) and opened.is_device:
                print(f"{len(views)} of {MOST_VIEWS}: now hold the board otherwise", file=sys.stderr)
            if len(views) == MOST_VIEWS:
                break
    try:
        found = views.measure()
    except SensorError as error:
        print(f"{name}: {error}; {path} stays as it is", file=sys.stderr)
        return EXIT_FAILED
    measured = Lens(**dataclasses.asdict(found.lens))
    write_entries(path, {name: webcam.model_copy(update={"lens": measured})}, output)
    if json:
        print_json(
            {
                "webcam": name,
                "lens": measured.model_dump(mode="json"),
                "views": found.views,
                "error_px": found.error_px,
                "apart_px": found.apart_px,
            }
        )
        return EXIT_DONE
    k1, k2, *_ = measured.distortion
    print(
        f"{name}: fx {measured.fx:.1f}, fy {measured.fy:.1f}, centre {measured.cx:.1f} {measured.cy:.1f}, distortion {k1:.3f} "
        f"{k2:.3f}, by {found.views} pictures, {found.error_px:.2f} pixels left; halves of them are {found.apart_px:.1f} pixels apart"
    )
    if webcam.pose is not None:
        print(f"its pose was found with another lens: run `robo-sandbox calibrate --webcams {output}`")
    return EXIT_DONE


def _measure_hand(
    path: Path,
    name: str,
    board: CalibrationBoard,
    output: Path,
    seconds: float,
    driver_name: str,
    scene: Scene,
    *,
    is_held: bool,
    json: bool,
) -> int:
    """Write into a file of webcams where one rides on a hand, or stands, as views of the board tell it to which somebody leads the hand."""
    from robosandbox.driver import load_driver
    from robosandbox.driver.webcam_file import WebcamFile, write_entries
    from robosandbox.driver.webcams import open_camera
    from robosandbox.perception.hand_eye import MOST_VIEWS, HandViews

    file = load_yaml_model(path, WebcamFile)
    webcam = file.webcams.get(name)
    if webcam is None:
        raise InputError(f"--hand: {path} has no webcam {name!r}; it has {', '.join(file.webcams)}")
    views = HandViews(board, is_held=is_held)
    with closing(load_driver(driver_name, scene)) as driver, closing(open_camera(path, name, webcam)) as opened:
        (arm_name,) = driver.arms
        arm, lens = driver.arms[arm_name], opened.lens
        before = arm.state()
        for picture in _meanwhile(opened, seconds):
            after = arm.state()
            stood = float(abs(after.q - before.q).max()) < _STOOD
            if stood and views.take(picture, after.tcp_pose, moves=opened.is_device):
                print(f"{len(views)} of {MOST_VIEWS}: now lead the hand elsewhere", file=sys.stderr)
            if len(views) == MOST_VIEWS:
                break
            before = after
    try:
        found = views.measure(lens)
    except SensorError as error:
        print(f"{name}: {error}; {path} stays as it is", file=sys.stderr)
        return EXIT_FAILED
    rides = None if is_held else arm_name
    write_entries(path, {name: webcam.model_copy(update={"pose": found.pose, "arm": rides})}, output)
    if json:
        told = {
            "pose": found.pose.model_dump(mode="json"),
            "arm": rides,
            "views": found.views,
            "error_px": found.error_px,
        }
        print_json({"webcam": name, **told, "apart_mm": found.apart_mm, "apart_deg": found.apart_deg})
        return EXIT_DONE
    x, y, z = (1e3 * value for value in found.pose.xyz)
    print(
        f"{name}: {'stands' if is_held else 'rides on the hand'} at {x:.1f} {y:.1f} {z:.1f} mm, by {found.views} views, {found.error_px:.2f} "
        f"pixels left; halves of them are {found.apart_mm:.1f} mm and {found.apart_deg:.2f} degrees apart"
    )
    return EXIT_DONE


def _tell_as_json(found: Mapping[str, CameraPoseEstimate]) -> None:
    print_json(
        {
            name: {
                "tags": item.tags,
                "pose": item.pose.model_dump(mode="json") if item.pose else None,
                "error_mm": item.error_mm,
                "error_px": item.error_px,
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
