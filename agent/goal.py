"""What an agent needs of a world, in this process or in another: to look, to hear of phases, to run one goal at a time."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from robosandbox.errors import UnsupportedError
from robosandbox.skills.protocols import Skill
from robosandbox.types import Intent, ObservedScene, Plan
from robosandbox.world.abilities import Abilities


@dataclass(kw_only=True)
class GoalContext(ABC):
    """A world in which an agent runs goals, one at a time.

    Attributes:
        listeners: Called with each phase that begins, in the thread that runs the skill or waits for it.
        intent_listeners: Called with what a skill is about to do, in the same thread.
        skills: What the agent here can call, by name: repairs are made of it.
    """

    listeners: list[Callable[[str], None]] = field(default_factory=list, init=False, repr=False)
    intent_listeners: list[Callable[[Intent], None]] = field(default_factory=list, init=False, repr=False)
    skills: Mapping[str, Skill[Any]] = field(default_factory=dict, init=False, repr=False)
    _cancelled: threading.Event = field(default_factory=threading.Event, init=False, repr=False)

    @abstractmethod
    def look(self) -> ObservedScene:
        """Return what perception sees now."""

    def abilities(self) -> Abilities:
        """Return what is known here of what the robot can do; of one elsewhere what the scene tells."""
        return Abilities()

    def simulate(self, plan: Plan) -> dict[str, Any]:
        """Return what would come of a plan, as whoever has the world and a twin of it says.

        Raises:
            UnsupportedError: Nobody has one.
        """
        raise UnsupportedError(f"simulate: nobody has a twin to try {plan} on; use `check`")

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
