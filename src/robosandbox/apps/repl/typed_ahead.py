"""Lines typed while another one is carried out: "stop" is as Ctrl-C, the others wait their turn."""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

from robosandbox.workcell.orders import says_stop

# Seconds after which it is looked whether the line has been carried out; below what a person notices.
_POLL_SECONDS = 0.05
_BYTES = 4096


class TypedAhead:
    """Reads what is typed at a terminal while it is not asked for anything.

    Attributes:
        lines: Those that wait, in order.
        left: Whether Ctrl-D came.
    """

    def __init__(self) -> None:
        self.lines: deque[str] = deque()
        self.left: bool = False

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Read meanwhile; at most a line that is not ended yet stays with the terminal."""
        if sys.platform == "win32":
            yield
            return
        done = threading.Event()
        reader = threading.Thread(target=self._read, args=(sys.stdin.fileno(), done), name="typed ahead", daemon=True)
        reader.start()
        try:
            yield
        finally:
            done.set()
            reader.join()

    def _read(self, terminal: int, done: threading.Event) -> None:
        while not done.is_set():
            if not select.select([terminal], [], [], _POLL_SECONDS)[0]:
                continue
            typed = os.read(terminal, _BYTES)
            if not typed:
                self.left = True
                return
            for line in typed.decode("utf-8", "replace").splitlines():
                if says_stop(line) or line.strip() == "/cancel":
                    self.lines.clear()
                    os.kill(os.getpid(), signal.SIGINT)
                elif line.strip():
                    self.lines.append(line)
