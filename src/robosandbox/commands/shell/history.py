"""Lines said before, kept between conversations where the disk allows."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping
from pathlib import Path

from prompt_toolkit.history import FileHistory, History, InMemoryHistory

_log = logging.getLogger(__name__)


def history_file(environment: Mapping[str, str]) -> Path:
    """Return where lines are kept, by the XDG base directory specification."""
    state = environment.get("XDG_STATE_HOME", "")
    # The specification has relative paths ignored.
    base = Path(state) if os.path.isabs(state) else Path("~/.local/state").expanduser()
    return base / "robosandbox" / "history"


def open_history(path: Path) -> History:
    """Return the history in a file, or one in memory where the file cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # What somebody said to a robot is nobody else's to read.
        os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
    except OSError as error:
        _log.info("no history is kept: %s: %s", path, error.strerror)
        return InMemoryHistory()
    return _History(str(path))


class _History(FileHistory):
    """A file that is let go when it cannot be written any more."""

    def store_string(self, string: str) -> None:
        try:
            super().store_string(string)
        except OSError as error:
            _log.info("a line is not kept: %s", error.strerror)
