"""The one thread that touches the world: goals and resets one after another, questions between control ticks."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Literal

from robosandbox.driver import Driver
from robosandbox.errors import SkillError

_log = logging.getLogger(__name__)
_IDLE_SECONDS = 0.5
# How far simulated time may be behind the clock before it is let go, seconds; chosen above a look between two ticks.
_MOST_BEHIND = 0.05

Job = Callable[[], None]
Pace = Literal["realtime", "fast"]


class Worker:
    """Owns a sim from `start` to `stop`; every other thread hands it jobs.

    At `realtime` pace a simulated second takes a second, between goals too. At `fast` pace simulated time passes only
    while a job makes it pass, and then as fast as it computes.

    Args:
        driver: Of the world.
        pace: How simulated time passes.

    Attributes:
        pace: Likewise.
        looks: How often it looked at its queue, for a watchdog: while it works or waits, that goes up.
    """

    def __init__(self, driver: Driver, pace: Pace) -> None:
        self.pace: Pace = pace
        self.looks: int = 0
        self._driver = driver
        self._leave: Job = _nothing
        self._reads: deque[Job] = deque()
        self._orders: deque[Job] = deque()
        self._changed = threading.Condition()
        self._stopping = False
        self._idle = True
        self._wall = 0.0
        self._driverulated = 0.0
        self._thread = threading.Thread(target=self._loop, name="world", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._adopt(self._driver)
        self._thread.start()

    def stop(self, timeout: float) -> bool:
        """End after the running job, dropping those that wait; return whether it ended within `timeout` seconds."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        self._thread.join(timeout)
        if self._thread.is_alive():
            return False
        self._leave()
        return True

    def set_pace(self, pace: Pace) -> None:
        """Let simulated time pass in another way from now on."""
        with self._changed:
            self.pace = pace
            self._rebase()
            self._changed.notify_all()

    def read(self, job: Job) -> None:
        """Run a short job that changes nothing, at the next control tick or at once."""
        with self._changed:
            self._reads.append(job)
            self._changed.notify_all()

    def order(self, job: Job) -> None:
        """Run a job when all jobs ordered before have ended; it may let time pass and change the world."""
        with self._changed:
            self._orders.append(job)
            self._changed.notify_all()

    def exchange(self, driver: Driver) -> None:
        """Own another sim from now on; only for jobs."""
        self._leave()
        self._adopt(driver)

    def _adopt(self, driver: Driver) -> None:
        self._driver = driver
        self._leave = driver.subscribe(self._between_ticks)
        self._rebase()

    # In the thread.

    def _loop(self) -> None:
        while True:
            with self._changed:
                if self._stopping:
                    return
                if not self._reads and not self._orders and self.pace == "fast":
                    self._changed.wait(_IDLE_SECONDS)
                order = self._orders.popleft() if self._orders else None
            self._answer()
            if order is not None:
                self._idle = False
                self._run(order)
                self._idle = True
                self._rebase()
            elif self.pace == "realtime":
                self._run(lambda: self._driver.wait(self._driver.control_timestep))

    def _between_ticks(self) -> None:
        self._answer()
        if self.pace != "realtime":
            return
        ahead = self._ahead()
        if ahead < -_MOST_BEHIND:
            # Planning stops simulated time; what was lost is not caught up in a rush.
            self._rebase()
        while ahead > 0.0 and not self._stopping:
            with self._changed:
                if self._idle and self._orders:
                    return
                if not self._reads:
                    self._changed.wait(ahead)
            self._answer()
            ahead = self._ahead()

    def _answer(self) -> None:
        self.looks += 1
        while self._reads:
            self._run(self._reads.popleft())

    def _run(self, job: Job) -> None:
        try:
            job()
        except SkillError as error:
            # A cancel that came too late, or a limit passed while nothing ran: there is no goal to tell.
            _log.info("while idle: %s", error)
        except Exception:
            # The thread outlives any fault: the world must go on being served.
            _log.exception("fault in the world's thread")

    def _ahead(self) -> float:
        """Return by how many seconds simulated time is ahead of the clock on the wall."""
        return (self._driver.time - self._driverulated) - (time.monotonic() - self._wall)

    def _rebase(self) -> None:
        self._wall, self._driverulated = time.monotonic(), self._driver.time


def _nothing() -> None:
    pass
