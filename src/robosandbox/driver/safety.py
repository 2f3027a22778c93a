"""Limits, watchdogs and mode of a cell, looked after at every control tick."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Literal

import numpy as np

from robosandbox.driver.bare import BareArm
from robosandbox.driver.capabilities import require, robot_name
from robosandbox.driver.clamps import TOLERANCES, braking_seconds
from robosandbox.driver.force import ForceGuard
from robosandbox.driver.protocols import Arm, Driver, Mode
from robosandbox.driver.sliding import SlideGuard
from robosandbox.driver.stop_switch import StopSwitch
from robosandbox.driver.surroundings import SurroundingsGuard
from robosandbox.driver.workspace import WorkspaceGuard
from robosandbox.errors import FaultError, LimitError, Phase, SkillError
from robosandbox.evidence import LimitEvidence
from robosandbox.types import Limits, force_limits

_log = logging.getLogger(__name__)


class _ArmWatch:
    """Limits of one arm at every tick, and its stop.

    Args:
        arm: The arm as its own driver has it.
        force: Its limit of force; None where nothing is felt.

    Attributes:
        force: Likewise.
        surroundings: Keeps it out of itself and of what stands there; None where its driver does not know that.
        stop_began: When it was told to stop, by the driver's time; None where it has stood since, or moves again.
    """

    def __init__(self, arm: Arm, force: ForceGuard | None) -> None:
        self.arm = arm
        self.force = force
        self.stop_began: float | None = None
        self.surroundings: SurroundingsGuard | None = None
        if isinstance(arm, BareArm) and arm.meets is not None:
            self.surroundings = SurroundingsGuard(arm, arm.meets)
        self._limits: list[Limits] = []
        # Where it may be: its workspaces, and outside of what stands there.
        self._places: list[Callable[[], LimitError | None]] = [] if self.surroundings is None else [self.surroundings]

    def limit(self, limits: Limits) -> None:
        """Keep these limits from now on, besides those that are kept already."""
        self._limits.append(limits)
        if limits.workspace is not None:
            self._places.append(WorkspaceGuard(self.arm, limits.workspace))
        if self.force is not None:
            self.force.allow(*force_limits(*self._limits))

    @property
    def speed(self) -> float:
        """The quickest joint's speed, rad/s or m/s."""
        return float(np.abs(self.arm.state().qd).max())

    @property
    def stop_deadline(self) -> float:
        """Seconds in which a stop has to be over."""
        return TOLERANCES.braking * braking_seconds(self.arm.spec)[1]

    def over_limit(self) -> SkillError | None:
        """Return what is wrong with where the arm is or what it presses; None where nothing is."""
        for guard in self._places:
            # An arm that brakes outside is on its way to a stop already.
            if (error := guard()) is not None and self.stop_began is None:
                return error
        return None if self.force is None else self.force()


class Safety:
    """The limits and watchdogs of one driver, asked in its control loop after every tick.

    Args:
        driver: Whose arms.

    Attributes:
        phase: What the arm is doing, for errors; None where nobody tells.
        mode: How the cell stands.
        fault: Why it moves nothing; "" where there is no fault.
        stopped_after: In how many seconds the last stop was over; None where none was seen to the end.
        is_braking: Whether a stop is waited for now.
        switches: What somebody stops the arms with from outside of this program.

    Raises:
        UnsupportedError: The robot's own limits name a force, and the driver feels none.
    """

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        has = driver.capabilities
        self._feels = has.contact is not None or has.wrist_wrench
        self._on_wall = has.clock == "wall"
        self._link_timeout = has.link_timeout
        self._arms = {
            name: _ArmWatch(arm, ForceGuard(driver, name, *force_limits()) if self._feels else None)
            for name, arm in driver.arms.items()
        }
        self._sliding = SlideGuard(driver) if has.contact == "named" else None
        self._limits: list[Limits] = []
        self._has_workspace = False
        self.phase: str | None = None
        self.mode: Mode = "ready"
        self.fault: str = ""
        self.stopped_after: float | None = None
        self.is_braking: bool = False
        self.switches: list[StopSwitch] = []
        self._evidence: LimitEvidence | None = None
        self._ticked_at = 0.0
        for name, watch in self._arms.items():
            if watch.arm.spec.limits is not None:
                self.limit(watch.arm.spec.limits, arm=name)
        if self._on_wall or not self._feels:
            for missing in self.unprotected:
                _log.warning(missing)

    # What is told.

    def limit(self, limits: Limits, arm: str | None = None) -> None:
        """Keep these limits from now on, of one arm or of all, besides those that are kept already.

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
        if arm is None or len(self._arms) == 1:
            self._limits.append(limits)
        self._has_workspace |= limits.workspace is not None
        for name, watch in self._arms.items():
            if arm in (None, name):
                watch.limit(limits)

    def expect(
        self,
        names: Iterable[str] | None,
        slides: Mapping[str, float] | None = None,
        friction: float = 0.0,
        arm: str | None = None,
        held: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        """Take note of what is meant to be pressed from now on.

        Args:
            names: Of things; None where nobody can tell them apart: whatever the robot touches, as one thing.
            slides: Under how many newtons each thing slides that is to stay, by its name.
            friction: The coefficient that this goes by.
            arm: Which arm is to press them; the others are to press nothing but what they hold. Any where it is left out.
            held: Id of what each arm holds, by the arm's name.
        """
        names = None if names is None else tuple(names)
        for name, watch in self._arms.items():
            if watch.force is not None:
                others = (held[name],) if name in held else ()
                watch.force.mean(names if names is None or arm in (None, name) else others)
        if self._sliding is not None:
            self._sliding.keep(slides or {}, friction)

    @property
    def unprotected(self) -> tuple[str, ...]:
        """What is not kept of this driver, in sentences."""
        name, told = robot_name(self._driver), list[str]()
        if not self._feels:
            told.append(
                f"force: the driver of {name} tells neither contact nor a wrench at the wrist, so that no limit of force is kept"
            )
        if self._sliding is None:
            told.append(f"sliding: the driver of {name} does not tell what it touches, so that it may shove anything")
        if not self._has_workspace:
            told.append("workspace: no limits.workspace is given, so that the arm goes as far as its joints do")
        elif any(watch.arm.spec.outline is None for watch in self._arms.values()):
            told.append(
                f"workspace: the joints of {name} do not tell where its links are, so that its tool alone is kept in"
            )
        if self._on_wall and any(watch.surroundings is None for watch in self._arms.values()):
            told.append(
                f"surroundings: the driver of {name} does not know what stands there, so that only plans keep the arm out of that and "
                "of itself"
            )
        if self._on_wall and self._link_timeout is None:
            told.append(
                f"link: the driver of {name} does not tell the age of its state, so that a lost link is not seen"
            )
        return tuple(told)

    def surroundings(self, arm: str) -> SurroundingsGuard | None:
        """Return what keeps an arm out of itself and of what stands there; None where its driver does not know that."""
        return self._arms[arm].surroundings

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
        quickest = min(braking_seconds(watch.arm.spec)[0] for watch in self._arms.values())
        return max(2, int(quickest / tick)) * tick

    @property
    def stop_deadline(self) -> float:
        """Seconds in which a stop has to be over, of the arm that brakes slowest."""
        return max(watch.stop_deadline for watch in self._arms.values())

    def begin(self) -> None:
        """Take note that a command begins.

        Raises:
            FaultError: There is a fault, or the link is lost; nothing moves.
        """
        if not self.fault:
            self._check_robot()
        if self.fault:
            raise self._error(f"{self.fault}; nothing moves before recover() is called")

    def moving(self, arm: str) -> None:
        """Take note that an arm moves; a stop that it was in is over."""
        self.mode, self._arms[arm].stop_began = "moving", None
        self._ticked_at = time.monotonic()

    def arrived(self) -> None:
        """Take note that the motion has ended."""
        if self.mode == "moving":
            self.mode = "ready"

    def stopping(self, *arms: str) -> None:
        """Take note that some arms were told to stop, or all of them."""
        if not self.fault:
            self.mode = "stopping"
        for name in arms or self._arms:
            self._arms[name].stop_began = self._driver.time
        self.stopped_after = None

    def halted(self, *arms: str, waits: bool = True) -> None:
        """See to it that arms that were told to stop do.

        Args:
            arms: Names of the arms.
            waits: Whether to wait, on a wall's clock, until they stand.

        Raises:
            FaultError: One still moves after the time in which it has to stand.
        """
        self.stopping(*arms)
        if not waits or not self._on_wall:
            return
        # What asks to end a motion, as a cancel, is left for the next one to hear.
        self.is_braking = True
        try:
            while self.is_stopping:
                try:
                    self._driver.wait(self._driver.control_timestep)
                except LimitError:
                    # It brakes against something: it was told to stop where it is now, and is to stand there in time.
                    continue
        finally:
            self.is_braking = False

    @property
    def is_stopping(self) -> bool:
        """Whether an arm was told to stop, and has not been seen to stand since."""
        return any(watch.stop_began is not None for watch in self._arms.values())

    def anew(self) -> None:
        """Take note that the world was put into another state: faults and stops of the one before are over."""
        self.mode, self.fault, self._evidence, self.stopped_after = "ready", "", None, None
        self._forget_stops()

    def recover(self) -> None:
        """End a fault, somebody having looked after it.

        Raises:
            FaultError: What was the matter still is: an arm moves, the link is lost, or a stop is asked for.
        """
        self.anew()
        for switch in self.switches:
            switch.reset()
        self._check_robot()
        speed = max(watch.speed for watch in self._arms.values())
        if not self.fault and speed > TOLERANCES.still:
            self._failed(
                "fault", f"the arm moves at {speed:.3g} rad/s (or m/s)", "speed, rad/s or m/s", speed, TOLERANCES.still
            )
        if self.fault:
            raise self._error(f"{self.fault}; it is not over")

    # The control loop.

    def ticked(self) -> SkillError | None:
        """Return why the arms have to hold, or None; called after every control tick."""
        was = self.fault
        for watch in self._arms.values():
            if watch.stop_began is not None:
                self._watch_stop(watch, watch.stop_began)
        if self.mode == "moving":
            self._check_host()
            self._check_robot()
        elif self.mode in ("ready", "stopped") and (self._driver.fault or self._asked_to_stop):
            # It happened between two commands: the next one is refused, and time goes on.
            self._check_robot()
            return None
        if self.fault != was:
            return self._error(f"{self.fault}; nothing moves before recover() is called")
        for watch in self._arms.values():
            if (error := watch.over_limit()) is not None:
                return self._at(error)
        if self._sliding is not None and (error := self._sliding()) is not None:
            return self._at(error)
        return None

    def _at(self, error: SkillError) -> SkillError:
        return error if self.phase is None else error.with_(phase=self.phase)

    def _watch_stop(self, watch: _ArmWatch, began: float) -> None:
        if self._link_timeout is not None and self._driver.time - watch.arm.state().time > self._link_timeout:
            # Nobody hears whether it stands, and the fault says why.
            if not self.fault:
                self._check_robot()
            self._forget_stops()
            return
        speed, gone = watch.speed, self._driver.time - began
        if speed < TOLERANCES.still:
            watch.stop_began, self.stopped_after = None, gone
            if not self.fault and not self.is_stopping and self.mode == "stopping":
                self.mode = "stopped"
        elif gone > watch.stop_deadline:
            self._failed(
                "lost" if self.mode == "lost" else "fault",
                f"the arm was told to stop {gone:.2f} s ago and moves at {speed:.3g} rad/s (or m/s); it has to stand, below "
                f"{TOLERANCES.still:g}, within {watch.stop_deadline:.2f} s",
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

    def _check_robot(self) -> None:
        """Look whether the robot has a fault of its own, and when it was last heard of."""
        # Asked first: a robot that has not been heard of for some time may see only now what is the matter.
        age = 0.0 if self._link_timeout is None else self._driver.time - self._oldest_state
        if why := self._asked_to_stop or self._driver.fault:
            self.mode, self.fault, self._evidence = "fault", why, None
            self._forget_stops()
            _log.error("%s: %s", robot_name(self._driver), self.fault)
        elif self._link_timeout is not None and age > self._link_timeout:
            self._failed(
                "lost",
                f"the robot was last heard of {age:.3f} s ago, and {self._link_timeout:.3f} s are allowed",
                "age of the robot's state, s",
                age,
                self._link_timeout,
            )

    @property
    def _asked_to_stop(self) -> str:
        """Why nothing is to move, as somebody outside asks; "" where nobody does."""
        return next((why for switch in self.switches if (why := switch.pressed())), "")

    @property
    def _oldest_state(self) -> float:
        return min(watch.arm.state().time for watch in self._arms.values())

    def _failed(self, mode: Literal["fault", "lost"], why: str, quantity: str, value: float, most: float) -> None:
        # The first cause is kept, and a stop that is not over is no longer waited for.
        self.mode, self.fault = mode, f"{self.fault}; {why}" if self.fault else why
        self._forget_stops()
        self._evidence = LimitEvidence(quantity=quantity, value=value, low=0.0, high=most)
        _log.error("%s: %s", robot_name(self._driver), why)

    def _forget_stops(self) -> None:
        for watch in self._arms.values():
            watch.stop_began = None

    def _error(self, said: str) -> FaultError:
        return FaultError(said, phase=self.phase or Phase.CHECK, evidence=self._evidence)
