"""A world as an agent has it, in this process or in another: looked at, listened to, acted in one goal at a time."""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from robosandbox.errors import ErrorCode, Failure, InternalError, Phase, RoboSandboxError, SkillError, UnsupportedError
from robosandbox.skills.events import EventStream, Intended, PhaseEntered, SkillEnded, SkillFailed, SkillStarted
from robosandbox.types import Intent, Limits, ObservedScene, RgbdFrame, SkillCall, SkillResult
from robosandbox.types.robot import RobotSpec
from robosandbox.world.abilities import Abilities
from robosandbox.world.operators import BoundCall, Operator

_log = logging.getLogger(__name__)


@dataclass(kw_only=True)
class GoalContext(ABC):
    """A world in which an agent runs goals, one at a time.

    Attributes:
        events: All that happens in it, told in the thread that runs the skill or waits for it.
        skills: What the agent here can call, by name: repairs are made of it.
        confirmed: Whether a person has confirmed what is carried out now.
    """

    events: EventStream = field(default_factory=EventStream, init=False, repr=False)
    skills: Mapping[str, Operator] = field(default_factory=dict, init=False, repr=False)
    confirmed: bool = field(default=False, init=False, repr=False)
    _running: SkillCall | None = field(default=None, init=False, repr=False)
    _phase: str = field(default=Phase.CHECK, init=False, repr=False)
    _cancelled: threading.Event = field(default_factory=threading.Event, init=False, repr=False)

    @abstractmethod
    def look(self) -> ObservedScene:
        """Return what perception sees now."""

    def perform(self, call: BoundCall, *, index: int = 0, total: int = 1) -> SkillResult:
        """Carry out a call, telling of it.

        Args:
            call: Which one.
            index: Its place in its plan, from 0.
            total: Number of the plan's calls.

        Raises:
            SkillError: It did not reach its post-condition; a fault of the code is an InternalError with an id in the log.
            RoboSandboxError: What it works with is at fault, such as a camera.
        """
        self._running, self._phase = call.call, Phase.CHECK
        try:
            self.events.emit(SkillStarted(call.call, index, total))
            result = self._perform(call)
        except SkillError as error:
            self.events.emit(SkillFailed(call.call, error.failure))
            raise
        except RoboSandboxError as error:
            # A camera, a service or a file is at fault: whoever runs the workcell acts on it, and no other plan does.
            failure = Failure(code=ErrorCode.UNAVAILABLE, phase=self._phase, message=str(error))
            self.events.emit(SkillFailed(call.call, failure))
            raise
        except Exception as fault:
            internal = InternalError.log(call.call, fault, _log).with_(phase=self._phase)
            self.events.emit(SkillFailed(call.call, internal.failure))
            raise internal from fault
        finally:
            self._running = None
        self.events.emit(SkillEnded(call.call, result))
        return result

    def entered(self, phase: str) -> None:
        """Tell that the running call enters a phase."""
        if self._running is not None:
            self._phase = phase
            self.events.emit(PhaseEntered(self._running, phase))

    def announce(self, intent: Intent) -> None:
        """Tell what the running call is about to do."""
        if self._running is not None:
            self.events.emit(Intended(self._running, intent))

    @abstractmethod
    def _perform(self, call: BoundCall) -> SkillResult:
        """Carry out a call; raises SkillError."""

    def abilities(self) -> Abilities:
        """Return what is known here of what the robot can do; of one elsewhere what the scene tells."""
        return Abilities()

    def robot(self) -> RobotSpec | None:
        """Return the robot whose calls these are; None of one in another process, whose sim keeps its limits itself."""
        return None

    def all_limits(self) -> list[Limits]:
        """Return the limits that are kept here: the robot's own, and those asked for."""
        return []

    def cameras(self) -> tuple[str, ...]:
        """Return whose pictures can be asked for here: none of a world in another process, which sends its own."""
        return ()

    def capture(self, camera: str) -> RgbdFrame:
        """Return what a camera sees now.

        Raises:
            UnsupportedError: There is no such camera here.
            RenderingError: This machine makes no pictures.
        """
        raise UnsupportedError(f"camera: {camera!r} is not there; there is none")

    def simulate(self, calls: Sequence[BoundCall], *, tick: Callable[[], None] | None = None) -> dict[str, Any]:
        """Return what would come of calls as JSON data, as whoever has the world and a twin of it says.

        Args:
            calls: What to try.
            tick: Called at each control tick of a twin here; a SkillError that it raises ends the trial.

        Raises:
            UnsupportedError: Nobody has one.
        """
        del tick
        said = ", ".join(map(str, calls))
        raise UnsupportedError(f"simulate: nobody has a twin to try {said} on; use `check`")

    def rehearse(self, calls: Sequence[BoundCall]) -> dict[str, Any]:
        """Return what `simulate` does; where the world is here, an arm that then goes otherwise is stopped."""
        return self.simulate(calls)

    def foreseen(self, call: BoundCall) -> Failure | None:
        """Return the failure, with repairs, that a call would end in before it moves anything.

        None where it would begin to move, where its arguments say enough already, and where nobody here can try repairs.
        """
        del call
        return None

    def cancel(self) -> None:
        """Stop what runs, from any thread: it ends in a CancelledError, with the arm holding."""
        self._cancelled.set()

    @contextmanager
    def goal(self, timeout: float | None = None) -> Iterator[None]:
        """Run one goal: an earlier cancel is forgotten, and `timeout` simulated seconds from now it must be done.

        Raises:
            ValueError: The timeout is not positive.
        """
        if timeout is not None and not timeout > 0.0:
            raise ValueError(f"timeout is {timeout}; it takes seconds above 0")
        self._cancelled.clear()
        self._allow(timeout)
        try:
            yield
        finally:
            self._allow(None)
            self._cancelled.clear()

    @abstractmethod
    def _allow(self, timeout: float | None) -> None:
        """Set how many simulated seconds from now what runs may take; None is no limit."""
