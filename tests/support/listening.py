"""Listeners of tests: to the phases of skills and to the calls that begin."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from robosandbox.skills.events import EventStream, PhaseEntered, SkillStarted
from robosandbox.types import SkillCall


def on_phases(events: EventStream, do: Callable[[str], Any]) -> Callable[[], None]:
    """Call `do` with each phase that begins; return what ends that."""
    return events.subscribe(lambda event: do(event.phase) if isinstance(event, PhaseEntered) else None)


def on_calls(events: EventStream, do: Callable[[SkillCall], Any]) -> Callable[[], None]:
    """Call `do` with each call before it is made; return what ends that."""
    return events.subscribe(lambda event: do(event.call) if isinstance(event, SkillStarted) else None)
