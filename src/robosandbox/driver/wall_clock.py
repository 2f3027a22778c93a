"""A driver to start from whose machine goes by the wall's clock."""

from __future__ import annotations

import logging
import time
from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING

from robosandbox.driver.bare import BareDriver

if TYPE_CHECKING:
    from robosandbox.driver.protocols import Guard
    from robosandbox.types import Posture

_log = logging.getLogger(__name__)


class WallClockDriver(BareDriver):
    """A driver of a machine that goes on by itself: what it tells is taken in once a control tick.

    Args:
        tick: Seconds between control ticks.
    """

    def __init__(self, tick: float) -> None:
        super().__init__()
        self.control_timestep = tick
        self._due = self._began = time.monotonic()

    @property
    def time(self) -> float:
        """Seconds since it was opened."""
        return self.since(time.monotonic())

    def since(self, monotonic: float) -> float:
        """Return a moment of the monotonic clock by this driver's, s."""
        return monotonic - self._began

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        """Let time pass with the last commands held."""
        for _ in range(max(1, round(seconds / self.control_timestep))):
            self.tick(guards)

    def tick(self, guards: Sequence[Guard]) -> None:
        """Let one control tick pass, and ask the guards; a tick that comes late does not hurry the next one."""
        self._due = max(self._due + self.control_timestep, time.monotonic())
        time.sleep(max(0.0, self._due - time.monotonic()))
        self.look()
        self._ticked(guards)

    @abstractmethod
    def look(self) -> None:
        """Take in what the machine tells, and fail where something is the matter."""

    @abstractmethod
    def posture(self) -> dict[str, Posture]:
        """Return how each arm stands, by its name, as a frame of a camera tells it."""

    def fail(self, why: str) -> None:
        """Take note of a fault; the first one is kept."""
        if not self.fault:
            self.fault = why
            _log.error(why)
