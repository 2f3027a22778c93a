"""What is kept of a robot at every control tick, and how it stands: its limits, its watchdogs, its mode."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterable, Mapping
from typing import Literal

import numpy as np

from robosandbox.driver.capabilities import require
from robosandbox.driver.clamps import TOLERANCES, braking_seconds
from robosandbox.driver.force import ForceGuard
from robosandbox.driver.protocols import Driver
from robosandbox.driver.sliding import SlideGuard
from robosandbox.driver.workspace import WorkspaceGuard
from robosandbox.errors import FaultError, Phase, SkillError
from robosandbox.evidence import LimitEvidence
from robosandbox.types import Limits, force_limits

_log = logging.getLogger(__name__)

Mode = Literal["ready", "moving", "stopping", "stopped", "fault", "lost"]
"""How a driver stands: at rest after a motion, in one, told to stop, seen to stand after that; ended by a fault; not heard of."""


class Safety:
    """The limits and watchdogs of one driver, asked in its control loop after every tick.

    Args:
        driver: Whose arm.

    Attributes:
        phase: What the arm is doing, for errors; None where nobody tells.
        mode: How it stands.
        fault: Why it moves nothing; "" where there is no fault.
        stopped_after: In how many seconds the last stop was over; None where none was seen to the end.

    Raises:
        UnsupportedError: The robot's own limits name a force, and the driver feels none.
    """

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        has = driver.capabilities
        self._feels = has.contact is not None or has.wrist_wrench
        self._on_wall = has.clock == "wall"
        self._link_timeout = has.link_timeout
        self._force = ForceGuard(driver, *force_limits()) if self._feels else None
        self._sliding = SlideGuard(driver) if has.contact == "named" else None
        self._limits: list[Limits] = []
        self._workspaces: list[WorkspaceGuard] = []
        self.phase: str | None = None
        self.mode: Mode = "ready"
        self.fault: str = ""
        self.stopped_after: float | None = None
        self._evidence: LimitEvidence | None = None
        # When the arm was told to stop, by the driver's time; None where it has stood since, or moves again.
        self._stop_began: float | None = None
        self._ticked_at = 0.0
        if driver.spec.limits is not None:
            self.limit(driver.spec.limits)
        if not self._feels:
            _log.warning(self.unprotected[0])

    # What is told.

    def limit(self, limits: Limits) -> None:
        """Keep these limits from now on, besides those that are kept already.

        Raises:
            UnsupportedError: They name a force, and the driver feels none.
        """
        if limits in self._limits:
            return
        force = limits.max_force_n or limits.max_unintended_force_n
        if force is not None and not self._feels:
            require(
                self._driver, "contact", f"limits.max_force_n, {force:g} N, is kept with it, or with a wrist_wrench"
            )
        self._limits.append(limits)
        if limits.workspace is not None:
            self._workspaces.append(WorkspaceGuard(self._driver, limits.workspace))
        if self._force is not None:
            self._force.allow(*force_limits(*self._limits))

    def expect(
        self, names: Iterable[str] | None, slides: Mapping[str, float] | None = None, friction: float = 0.0
    ) -> None:
        """Take note of what is meant to be pressed from now on.

        Args:
            names: Of things; None where nobody can tell them apart: whatever the robot touches, as one thing.
            slides: Under how many newtons each thing slides that is to stay, by its name.
            friction: The coefficient that this goes by.
        """
        if self._force is not None:
            self._force.mean(names)
        if self._sliding is not None:
            self._sliding.keep(slides or {}, friction)

    @property
    def unprotected(self) -> tuple[str, ...]:
        """What is not kept of this driver, in sentences."""
        name, told = self._driver.spec.name, list[str]()
        if self._force is None:
            told.append(
                f"force: the driver of {name} tells neither contact nor a wrench at the wrist, so that no limit of force is kept"
            )
        if self._sliding is None:
            told.append(f"sliding: the driver of {name} does not tell what it touches, so that it may shove anything")
        if not self._workspaces:
            told.append("workspace: no limits.workspace is given, so that the tool goes as far as the joints do")
        if self._on_wall and self._link_timeout is None:
            told.append(
                f"link: the driver of {name} does not tell the age of its state, so that a lost link is not seen"
            )
        return tuple(told)

    # The mode.

    @property
    def host_deadline(self) -> float | None:
        """Seconds that may pass between two control ticks of a motion; None where time waits for the host.

        In whole ticks, the time in which the quickest joint brakes from its full speed, and two ticks at the least: what is
        stopped a gap too late takes no more than twice as long to stand as what is stopped in time.
        """
        if not self._on_wall:
            return None
        tick = self._driver.control_timestep
        return max(2, int(braking_seconds(self._driver.spec)[0] / tick)) * tick

    @property
    def stop_deadline(self) -> float:
        """Seconds in which a stop has to be over."""
        return TOLERANCES.braking * braking_seconds(self._driver.spec)[1]

    def begin(self) -> None:
        """Take note that a command begins.

        Raises:
            FaultError: There is a fault, or the link is lost; nothing moves.
        """
        if not self.fault:
            self._check_link()
        if self.fault:
            raise self._error(f"{self.fault}; nothing moves before recover() is called")
        self._ticked_at = time.monotonic()

    def moving(self) -> None:
        """Take note that the arm moves; a stop that it was in is over."""
        self.mode, self._stop_began = "moving", None

    def arrived(self) -> None:
        """Take note that the motion has ended."""
        if self.mode == "moving":
            self.mode = "ready"

    def stopping(self) -> None:
        """Take note that the arm was told to stop."""
        if not self.fault:
            self.mode = "stopping"
        self._stop_began = self._driver.time
        self.stopped_after = None

    @property
    def is_stopping(self) -> bool:
        """Whether the arm was told to stop, and has not been seen to stand since."""
        return self._stop_began is not None

    def anew(self) -> None:
        """Take note that the world was put into another state: faults and stops of the one before are over."""
        self.mode, self.fault, self._evidence, self.stopped_after = "ready", "", None, None
        self._stop_began = None

    def recover(self) -> None:
        """End a fault, somebody having looked after it.

        Raises:
            FaultError: What was the matter still is: the arm moves, or the link is lost.
        """
        self.anew()
        self._check_link()
        speed = self._speed()
        if not self.fault and speed > TOLERANCES.still:
            self._failed(
                "fault", f"the arm moves at {speed:.3g} rad/s (or m/s)", "speed, rad/s or m/s", speed, TOLERANCES.still
            )
        if self.fault:
            raise self._error(f"{self.fault}; it is not over")

    # The control loop.

    def ticked(self) -> SkillError | None:
        """Return why the arm has to hold, or None; called after every control tick."""
        was = self.fault
        if self._stop_began is not None:
            self._watch_stop(self._stop_began)
        elif self.mode == "moving":
            self._check_host()
            self._check_link()
        if self.fault != was:
            return self._error(f"{self.fault}; nothing moves before recover() is called")
        for guard in self._workspaces:
            # An arm that brakes outside is on its way to a stop already.
            if (error := guard()) is not None and self._stop_began is None:
                return self._at(error)
        if self._force is not None and (error := self._force()) is not None:
            return self._at(error)
        if self._sliding is not None and (error := self._sliding()) is not None:
            return self._at(error)
        return None

    def _at(self, error: SkillError) -> SkillError:
        return error if self.phase is None else error.with_(phase=self.phase)

    def _watch_stop(self, began: float) -> None:
        speed, gone = self._speed(), self._driver.time - began
        if speed < TOLERANCES.still:
            self._stop_began, self.stopped_after = None, gone
            if not self.fault:
                self.mode = "stopped"
        elif gone > self.stop_deadline:
            self._failed(
                "lost" if self.mode == "lost" else "fault",
                f"the arm was told to stop {gone:.2f} s ago and moves at {speed:.3g} rad/s (or m/s); it has to stand, below "
                f"{TOLERANCES.still:g}, within {self.stop_deadline:.2f} s",
                "speed after a stop, rad/s or m/s",
                speed,
                TOLERANCES.still,
            )

    def _check_host(self) -> None:
        deadline = self.host_deadline
        if deadline is None:
            return
        now = time.monotonic()
        gap, self._ticked_at = now - self._ticked_at, now
        if gap > deadline:
            self._failed(
                "fault",
                f"this computer let {gap:.3f} s pass between two control ticks, and {deadline:.3f} s are allowed",
                "seconds between two control ticks",
                gap,
                deadline,
            )

    def _check_link(self) -> None:
        if self._link_timeout is None:
            return
        age = self._driver.time - self._driver.state().time
        if age > self._link_timeout:
            self._failed(
                "lost",
                f"the robot was last heard of {age:.3f} s ago, and {self._link_timeout:.3f} s are allowed",
                "age of the robot's state, s",
                age,
                self._link_timeout,
            )

    def _speed(self) -> float:
        return float(np.abs(self._driver.state().qd).max())

    def _failed(self, mode: Literal["fault", "lost"], why: str, quantity: str, value: float, most: float) -> None:
        # A stop that is not over is no longer waited for.
        self.mode, self.fault, self._stop_began = mode, why, None
        self._evidence = LimitEvidence(quantity=quantity, value=value, low=0.0, high=most)
        _log.error("%s: %s", self._driver.spec.name, why)

    def _error(self, said: str) -> FaultError:
        return FaultError(said, phase=self.phase or Phase.CHECK, evidence=self._evidence)
