"""`repl`: a conversation with a robot, in an embedded world or in a sim process."""

from __future__ import annotations

import sys
from io import TextIOWrapper
from typing import TYPE_CHECKING

from robosandbox.apps.commands.recording import Record, Video, VideoFps, record_settings
from robosandbox.apps.commands.world import Connection, check_remote, open_here, takes_world
from robosandbox.errors import InputError
from robosandbox.workcell.options import WorkcellOptions

if TYPE_CHECKING:
    from robosandbox.apps.repl.link import Link
    from robosandbox.apps.repl.shell import Shell
    from robosandbox.workcell.recording.settings import RecordSettings
    from robosandbox.workcell.workcell import Workcell

# Height and width of pictures, pixels; chosen to fill half a terminal's window when opened.
_PICTURE_SIZE = (480, 640)


@takes_world(without=("calibration", "what_if"))
def repl(
    connection: Connection,
    world: WorkcellOptions,
    record: Record = None,
    video: Video = None,
    video_fps: VideoFps = 20.0,
) -> int:
    """Talk to a robot, line by line; without --connect in a world of this process."""
    settings = record_settings(record, video, video_fps)
    if not connection:
        with open_here(world, render_size=_PICTURE_SIZE) as cell:
            return _talk(cell, world, record=settings)

    check_remote(world)
    if record is not None:
        raise InputError("--record: a sim process has its own; give it to `robo-sandbox sim`, or leave --connect out")
    from robosandbox.apps.repl.link import Link

    with connection.client() as client:
        far = connection.before(client, world)
        return _talk(far, world, Link(client, far.robot))


def _talk(
    cell: Workcell, world: WorkcellOptions, link: Link | None = None, record: RecordSettings | None = None
) -> int:
    from robosandbox.apps.repl.shell import Shell
    from robosandbox.workcell.host import WorkcellHost

    # Lines are carried out in this thread, which Ctrl-C reaches while a planner thinks.
    host = WorkcellHost(cell, record=record)
    try:
        return _read_lines(Shell(host, link, robot=world.robot))
    finally:
        host.close()


def _read_lines(shell: Shell) -> int:
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        from robosandbox.apps.repl.piped import run_lines

        if isinstance(sys.stdin, TextIOWrapper):
            # A byte that is no UTF-8 spoils its own line only.
            sys.stdin.reconfigure(errors="replace")
        return run_lines(shell, sys.stdin)

    from robosandbox.apps.repl.terminal import Terminal

    return Terminal(shell).run()
