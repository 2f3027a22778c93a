"""`viewer`: the world in a browser, to steer and to look into."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robosandbox.apps.commands.console import EXIT_DONE, ending_with_threads
from robosandbox.apps.commands.recording import Record, Video, VideoFps, record_settings
from robosandbox.apps.commands.runs import load as load_episode
from robosandbox.apps.commands.world import Connection, check_remote, open_here, takes_world
from robosandbox.errors import InputError
from robosandbox.extras import missing_extra
from robosandbox.progress import doing
from robosandbox.workcell.options import WorkcellOptions

if TYPE_CHECKING:
    from robosandbox.apps.repl.link import Link
    from robosandbox.apps.viewer.control import Control
    from robosandbox.apps.viewer.news import News
    from robosandbox.apps.viewer.replay import RecordedFrames
    from robosandbox.apps.viewer.source import WorldSource
    from robosandbox.workcell.recording.episode import RecordedEpisode
    from robosandbox.workcell.recording.settings import RecordSettings

_DEFAULT_PORT = 8080  # Number of the port, as of viser.
_PICTURE_SIZE = (360, 480)  # Height and width, pixels. Chosen: as large as a panel of the page.
_WAKE_SECONDS = 0.5
# Seconds between switches of threads. Chosen so that a browser's messages are not kept waiting by physics.
_SWITCH_SECONDS = 0.001


@takes_world(without=("cassette", "time_limit", "camera", "calibration"))
def viewer(
    world: WorkcellOptions,
    connection: Connection,
    record: Record = None,
    video: Video = None,
    video_fps: VideoFps = 20.0,
    replay: Annotated[
        Path | None, typer.Option("--replay", help="A recorded episode's folder, to be shown state by state.")
    ] = None,
    port: Annotated[int, typer.Option("--port", help="On 127.0.0.1; 0 takes any free one.")] = _DEFAULT_PORT,
) -> int:
    """Show the world in a browser on this machine, until SIGINT or SIGTERM."""
    if not 0 <= port <= 65535:
        raise InputError(f"--port: {port} is no port; give 0 to 65535")
    if connection:
        check_remote(world)
    if connection and record is not None:
        raise InputError(
            "--record: what happens in a sim process is recorded there; give --record to `robo-sandbox sim`"
        )
    settings = record_settings(record, video, video_fps)
    own = ("task", "robot", "sidecar", "arm", "gripper")
    if replay is not None and (connection or any(getattr(world, name) is not None for name in own) or world.seed != 0):
        raise InputError(
            "--replay: the episode has its task, robot and seed; leave out "
            f"{', '.join(f'--{name}' for name in own)}, --seed and --connect"
        )
    episode = load_episode(replay) if replay is not None else None
    try:
        from robosandbox.apps.viewer.app import Viewer
    except ModuleNotFoundError as error:
        raise missing_extra(error, "viewer", "viewer") from None
    sys.setswitchinterval(_SWITCH_SECONDS)
    opened = _connected_source(connection, world) if connection else _embedded_source(world, settings, episode)
    with ending_with_threads("robo-sandbox"), opened as (source, playback, link):
        with doing("starting the page's server"):
            shown = Viewer(source, port, playback)
            shown.control.listeners.append(_log)
            shown.start()
            if link is not None:
                link.tell = partial(_tell_presence, shown.control, link)
        stopped = threading.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: stopped.set())
        try:
            print(f"viewer at {shown.url}: {source.host.cell.task.name} with {source.host.cell.robot_name}", flush=True)
            while not stopped.wait(_WAKE_SECONDS):
                pass
            print("stopping", file=sys.stderr, flush=True)
        finally:
            shown.stop()
    return EXIT_DONE


def _log(news: News) -> None:
    """Write what was ordered in the browser, word for word, and what came of it to stderr."""
    from robosandbox.apps.viewer.news import Began, Came, Complaint, Stopped
    from robosandbox.apps.viewer.outcome import STOPPED, calls, told

    match news:
        case Began(doing, what):
            line = f"{doing}: {what}"
        case Came():
            line = "; ".join([*calls(news.result.data), *(text for text, _ in told(news))])
        case Stopped():
            line = STOPPED[0]
        case Complaint(message):
            line = f"not done: {message}"
        case _:
            return
    print(line, file=sys.stderr, flush=True)


def _tell_presence(control: Control, link: Link, line: str) -> None:
    """Say on stderr and in the page that the sim went away or is back."""
    from robosandbox.apps.viewer.news import Presence

    print(line, file=sys.stderr, flush=True)
    control.tell(Presence(line if link.away else ""))


@contextmanager
def _embedded_source(
    world: WorkcellOptions, settings: RecordSettings | None, episode: RecordedEpisode | None
) -> Iterator[tuple[WorldSource, RecordedFrames | None, None]]:
    """Open a world in this process; each one that is loaded after it is opened, and recorded, likewise."""
    from robosandbox.apps.viewer.embedded import EmbeddedSource
    from robosandbox.tasks.task import Task
    from robosandbox.validation import validate
    from robosandbox.workcell.host import WorkcellHost

    if episode is None:
        cell, playback = open_here(world, render_size=_PICTURE_SIZE), None
    else:
        from robosandbox.apps.viewer.replay import recorded_frames

        task = validate(episode.meta.task, Task, source=f"{episode.name}/meta.json: task")
        own = dict.fromkeys(("scene", "robot_base", "robot", "sidecar", "arm", "gripper"))
        cell = open_here(world, task=task, **own, render_size=_PICTURE_SIZE)
        if episode.meta.checkpoint is not None:
            cell.restore(episode.meta.checkpoint)
        playback = recorded_frames(episode, cell)
    yield EmbeddedSource(WorkcellHost(cell, pace="watched", record=settings)), playback, None


@contextmanager
def _connected_source(connection: Connection, world: WorkcellOptions) -> Iterator[tuple[WorldSource, None, Link]]:
    from robosandbox.apps.repl.link import Link
    from robosandbox.apps.viewer.connected import ConnectedSource
    from robosandbox.workcell.host import WorkcellHost

    with connection.client() as client:
        cell = connection.before(client, world)
        yield ConnectedSource(WorkcellHost(cell)), None, Link(client, cell.robot)
