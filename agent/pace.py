"""Motion at the speed of the clock, for people and programs that watch."""

from __future__ import annotations

import time

from robosandbox.driver import Driver


class Pace:
    """A listener to ticks that waits until the clock has caught up with the simulated time.

    Args:
        driver: Whose time.
    """

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._sim_start = driver.time
        self._wall_start = time.monotonic()

    def __call__(self) -> None:
        """Wait for the clock; after a pause between goals, count from here."""
        ahead = (self._driver.time - self._sim_start) - (time.monotonic() - self._wall_start)
        if ahead > 0.0:
            time.sleep(ahead)
        elif ahead < -0.1:
            self._sim_start = self._driver.time
            self._wall_start = time.monotonic()
