"""A moving line on the terminal for whatever takes longer than a person waits without wondering."""

from __future__ import annotations

import logging
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING

from robosandbox.progress import LOGGER

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

# Response times over a second interrupt a person's thought (Nielsen, Usability Engineering, 1993, chapter 5).
_PATIENCE_SECONDS = 1.0


@lru_cache(maxsize=1)
def stderr_console() -> Console:
    """Return the one console of this process on stderr: lines that move on the same console do not overwrite each other."""
    from rich.console import Console

    return Console(stderr=True, highlight=False)


class SlowWork(logging.Handler):
    """Shows what is being done once it has taken over a second, until nothing is done any more."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self._what = ""
        self._timer: threading.Timer | None = None
        self._line: Progress | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Take what is done now; empty is nothing."""
        self.tell(record.getMessage())

    def tell(self, what: str) -> None:
        """Show this once a second has passed since nothing was done; empty shows nothing."""
        with self.lock:  # type: ignore[union-attr]
            self._what = what
            if not what:
                self._hide()
            elif self._line is not None:
                self._line.update(self._line.task_ids[0], description=what)
            elif self._timer is None:
                self._timer = threading.Timer(_PATIENCE_SECONDS, self._show)
                self._timer.daemon = True
                self._timer.start()

    def _hide(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._line is not None:
            self._line.stop()
            self._line = None

    def _show(self) -> None:
        # Not imported before somebody has waited.
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        with self.lock:  # type: ignore[union-attr]
            if self._timer is not threading.current_thread():
                return
            columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
            # What goes to the same terminal has to pass over the line; what goes elsewhere must not.
            here = sys.stdout is not None and sys.stdout.isatty()
            self._line = Progress(*columns, console=stderr_console(), transient=True, redirect_stdout=here)
            self._line.add_task(self._what, total=None)
            self._line.start()


@contextmanager
def slow_work_shown() -> Iterator[None]:
    """Show a person at a terminal what takes over a second, from now on; before the first `doing` that is starting."""
    if not sys.stderr.isatty():
        yield
        return
    handler = SlowWork()
    level, propagates = LOGGER.level, LOGGER.propagate
    LOGGER.setLevel(logging.INFO)
    LOGGER.propagate = False
    LOGGER.addHandler(handler)
    handler.tell("starting")
    try:
        yield
    finally:
        LOGGER.removeHandler(handler)
        LOGGER.propagate = propagates
        LOGGER.setLevel(level)
        handler.tell("")
