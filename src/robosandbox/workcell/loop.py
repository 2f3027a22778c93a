"""A thread that acts when it is woken, or when it is time again."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

_log = logging.getLogger(__name__)


class Loop:
    """Calls `act` again and again in a thread of its own.

    Args:
        name: Of the thread.
        act: Returns after how many seconds it wants to be called again though nobody wakes it; None is never.
        hz: Most calls a second; a late call is made up for by no more than one period.
        end: Called in the thread when it ends.
    """

    def __init__(
        self,
        name: str,
        act: Callable[[], float | None],
        *,
        hz: float | None = None,
        end: Callable[[], None] = lambda: None,
    ) -> None:
        self._act = act
        self._end = end
        self._period = 1.0 / hz if hz is not None else 0.0
        self._changed = threading.Condition()
        self._woken = False
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Begin, with a first call."""
        self._thread.start()

    def wake(self) -> None:
        """Have `act` called soon."""
        with self._changed:
            self._woken = True
            self._changed.notify_all()

    def stop(self, seconds: float | None = None) -> bool:
        """End after the call that is under way; return whether that was so within `seconds`."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        if self._thread.is_alive():
            self._thread.join(seconds)
        return not self._thread.is_alive()

    @property
    def stopping(self) -> bool:
        """True once it is to end."""
        return self._stopping

    def _run(self) -> None:
        wait: float | None = 0.0
        due = 0.0
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._stopping or self._woken, wait)
                if self._stopping:
                    break
                self._woken = False
            due = max(due + self._period, time.monotonic())
            try:
                wait = self._act()
            except Exception:
                # One fault must not be the end of what is shown.
                _log.exception("fault in %s", self._thread.name)
                wait = 0.0 if self._period else None
            with self._changed:
                self._changed.wait_for(lambda: self._stopping, max(0.0, due - time.monotonic()))
        self._end()
