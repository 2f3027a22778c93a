"""Options that several commands share, with what each of them accepts."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Annotated

import typer

from robosandbox.apps.commands import checks
from robosandbox.errors import InputError

_DAY = 86_400.0  # Seconds of a day. Chosen as the longest time limit: longer ones are slips.


def _from_zero(option: typer.CallbackParam, value: int | None) -> int | None:
    if value is not None and value < 0:
        raise InputError(f"--{str(option.name).replace('_', '-')}: {value} is negative; give 0 or more")
    return value


def _seconds(option: typer.CallbackParam, value: float | None) -> float | None:
    if value is not None and not 0.0 < value <= _DAY:
        raise InputError(f"--{str(option.name).replace('_', '-')}: {value:g}; give seconds above 0, at most {_DAY:g}")
    return value


Prompt = Annotated[str | None, typer.Argument(help="What to do; '-' reads it from stdin; the task's own if left out.")]
# What a name stands for is looked up when the command line is read, before anything heavy is imported.
TaskName = Annotated[
    str | None,
    typer.Option("--task", help="A bundled task or a YAML file; three cubes if left out.", callback=checks.known_task),
]
RobotName = Annotated[
    str | None,
    typer.Option("--robot", help="A URDF or MJCF file or a bundled robot.", callback=checks.known_robot),
]
SceneFile = Annotated[
    Path | None,
    typer.Option("--scene", help="An MJCF file of your own scene; what is in it is found.", metavar="FILE"),
]
RobotBase = Annotated[
    str | None,
    typer.Option(
        "--robot-base",
        help="Where the robot stands in --scene: x,y,z,yaw in metres and radians; where it reaches most if left out.",
        metavar="X,Y,Z,YAW",
    ),
]
SidecarFile = Annotated[
    Path | None, typer.Option("--sidecar", help="The sidecar; the one beside the model if left out.")
]
ArmName = Annotated[str | None, typer.Option("--arm", help="Which arm, where the model or the task has several.")]
GripperModel = Annotated[
    Path | None, typer.Option("--gripper", help="A gripper's model to mount on an arm that has none.")
]
DriverName = Annotated[
    str,
    typer.Option(
        "--driver",
        help="What moves the robot, often with options: NAME:key=value,key=value.",
        callback=checks.known_driver,
    ),
]
PlannerName = Annotated[
    str, typer.Option("--planner", help="What turns the prompt into a plan.", callback=checks.known("planners"))
]
BaseUrl = Annotated[str | None, typer.Option("--base-url", help="Where the model is served, up to /v1.")]
Model = Annotated[str | None, typer.Option("--model", help="The model's name there.")]
Mode = Annotated[
    str | None,
    typer.Option(
        "--mode", help="How a model works: plan, one plan at a time; act, call by call; code, also by programs."
    ),
]
ModelLimits = Annotated[
    Path | None, typer.Option("--model-limits", help="YAML of what asking a model may cost, see docs/planners.md.")
]
Cassette = Annotated[
    Path | None, typer.Option("--cassette", help="Record what is said with the model; replay it if the file exists.")
]
TimeLimit = Annotated[
    float | None,
    typer.Option(
        "--time-limit",
        help="Seconds that a model may take for a prompt, new plans included; 60 if left out.",
        callback=_seconds,
    ),
]
Camera = Annotated[str | None, typer.Option("--camera", help="Send this camera's picture to a model that sees.")]
GraspName = Annotated[
    str, typer.Option("--grasp", help="What proposes grasps.", callback=checks.known("grasp_planners"))
]
MotionName = Annotated[
    str, typer.Option("--motion", help="What plans the arm's motions.", callback=checks.known("motion_planners"))
]
TempoName = Annotated[
    str, typer.Option("--tempo", help="How fast the arm goes: careful, brisk or fast.", callback=checks.known_tempo)
]
PerceptionName = Annotated[
    str, typer.Option("--perception", help="What sees the objects.", callback=checks.known("perceptions"))
]
SensorName = Annotated[
    str,
    typer.Option(
        "--sensor", help="What its cameras are like: ideal, realsense, rough or webcam.", callback=checks.known_sensor
    ),
]
CalibrationFile = Annotated[
    Path | None, typer.Option("--calibration", help="Where the cameras are, as `robo-sandbox calibrate` found.")
]
Seed = Annotated[int, typer.Option("--seed", help="The layout; 0 is the task as written.", callback=_from_zero)]
MaxReplans = Annotated[int, typer.Option("--max-replans", help="New plans after failures.", callback=_from_zero)]
WhatIf = Annotated[
    bool, typer.Option("--what-if/--no-what-if", help="Try repairs in a simulation of what is believed.")
]


Confirm = Annotated[
    bool | None,
    typer.Option(
        "--confirm/--no-confirm",
        help="Try each plan on the twin first, show what it would do, and ask; so it is on a real arm if left out.",
        show_default=False,
    ),
]


StopSwitchPath = Annotated[
    Path | None,
    typer.Option(
        "--stop-switch",
        help="A file that stops the arms while it exists, or a gamepad or button that does, as /dev/input/js0.",
    ),
]


def _uncached(value: bool) -> bool:
    if value:
        # Worker processes are to do likewise, and they inherit the environment.
        os.environ["ROBOSANDBOX_NO_CACHE"] = "1"
    return value


NoCache = Annotated[
    bool,
    typer.Option(
        "--no-cache", callback=_uncached, help="Measure the robot anew; ROBOSANDBOX_NO_CACHE=1 does so everywhere."
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on stdout.")]


def read_base(text: str) -> tuple[float, float, float, float]:
    """Return the numbers of --robot-base.

    Raises:
        InputError: There are not four.
    """
    try:
        x, y, z, yaw = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--robot-base: {text!r} is not x,y,z,yaw; give four numbers, as in 0.2,0,0.74,0") from None
    if not all(map(math.isfinite, (x, y, z, yaw))):
        raise InputError(f"--robot-base: {text!r} has a number that is none; give metres and radians")
    return x, y, z, yaw
