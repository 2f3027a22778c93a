"""Planners as the agent asks them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from robosandbox.errors import SkillError
    from robosandbox.types import ObservedScene, Plan, Refusal, SkillCall


class Attempt(Protocol):
    """A plan that ended early."""

    @property
    def completed(self) -> Sequence[SkillCall]: ...
    @property
    def failed(self) -> SkillCall: ...
    @property
    def remaining(self) -> Sequence[SkillCall]:
        """The plan's calls after the failed one, which were not begun."""
        ...

    @property
    def error(self) -> SkillError: ...


@runtime_checkable
class Planner(Protocol):
    """From a sentence to skill calls; a PlannerError where there is no answer."""

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal: ...
