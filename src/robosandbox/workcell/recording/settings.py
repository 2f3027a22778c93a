"""Settings of a recorder: the folder, the films, the data that is kept."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from robosandbox.errors import InputError
from robosandbox.extras import missing_extra
from robosandbox.values import frozen

if TYPE_CHECKING:
    from robosandbox.driver import Driver
    from robosandbox.workcell.embedded import EmbeddedWorkcell
    from robosandbox.workcell.recording.recorder import Recorder


@frozen(kw_only=True)
class VideoSettings:
    """Settings of the films.

    Attributes:
        cameras: Names of the world's cameras.
        fps: Frames per simulated second; the control rate divided by a whole number.
    """

    cameras: tuple[str, ...]
    fps: float = 20.0


@frozen(kw_only=True)
class RecordSettings:
    """Settings of a recorder.

    Attributes:
        folder: Where episodes go.
        video: What to film; nothing when left out.
        only_success: Whether episodes that were not judged a success are removed.
    """

    folder: Path
    video: VideoSettings | None = None
    only_success: bool = False


def check_settings(settings: RecordSettings, driver: Driver) -> None:
    """Refuse settings with which a driver's world cannot be recorded.

    Raises:
        InputError: The folder is a file or cannot be written to, a camera is none of the world's, or the frame rate does not fit.
    """
    if settings.folder.exists() and not settings.folder.is_dir():
        raise InputError(f"--record: {str(settings.folder)!r} is a file; name a folder")
    there = next(
        folder for folder in (settings.folder.absolute(), *settings.folder.absolute().parents) if folder.exists()
    )
    try:
        tempfile.TemporaryFile(dir=there).close()
    except OSError as error:
        raise InputError(
            f"--record: {str(there)!r} cannot be written to: {error.strerror}; name another folder"
        ) from None
    if settings.video is not None:
        rows_per_frame(settings.video.fps, driver.control_timestep, "--video-fps")
        for camera in settings.video.cameras:
            if camera not in driver.capabilities.cameras:
                raise InputError(f"camera {camera!r} is not one of {', '.join(driver.capabilities.cameras)}")


def open_recorder(settings: RecordSettings, cell: EmbeddedWorkcell) -> Recorder:
    """Return a recorder for a world.

    Raises:
        InputError: The settings do not fit it, or a package is missing.
    """
    check_settings(settings, cell.driver)
    try:
        from robosandbox.workcell.recording.recorder import Recorder
    except ModuleNotFoundError as error:
        raise missing_extra(error, "--record", "record") from None
    return Recorder(settings.folder, cell, video=settings.video)


def rows_per_frame(fps: float, control_timestep: float, option: str) -> int:
    """Return how many control ticks lie from frame to frame.

    Raises:
        InputError: The rate does not divide the control rate.
    """
    rate = 1.0 / control_timestep
    every = round(rate / fps) if fps > 0.0 else 0
    if every < 1 or abs(every * fps - rate) > 1e-6 * rate:
        choices = [f"{rate / k:g}" for k in range(1, 21) if (rate / k).is_integer()]
        raise InputError(
            f"{option}: {fps:g} does not divide the control rate of {rate:g} Hz; give {', '.join(choices)}"
        )
    return every
