"""`repl`: a conversation with a robot, in an embedded world or in a sim process."""

from __future__ import annotations

import sys
from io import TextIOWrapper
from typing import TYPE_CHECKING, Annotated

import typer

from robosandbox.commands import checks
from robosandbox.commands.connecting import Connect, RobotId, ZenohConfig
from robosandbox.commands.options import (
    BaseUrl,
    Camera,
    Cassette,
    MaxReplans,
    Model,
    NoCache,
    OwnSeed,
    PlannerName,
    RobotName,
    TaskName,
    TimeLimit,
)
from robosandbox.commands.packages import PackagePath
from robosandbox.commands.recording import Record, Video, VideoFps, record_settings, recording
from robosandbox.errors import InputError

if TYPE_CHECKING:
    from robosandbox.commands.shell.link import Link
    from robosandbox.tasks.workcell import Workcell

_PICTURE_SIZE = (480, 640)


def repl(
    connect: Connect = None,
    robot_id: RobotId = None,
    zenoh_config: ZenohConfig = None,
    task: TaskName = None,
    robot: RobotName = None,
    package_path: PackagePath = None,
    no_cache: NoCache = False,
    planner: PlannerName = "stub",
    base_url: BaseUrl = None,
    model: Model = None,
    cassette: Cassette = None,
    time_limit: TimeLimit = None,
    camera: Camera = None,
    perception: Annotated[
        str | None,
        typer.Option(
            "--perception",
            help="What sees the objects; ground_truth if left out.",
            callback=checks.known("perceptions"),
        ),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            "--sensor",
            help="What its cameras are like: ideal, realsense or rough.",
            callback=checks.known_sensor,
        ),
    ] = None,
    seed: OwnSeed = None,
    max_replans: MaxReplans = 3,
    reconnect: Annotated[
        float, typer.Option("--reconnect", help="Seconds that commands wait for a sim that went away.")
    ] = 30.0,
    record: Record = None,
    video: Video = None,
    video_fps: VideoFps = 20.0,
) -> int:
    """Talk to a robot, line by line; without --connect in a world of this process."""
    if not 0.0 <= reconnect <= 86400.0:
        raise InputError(f"--reconnect: {reconnect:g} is not within 0..86400 seconds")
    remote = bool(connect or robot_id or zenoh_config)
    settings = record_settings(record, video, video_fps)
    own = {
        "--task": task,
        "--robot": robot,
        "--perception": perception,
        "--sensor": sensor,
        "--seed": seed,
        "--record": record,
    }
    for option, value in own.items():
        if remote and value is not None:
            raise InputError(
                f"{option}: a sim process has its own; give it to `robo-sandbox sim`, or leave --connect out"
            )
    planner_options = {"base_url": base_url, "model": model, "cassette": cassette, "time_limit": time_limit}
    if not remote:
        from robosandbox.tasks.session import open_session

        with (
            open_session(
                task,
                robot=robot,
                planner=planner,
                planner_options=planner_options,
                camera=camera,
                dialogue=True,
                perception=perception or "ground_truth",
                sensor=sensor or "ideal",
                seed=seed or 0,
                max_replans=max_replans,
                render_size=_PICTURE_SIZE,
            ) as session,
            recording(settings, session),
        ):
            return _talk(session)

    from robosandbox.agent.client import connect as connect_to
    from robosandbox.commands.shell.link import Link
    from robosandbox.tasks.remote import RemoteSession

    with connect_to(*(connect or []), zenoh_config=zenoh_config, reconnect=reconnect) as client:
        there = client.robot(robot_id)
        far = RemoteSession(
            there,
            planner=planner,
            planner_options=planner_options,
            camera=camera,
            dialogue=True,
            max_replans=max_replans,
        )
        return _talk(far, Link(client, there))


def _talk(workcell: Workcell, link: Link | None = None) -> int:
    from robosandbox.commands.shell.shell import Shell

    shell = Shell(workcell, link)
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        from robosandbox.commands.shell.piped import run_lines

        if isinstance(sys.stdin, TextIOWrapper):
            # A byte that is no UTF-8 spoils its own line only.
            sys.stdin.reconfigure(errors="replace")
        return run_lines(shell, sys.stdin)

    from robosandbox.commands.shell.terminal import Terminal

    return Terminal(shell).run()
