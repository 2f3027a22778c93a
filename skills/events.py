"""Events of a skill's run, and the stream that a workcell tells them in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from robosandbox.errors import Failure
from robosandbox.types import Intent, SkillCall, SkillResult
from robosandbox.values import frozen


@frozen
class SkillStarted:
    """A call begins; `index` counts from 0 within a plan of `total` calls."""

    call: SkillCall
    index: int = 0
    total: int = 1


@frozen
class PhaseEntered:
    """The running skill enters a phase."""

    call: SkillCall
    phase: str


@frozen
class Intended:
    """The running skill is about to follow a path, or has weighed how to hold something."""

    call: SkillCall
    intent: Intent


@frozen
class SkillEnded:
    """A call reached its post-condition."""

    call: SkillCall
    result: SkillResult


@frozen
class SkillFailed:
    """A call ended in an error."""

    call: SkillCall
    error: Failure


SkillEvent = SkillStarted | PhaseEntered | Intended | SkillEnded | SkillFailed


class EventStream:
    """Tells events to whoever listens, in the thread in which they happen.

    A listener that raises a SkillError at `SkillStarted` keeps that call from being made.
    """

    def __init__(self) -> None:
        self._listeners: list[Callable[[Any], None]] = []

    def __len__(self) -> int:
        return len(self._listeners)

    def subscribe(self, listener: Callable[[Any], None]) -> Callable[[], None]:
        """Have `listener` called with each event; return what ends that."""
        self._listeners.append(listener)

        def end() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return end

    def emit(self, event: object) -> None:
        """Tell an event."""
        for listener in tuple(self._listeners):
            listener(event)
