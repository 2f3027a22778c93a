"""A line on stderr for whatever takes longer than a person waits without wondering."""

from __future__ import annotations

import logging
import sys
import threading

from robosandbox.progress import LOGGER

# Response times over a second interrupt a person's thought (Nielsen, Usability Engineering, 1993, chapter 5).
_PATIENCE_SECONDS = 1.0


class SlowWork(logging.Handler):
    """Prints what is being done once it has taken over a second.

    Args:
        program: Stands before the line.
    """

    def __init__(self, program: str) -> None:
        super().__init__(logging.INFO)
        self._program = program
        self._timer: threading.Timer | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Take what is done now; empty is nothing."""
        self.stop()
        what = record.getMessage()
        if what:
            self._timer = threading.Timer(_PATIENCE_SECONDS, self._print, [what])
            self._timer.daemon = True
            self._timer.start()

    def stop(self) -> None:
        """Forget what was being done."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _print(self, what: str) -> None:
        print(f"{self._program}: {what} ...", file=sys.stderr, flush=True)


def tell_slow_work(program: str) -> SlowWork:
    """Tell a person on stderr what takes over a second, until `stop_telling`."""
    handler = SlowWork(program)
    LOGGER.setLevel(logging.INFO)
    LOGGER.propagate = False
    LOGGER.addHandler(handler)
    return handler


def stop_telling(handler: SlowWork) -> None:
    """Take the handler away again."""
    LOGGER.removeHandler(handler)
    handler.stop()
