"""Frames on their way to browsers: the latest one, at most so many a second, and none while nobody looks."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from robosandbox.apps.viewer.source import Frame
from robosandbox.workcell.loop import Loop

FRAME_HZ = 30.0  # Frames a second: half of what browsers draw.
# Seconds within which is drawn what is not drawn with every frame; the last frame is drawn again after it, for their sake.
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
        self._latest: deque[Frame] = deque(maxlen=1)
        self._shown: Frame | None = None
        self._loop = Loop("frames", self._act, hz=FRAME_HZ)

    def start(self) -> None:
        """Begin."""
        self._loop.start()

    def stop(self) -> None:
        """End after the frame in the making."""
        self._loop.stop()

    def put(self, frame: Frame) -> None:
        """Take a frame; it replaces one that has not been drawn yet."""
        self._latest.append(frame)
        self._loop.wake()

    def wake(self) -> None:
        """Look again whether anybody is watching."""
        self._loop.wake()

    def _act(self) -> float | None:
        """Draw the latest frame, or the last one once more; return in how many seconds to do that."""
        frame, self._shown = self._shown, None
        if self._latest and self._watched():
            frame = self._shown = self._latest.popleft()
        if frame is not None:
            self._draw(frame)
            self.drawn += 1
        return None if self._shown is None else _REST_SECONDS
