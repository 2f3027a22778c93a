"""Files of an episode's folder, written so that they are whole."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from pydantic import SerializerFunctionWrapHandler, model_serializer, model_validator

from robosandbox.errors import InputError
from robosandbox.types import Checkpoint, Positive, StrictModel, Verdict, the_only
from robosandbox.types.robot import ARM

META, STEPS, STREAM, EVENTS, RESULT = "meta.json", "steps.parquet", "steps.arrows", "events.jsonl", "result.json"
VIDEOS = "videos"
FORMAT = "robosandbox.episode"
VERSION = 1


class RobotMeta(StrictModel):
    """A recorded robot, which is one arm.

    Attributes:
        name: Its model's stem.
        joints: Arm joints, in the order of `q`.
        lower: Their limits; None where there is none.
        upper: As `lower`.
        home_q: At home.
        actuators: The names behind `action`; none of a driver without a simulated model.
        gripper: Gap between the pads at closed and at open, metres; None without a gripper.
        sidecar: Its roles, as the sidecar has them.
    """

    name: str
    joints: tuple[str, ...]
    lower: tuple[float | None, ...]
    upper: tuple[float | None, ...]
    home_q: tuple[float, ...]
    actuators: tuple[str, ...]
    gripper: tuple[float, float] | None
    sidecar: dict[str, Any]


class VideoMeta(StrictModel):
    """A camera's video; its frame `i` shows row `i * every` of the steps."""

    camera: str
    every: int
    fps: float
    width: int
    height: int


class Meta(StrictModel):
    """Description of an episode, written before its first step.

    Attributes:
        format: Says what the folder holds.
        version: Of the format.
        prompt: What the robot was told.
        task: The loaded task, as its YAML would have it.
        seed: The layout.
        arms: The robots by the name of their arm; of the only one the file says `robot`.
        objects: Ids, in the order of the column `objects`.
        bodies: Names of all bodies, for `contact_bodies`.
        skills: What the robot could do: name, description and JSON schema of the arguments.
        control_timestep: Seconds between rows.
        checkpoint: The world before the first action, for running it again; None of a driver without a simulated model,
            where `objects` and `qpos` are what perception believed.
        columns: What each column of the steps holds.
        videos: Those written along.
        versions: Of what the outcome depends on.
        started: When, UTC.
    """

    format: Literal["robosandbox.episode"] = "robosandbox.episode"
    version: Literal[1] = 1
    prompt: str
    task: dict[str, Any]
    seed: int
    arms: Mapping[str, RobotMeta]
    objects: tuple[str, ...]
    bodies: tuple[str, ...]
    skills: tuple[dict[str, Any], ...]
    control_timestep: Positive
    checkpoint: Checkpoint | None
    columns: dict[str, str]
    videos: tuple[VideoMeta, ...] = ()
    versions: dict[str, str]
    started: datetime

    @property
    def robot(self) -> RobotMeta:
        """The robot of a recording with one; a ValueError where there are several."""
        return the_only(self.arms, "arms")

    @property
    def robot_name(self) -> str:
        """Name of the robot for people; of several arms the names of each model."""
        return " and ".join(dict.fromkeys(robot.name for robot in self.arms.values()))

    @model_validator(mode="before")
    @classmethod
    def _robot_is_the_only_arm(cls, data: Any) -> Any:
        if not isinstance(data, dict) or "robot" not in data:
            return data
        return {**{key: value for key, value in data.items() if key != "robot"}, "arms": {ARM: data["robot"]}}

    @model_serializer(mode="wrap")
    def _only_arm_is_the_robot(self, as_data: SerializerFunctionWrapHandler) -> dict[str, Any]:
        data: dict[str, Any] = as_data(self)
        if [*data.get("arms", ())] != [ARM]:
            return data
        return {
            "robot" if key == "arms" else key: value[ARM] if key == "arms" else value for key, value in data.items()
        }


class Result(StrictModel):
    """Result of an episode.

    Attributes:
        success: What the agent claims.
        reason: Why it ended.
        detail: The same as a sentence.
        steps: Rows in the steps file.
        ended: Row at which the agent had ended; what follows was waited to judge.
        sim_secs: Simulated seconds from the first row to the last.
        wall_secs: Seconds on the wall.
        episode: All that the agent says of it; None without an agent.
        judged: What the task's criterion says of the simulated state; None where it was not asked.
    """

    success: bool
    reason: str
    detail: str
    steps: int
    ended: int
    sim_secs: float
    wall_secs: float
    episode: dict[str, Any] | None = None
    judged: Verdict | None = None


def new_folder(parent: Path, name: str) -> Path:
    """Make and return a folder in `parent` that was not there: `name`, or `name-2`, `name-3`, ...

    Several processes may ask at once.

    Raises:
        InputError: It cannot be made.
    """
    number = 1
    while True:
        folder = parent / (name if number == 1 else f"{name}-{number}")
        try:
            folder.mkdir(parents=True)
            return folder
        except FileExistsError:
            if parent.exists() and not parent.is_dir():
                raise InputError(f"--record: {str(parent)!r} is a file; name a folder") from None
            number += 1
        except OSError as error:
            raise InputError(f"--record: {str(folder)!r} cannot be made: {error.strerror}") from None


def write_whole(path: Path, text: str) -> None:
    """Write a file that is there whole or not at all, whenever the process dies."""
    new = path.with_name(f".{path.name}.new")
    new.write_text(text, encoding="utf-8")
    os.replace(new, path)


def find_episodes(folder: Path) -> Iterator[Path]:
    """Yield the episodes' folders in a folder, sorted by name, at most two levels down; the folder itself if it is one."""
    if (folder / META).is_file():
        yield folder
        return
    for level in ("*", "*/*"):
        for path in sorted(folder.glob(f"{level}/{META}")):
            yield path.parent
