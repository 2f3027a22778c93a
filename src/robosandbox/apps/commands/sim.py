"""`sim`: the world as a process of its own, served over Zenoh."""

from __future__ import annotations

import re
import signal
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robosandbox.apps.commands.console import EXIT_DONE, end_now, ending_with_threads
from robosandbox.apps.commands.recording import Video, VideoFps, record_settings
from robosandbox.apps.commands.world import takes_world
from robosandbox.driver import robot_name
from robosandbox.errors import InputError
from robosandbox.values import frozen
from robosandbox.workcell.options import WorkcellOptions

if TYPE_CHECKING:
    from robosandbox.workcell.embedded import EmbeddedWorkcell
    from robosandbox.workcell.recording.settings import RecordSettings
    from robosandbox.workcell.zenoh.server.checkpoint import SavedWorld
    from robosandbox.workcell.zenoh.server.loader import TaskLoader

# Between looks for a signal, seconds; chosen so that Ctrl-C seems to act at once.
_WAKE_SECONDS = 0.2
# How long the world's thread may not look at its queue, seconds; chosen above the 120 s that clients wait for any answer,
# and above taking a mesh apart.
_MOST_SILENT_SECONDS = 300.0
_PROGRAM = "robo-sandbox"
_PACES = ("realtime", "fast")

ZenohConfig = Annotated[
    Path | None, typer.Option("--zenoh-config", help="A Zenoh configuration file, see examples/zenoh/.")
]
# How long a thread may keep the interpreter, seconds; chosen well below the state stream's period of 20 ms (Python's own is 5 ms).
_SWITCH_SECONDS = 0.001


@frozen(kw_only=True)
class Serving:
    """Settings of a served world, and the rights of its clients.

    Attributes:
        robot_id: Its name in keys.
        listen: A Zenoh endpoint.
        pace: How simulated time passes.
        zenoh_config: A Zenoh configuration.
        state_file: Where the world is kept.
        allow_files: Folders whose models clients may load.
        ground_truth: Whether `truth` answers.
        insecure: Whether it may listen beyond this machine without asking who comes.
    """

    robot_id: Annotated[str, typer.Option("--robot-id", help="Its name in keys: a-z, 0-9, '-' and '_'.")] = "robot"
    listen: Annotated[str | None, typer.Option("--listen", help="Zenoh endpoint; tcp/127.0.0.1:7447 if left out.")] = (
        None
    )
    pace: Annotated[str, typer.Option("--pace", help="realtime, or fast.")] = "realtime"
    zenoh_config: ZenohConfig = None
    state_file: Annotated[
        Path | None, typer.Option("--state-file", help="Keep the world here; a restarted sim goes on from it.")
    ] = None
    allow_files: Annotated[
        list[Path] | None, typer.Option("--allow-files", help="A folder whose models clients may load.")
    ] = None
    ground_truth: Annotated[
        bool, typer.Option("--ground-truth/--no-ground-truth", help="Answer truth with the simulated state.")
    ] = True
    insecure: Annotated[
        bool, typer.Option("--insecure", help="Listen beyond this machine without asking who comes.")
    ] = False

    def check(self) -> None:
        """Refuse what is wrong before anything is loaded.

        Raises:
            InputError: The message names the option.
        """
        if not re.fullmatch(r"[a-z0-9_-]{1,64}", self.robot_id):
            raise InputError(f"--robot-id: {self.robot_id[:70]!r} is no id; use up to 64 of a-z, 0-9, '-' and '_'")
        if self.pace not in _PACES:
            raise InputError(f"--pace: {self.pace!r} is not one of {', '.join(_PACES)}")
        for folder in self.allow_files or ():
            if not folder.is_dir():
                raise InputError(f"--allow-files: {str(folder)!r} is no folder")


@takes_world(
    without=(
        "planner",
        "base_url",
        "model",
        "cassette",
        "time_limit",
        "camera",
        "calibration",
        "max_replans",
    )
)
def sim(
    world: WorkcellOptions,
    serving: Serving,
    record: Annotated[
        Path | None, typer.Option("--record", help="Keep each goal in a folder of its own in this folder.")
    ] = None,
    video: Video = None,
    video_fps: VideoFps = 20.0,
) -> int:
    """Serve a world over Zenoh until SIGINT or SIGTERM."""
    serving.check()
    settings = record_settings(record, video, video_fps)
    # Zenoh's threads and the state stream must not wait 5 ms for a thread that plans.
    sys.setswitchinterval(_SWITCH_SECONDS)
    stopped = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())

    from robosandbox.plugins import load_plugin
    from robosandbox.sim.sensors import find_sensor
    from robosandbox.workcell.zenoh.server.loader import TaskLoader

    load_plugin("perceptions", world.perception)
    find_sensor(world.sensor)
    _serve(TaskLoader(world, allowed=serving.allow_files or []), serving, settings, stopped)
    return EXIT_DONE


def _serve(loader: TaskLoader, serving: Serving, settings: RecordSettings | None, stopped: threading.Event) -> None:
    """Serve the loader's first task, or what a state file has, until it is time to stop."""
    from robosandbox.workcell.zenoh.server.checkpoint import StateFile
    from robosandbox.workcell.zenoh.server.server import SimServer
    from robosandbox.workcell.zenoh.transport import open_listener

    file = StateFile(serving.state_file) if serving.state_file else None
    saved = file.load() if file else None
    session, endpoints = open_listener(serving.listen, config_file=serving.zenoh_config, insecure=serving.insecure)
    try:
        cell = _open(loader, saved)
        server = SimServer(
            cell,
            session,
            robot_id=serving.robot_id,
            load=loader.load,
            pace="fast" if serving.pace == "fast" else "realtime",
            truth=serving.ground_truth,
            state_file=file,
            record=settings,
        )
        if saved is not None:
            server.adopt(saved)
        with ending_with_threads(_PROGRAM), server:
            where = ", ".join(endpoints) or "the routers of the Zenoh config"
            said = f"{serving.robot_id!r}: {cell.task.name} with {robot_name(cell.driver)}"
            print(f"listening on {where} as {said}", flush=True)
            # A signal may be taken by one of Zenoh's threads; its handler runs when this thread wakes up next.
            looks, silent = server.host.thread.looks, 0.0
            while not stopped.wait(_WAKE_SECONDS):
                # Counted in wakes: a process that was stopped for a while has not been silent.
                silent = silent + _WAKE_SECONDS if server.host.thread.looks == looks else 0.0
                looks = server.host.thread.looks
                if silent > _MOST_SILENT_SECONDS:
                    end_now(
                        _PROGRAM,
                        f"the world has not looked at its queue for {silent:.0f} s, at {server.host.doing or 'rest'}",
                    )
            print("stopping", file=sys.stderr, flush=True)
        cell.close()
    finally:
        session.close()


def _open(loader: TaskLoader, saved: SavedWorld | None) -> EmbeddedWorkcell:
    if saved is None:
        return loader.first()
    session = loader.resume(saved)
    print(
        f"going on with {session.task.name} at {session.driver.time:.2f} s from the state file; remove it to start over",
        file=sys.stderr,
        flush=True,
    )
    return session
