"""The options of commands that record."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from robosandbox.errors import InputError

if TYPE_CHECKING:
    from robosandbox.workcell.embedded import EmbeddedWorkcell
    from robosandbox.workcell.recording.recorder import Recorder
    from robosandbox.workcell.recording.settings import RecordSettings

Record = Annotated[
    Path | None, typer.Option("--record", help="Keep each episode in a folder of its own in this folder.")
]
Video = Annotated[str | None, typer.Option("--video", help="With --record: cameras to film, by comma.")]
VideoFps = Annotated[float, typer.Option("--video-fps", help="Frames per simulated second.")]


def record_settings(
    record: Path | None, video: str | None, video_fps: float, *, only_success: bool = False
) -> RecordSettings | None:
    """Return what to record; None where nothing is.

    Raises:
        InputError: An option makes no sense without another.
    """
    if record is None:
        for option, given in (("--video", video is not None), ("--only-success", only_success)):
            if given:
                raise InputError(f"{option}: is about what is recorded; give --record FOLDER with it")
        return None
    from robosandbox.workcell.recording.settings import RecordSettings, VideoSettings

    cameras = tuple(name for name in (video or "").split(",") if name)
    if video is not None and not cameras:
        raise InputError("--video: names no camera; give names by comma, such as scene,wrist")
    filmed = VideoSettings(cameras=cameras, fps=video_fps) if cameras else None
    return RecordSettings(folder=record, video=filmed, only_success=only_success)


def parse_size(size: str) -> tuple[int, int]:
    """Return (height, width) in pixels of an option's `WIDTHxHEIGHT`; both even, as films need them.

    Raises:
        InputError: It is none.
    """
    width, _, height = size.partition("x")
    if (
        not (width.isdecimal() and height.isdecimal())
        or int(width) % 2
        or int(height) % 2
        or not int(width) * int(height)
    ):
        raise InputError(f"--size: {size!r} is not WIDTHxHEIGHT in even pixels, such as 320x240")
    return int(height), int(width)


def tell_recorded(recorder: Recorder, folder: Path | None, document: dict[str, Any]) -> bool:
    """Say where an episode was recorded, in a document and on stderr; return whether it is there whole."""
    document["recorded"] = str(folder) if folder else None
    if recorder.cut_short is not None:
        # The log has said it.
        document["recording_error"] = recorder.cut_short
        return False
    print(f"recorded: {folder}", file=sys.stderr)
    return True


@contextmanager
def recording(settings: RecordSettings | None, session: EmbeddedWorkcell) -> Iterator[Recorder | None]:
    """Record what the session's agent does; None where nothing is recorded.

    Raises:
        InputError: The settings do not fit the world.
    """
    if settings is None:
        yield None
        return
    from robosandbox.workcell.recording.settings import open_recorder

    recorder = open_recorder(settings, session)
    recorder.follow()
    try:
        yield recorder
    finally:
        recorder.close()
