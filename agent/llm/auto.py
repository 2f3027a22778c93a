"""The grammar first; a model for what it does not understand."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.protocols import Attempt, Planner
from robosandbox.types import ObservedScene, Plan, Refusal, RefusalCode


class AutoPlanner:
    """Asks the second planner about what the first one refuses as unrecognized, and keeps to it for that prompt.

    Every other refusal of the first stands: it understood and says why not.

    Args:
        first: Quick and certain.
        second: Slower, and understands more.
    """

    def __init__(self, first: Planner, second: Planner) -> None:
        self._first = first
        self._second = second
        self._handed_over: str | None = None

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal:
        """Return the first planner's answer, or the second's where the first does not understand."""
        if history and prompt == self._handed_over:
            return self._second.plan(prompt, scene, history)
        answer = self._first.plan(prompt, scene, history)
        if not isinstance(answer, Refusal) or answer.code is not RefusalCode.UNRECOGNIZED:
            return answer
        self._handed_over = prompt
        return self._second.plan(prompt, scene, history)
