"""The interface of a loaded task that the service serves: world, skills, reset, checkpoint, restore."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Protocol

from pydantic import BaseModel

from robosandbox.protocols import Driver, Skill, SkillContext
from robosandbox.service.messages import Load
from robosandbox.service.server.checkpoint import Checkpoint
from robosandbox.types import SkillCall


class GoalContext(SkillContext, Protocol):
    """What skills use, with a way to stop them."""

    @property
    def phase(self) -> str:
        """The phase that began last."""
        ...

    def permit(self, call: SkillCall) -> None:
        """Check a call against the limits before anything moves; raises SkillError."""
        ...

    def cancel(self) -> None:
        """Stop what runs, from any thread."""
        ...

    def goal(self, timeout: float | None = None) -> AbstractContextManager[None]:
        """Run one goal, within `timeout` simulated seconds."""
        ...


class ServedTask(Protocol):
    """A loaded task."""

    @property
    def sim(self) -> Driver:
        """The world."""
        ...

    @property
    def ctx(self) -> GoalContext:
        """What skills use in it."""
        ...

    @property
    def skills(self) -> Sequence[Skill]:
        """What the robot can do."""
        ...

    @property
    def task(self) -> BaseModel:
        """The task as its YAML would have it."""
        ...

    @property
    def seed(self) -> int:
        """The layout."""
        ...

    def reset(self, seed: int = 0) -> None:
        """Start over; raises InputError."""
        ...

    def checkpoint(self) -> Checkpoint:
        """Return the world as it is."""
        ...

    def restore(self, checkpoint: Checkpoint) -> None:
        """Go back; raises InputError."""
        ...

    def close(self) -> None:
        """Free the world."""
        ...


# Returns another loaded task, calling the second argument often on the way; raises InputError, and what that raises.
OpenTask = Callable[[Load, Callable[[], None]], ServedTask]
