"""The thread that touches a driver: jobs one after another, reads between control ticks, simulated time at a pace."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Literal

from robosandbox.driver import Driver
from robosandbox.errors import SkillError
from robosandbox.workcell.loop import Loop

_log = logging.getLogger(__name__)
_IDLE_SECONDS = 0.5
# How far simulated time may be behind the clock before it is let go, seconds; above a look between two ticks.
_MOST_BEHIND = 0.05

Pace = Literal["realtime", "fast", "watched"]
"""How simulated time passes: at the speed of the clock, between jobs too; as fast as it can be computed, and between jobs not
at all; or at the speed of the clock while something is done, and not at all between."""

Job = Callable[[], None]


class WorldThread:
    """Owns a driver from `start` to `end`. One in another process is that one's; here reads have a thread beside the jobs' then.

    Args:
        driver: The driver; None where it is another process's.
        pace: How simulated time passes.
        next_job: Returns the job that may begin, None where there is none; called with `changed` held.

    Attributes:
        changed: Held to change what `next_job` returns; notified by `wake`.
        pace: How simulated time passes.
        looks: How often it looked at its queue, for a watchdog: while it works or waits, that goes up.
        started: Whether it has begun.
    """

    def __init__(self, driver: Driver | None, pace: Pace, next_job: Callable[[], Job | None]) -> None:
        self.changed: threading.Condition = threading.Condition()
        self.pace: Pace = pace
        self.looks: int = 0
        self.started: bool = False
        self._driver = driver
        self._on_wall = driver is not None and driver.capabilities.clock == "wall"
        self._next_job = next_job
        self._reads: deque[Job] = deque()
        self._stopping = False
        self._wall = self._simulated = 0.0
        self._thread = threading.Thread(target=self._act, name="world", daemon=True)
        self._loops = () if driver else (Loop("world", self._act_elsewhere), Loop("reads", self._answer))

    def start(self) -> None:
        """Begin."""
        self.started = True
        if self._driver is not None:
            self._thread.start()
        for loop in self._loops:
            loop.start()

    def end(self, seconds: float) -> bool:
        """End after the running job; return whether that was so within `seconds`."""
        with self.changed:
            self._stopping = True
        self.wake()
        if self._thread.is_alive():
            self._thread.join(seconds)
        return not self._thread.is_alive() and all([loop.stop(seconds) for loop in self._loops])

    def own(self, driver: Driver) -> Callable[[], None]:
        """Own this driver from now on; in the thread, or before it starts. Return what lets it go."""
        self._driver, self._on_wall = driver, driver.capabilities.clock == "wall"
        self._rebase()
        return driver.subscribe(self._between_ticks)

    def wake(self) -> None:
        """Look at reads and jobs anew."""
        with self.changed:
            self.changed.notify_all()
        for loop in self._loops:
            loop.wake()

    def read(self, job: Job) -> None:
        """Run a short job that changes nothing, at the next control tick or at once."""
        self._reads.append(job)
        self.wake()

    def set_pace(self, pace: Pace) -> None:
        """Let simulated time pass in another way from now on."""
        with self.changed:
            self.pace = pace
            self._rebase()
        self.wake()

    def run(self, job: Job) -> None:
        """Run a job, whose faults end nothing."""
        try:
            job()
        except SkillError as error:
            # A cancel that came too late, or a limit passed while nothing ran: there is no goal to tell.
            _log.info("while idle: %s", error)
        except Exception:
            # The thread outlives any fault: the world must go on being served.
            _log.exception("fault in the world's thread")

    # In the thread.

    def _act(self) -> None:
        while True:
            with self.changed:
                if self._stopping:
                    return
                job = self._next_job()
                if not self._reads and job is None and not self._ticks_idle:
                    self.changed.wait(_IDLE_SECONDS)
                    job = self._next_job()
            self._answer()
            if job is not None:
                job()
                self._rebase()
            elif self._ticks_idle:
                self.run(self._idle)

    @property
    def _ticks_idle(self) -> bool:
        """Whether control ticks go on between jobs: a machine that goes on by itself is looked after all the time."""
        return self.pace == "realtime" or self._on_wall

    def _idle(self) -> None:
        assert self._driver is not None
        self._driver.wait(self._driver.control_timestep)

    def _act_elsewhere(self) -> None:
        while True:
            with self.changed:
                job = self._next_job()
            if job is None or self._stopping:
                return
            job()

    def _between_ticks(self) -> None:
        self._answer()
        if self.pace == "fast":
            return
        ahead = self._ahead()
        if ahead < -_MOST_BEHIND:
            # Planning stops simulated time; what was lost is not caught up in a rush.
            self._rebase()
        while ahead > 0.0 and not self._stopping:
            with self.changed:
                if self._next_job() is not None:
                    return
                if not self._reads:
                    self.changed.wait(ahead)
            self._answer()
            ahead = self._ahead()

    def _answer(self) -> None:
        self.looks += 1
        while self._reads:
            self.run(self._reads.popleft())

    def _ahead(self) -> float:
        """Return by how many seconds simulated time is ahead of the clock on the wall."""
        assert self._driver is not None
        return (self._driver.time - self._simulated) - (time.monotonic() - self._wall)

    def _rebase(self) -> None:
        if self._driver is not None:
            self._wall, self._simulated = time.monotonic(), self._driver.time
