"""Libraries that do not outlive a fork: their threads stay behind, and whoever waits for one of them waits forever."""

from __future__ import annotations

import os


class ForkGuard:
    """Notices that a library was begun before this process was forked.

    Args:
        library: As a message names it.
    """

    def __init__(self, library: str) -> None:
        self._library = library
        self._begun_in: int | None = None

    def begin(self) -> None:
        """Take note that the library is used from here on, in this process."""
        self._begun_in = os.getpid()

    def lost(self) -> str | None:
        """Return why the library cannot be used here, and what to do; None where it can."""
        if self._begun_in in (None, os.getpid()):
            return None
        return (
            f"{self._library} was used in process {self._begun_in} before this one, {os.getpid()}, was forked from it, and does "
            "not outlive a fork; start processes with multiprocessing.get_context('spawn')"
        )
