"""The grammar first; a model for what the grammar is not sure of."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.protocols import Attempt, Planner
from robosandbox.types import ObservedScene, Plan, Refusal


class AutoPlanner:
    """Asks the second planner about what the first one refuses without being sure, and keeps to it for that prompt.

    A refusal that the first is sure of stands: it understood every word and says why not, or asks what only the person knows.

    Args:
        first: Quick and certain.
        second: Slower, and understands more.
    """

    def __init__(self, first: Planner, second: Planner) -> None:
        self._first = first
        self._second = second
        self._handed_over: str | None = None

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal:
        """Return the first planner's answer, or the second's where the first refuses and is not sure."""
        if history and prompt == self._handed_over:
            return self._second.plan(prompt, scene, history)
        answer = self._first.plan(prompt, scene, history)
        if not isinstance(answer, Refusal) or answer.sure:
            return answer
        self._handed_over = prompt
        return self._second.plan(prompt, scene, history)
