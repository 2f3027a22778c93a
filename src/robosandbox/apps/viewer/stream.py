"""Frames on their way to browsers: the latest one, at most so many a second, and none while nobody looks."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from robosandbox.apps.viewer.source import Frame

_log = logging.getLogger(__name__)
FRAME_HZ = 30.0  # Frames a second. Chosen: half of what browsers draw.
# Seconds within which is drawn what is not drawn with every frame; the last frame is drawn again after it, for their sake.
# Chosen.
_REST_SECONDS = 0.3


class FrameStream:
    """Calls `draw` with the latest frame, in a thread of its own.

    Args:
        draw: Sends a frame.
        watched: Tells whether anybody looks.

    Attributes:
        drawn: How many frames were drawn.
    """

    def __init__(self, draw: Callable[[Frame], None], watched: Callable[[], bool]) -> None:
        self.drawn: int = 0
        self._draw = draw
        self._watched = watched
        self._latest: Frame | None = None
        self._changed = threading.Condition()
        self._stopping = False
        self._thread = threading.Thread(target=self._loop, name="frames", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End after the frame in the making."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        self._thread.join()

    def put(self, frame: Frame) -> None:
        """Take a frame; it replaces one that has not been drawn yet."""
        with self._changed:
            self._latest = frame
            self._changed.notify_all()

    def wake(self) -> None:
        """Look again whether anybody is watching."""
        with self._changed:
            self._changed.notify_all()

    def _loop(self) -> None:
        shown: Frame | None = None
        due = 0.0
        while True:
            with self._changed:
                fresh = self._changed.wait_for(
                    lambda: self._stopping or (self._latest is not None and self._watched()),
                    None if shown is None else _REST_SECONDS,
                )
                if self._stopping:
                    return
                if fresh:
                    shown, self._latest = self._latest, None
            frame, shown = shown, shown if fresh else None
            # Late frames are made up for by no more than one period.
            due = max(due + 1.0 / FRAME_HZ, time.monotonic())
            if frame is not None:
                try:
                    self._draw(frame)
                    self.drawn += 1
                except Exception:
                    # One picture that cannot be drawn must not be the last.
                    _log.exception("fault while drawing")
            with self._changed:
                self._changed.wait_for(lambda: self._stopping, max(0.0, due - time.monotonic()))
