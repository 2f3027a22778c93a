"""Lines said before, kept between conversations where the disk allows."""

from __future__ import annotations

import logging
import os
from pathlib import Path

from prompt_toolkit.history import FileHistory, History, InMemoryHistory

_log = logging.getLogger(__name__)


def open_history(path: Path | None) -> History:
    """Return the history in a file, or one in memory where the file cannot be written."""
    if path is None:
        return InMemoryHistory()
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
