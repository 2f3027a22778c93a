"""Planners as the agent asks them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from robosandbox.world.alternatives import Attempt as Attempt

if TYPE_CHECKING:
    from robosandbox.types import ObservedScene, Plan, Refusal


@runtime_checkable
class Planner(Protocol):
    """From a sentence to skill calls; a PlannerError where there is no answer."""

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal: ...
