"""Handling of Ctrl-C while a line is carried out."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from robosandbox.agent import episode as events
from robosandbox.workcell.host import WorkcellHost

_PATIENCE_SECONDS = 1.0


class Interrupts:
    """Stops a running skill properly, and leaves everything else at once with a KeyboardInterrupt.

    A skill that does not stop within a second is left as well when asked again. It is a listener for agents, which tell it
    whether a skill runs.

    Args:
        host: Stops skills.
        away: Tells whether the robot cannot be asked to stop.

    Attributes:
        count: How often Ctrl-C came during the last guard.
        moved: Whether a skill began during it.
        running: Whether one runs.
    """

    def __init__(self, host: WorkcellHost, away: Callable[[], bool]) -> None:
        self.count: int = 0
        self.moved: bool = False
        self._host = host
        self._away = away
        self.running: bool = False
        self._asked: float | None = None

    def __call__(self, event: events.AgentEvent) -> None:
        """Note whether a skill runs."""
        match event:
            case events.SkillStarted():
                self.moved = self.running = True
            case events.SkillEnded() | events.SkillFailed() | events.Ended():
                self.running = False
            case events.Planned() | events.PhaseEntered() | events.Replanning():
                pass

    @contextmanager
    def guard(self) -> Iterator[None]:
        """Carry out one line.

        Raises:
            KeyboardInterrupt: Ctrl-C came when no skill ran, or when the skill did not stop.
        """
        self.count, self.moved, self.running, self._asked = 0, False, False, None
        before = signal.signal(signal.SIGINT, self._handle)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        self.count += 1
        if not self.running or self._away():
            raise KeyboardInterrupt
        now = time.monotonic()
        if self._asked is None:
            self._asked = now
            self._host.stop()
        elif now - self._asked > _PATIENCE_SECONDS:
            raise KeyboardInterrupt
