"""Ways that nobody has tried: what to do next after a failure without repairs, from contracts and evidence alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from robosandbox.agent.candidates import Calls, Candidates
from robosandbox.agent.protocols import Attempt
from robosandbox.errors import Failure
from robosandbox.types import ObservedScene, SkillCall
from robosandbox.world.alternatives import FailedCall
from robosandbox.world.contracts import Contract, error_for, first_refuted
from robosandbox.world.facts import HELD
from robosandbox.world.operators import Operator, bind
from robosandbox.world.predicate import View

# Failures of one kind of one call that are answered with an untried way at most.
_MOST_OF_ONE = 3


class Detours:
    """Untried ways around the last failure of some attempts.

    Args:
        history: The attempts, oldest first.
        scene: What is seen now.
        skills: What may be called, by name; those that promise nothing have no ways.
        held: What the gripper held when the failed call began, as far as is known.
    """

    def __init__(
        self,
        history: Sequence[Attempt],
        scene: ObservedScene,
        skills: Mapping[str, Operator],
        *,
        held: str | None = None,
    ) -> None:
        self._history = history
        self._scene = scene
        self._skills = skills
        self._held = scene.held or held
        self._plan = (history[-1].failed, *history[-1].remaining)
        self._begun = [call for one in history for call in (*one.completed, one.failed)]

    def around_failure(self) -> Calls | None:
        """Return the likeliest way that was not begun yet to what the failed call promised; None where there is none."""
        return self._way(self._plan[0], self._history[-1].error)

    def around_clearing(self) -> tuple[Calls, tuple[SkillCall, ...]] | None:
        """Return another way for a later call for which the failed one was to clear the way, and the calls behind that."""
        for number, call in enumerate(self._plan[1:], start=1):
            error = self._met_by(call)
            calls = None if error is None else self._way(call, error)
            if calls is not None:
                return calls, self._plan[number + 1 :]
        return None

    def _met_by(self, call: SkillCall) -> Failure | None:
        """Return the error that a later call had before, or has now since something stands in its way."""
        before = next((one.error for one in reversed(self._history[:-1]) if one.failed == call), None)
        contract = self._contract(call)
        if before is not None or contract is None:
            return before
        view = View.of(self._scene)
        lacking = first_refuted(contract.resolved(self._scene).needs, view)
        return error_for(*lacking, view).failure if lacking is not None and lacking[1].blocking else None

    def _way(self, call: SkillCall, error: Failure) -> Calls | None:
        contract = self._contract(call)
        last = self._history[-1]
        again = sum(one.failed == last.failed and one.error.code == last.error.code for one in self._history) - 1
        if contract is None or again >= _MOST_OF_ONE:
            return None
        before = self._scene.holding(self._held) if HELD in contract.objects else self._scene
        failure = FailedCall(
            call=call, error=error, contract=contract.resolved(before), before=before, scene=self._scene
        )
        for calls, _ in Candidates(failure, self._skills).likeliest():
            if calls[0] not in self._begun or (calls == (call,) and not again):
                return calls
        return None

    def _contract(self, call: SkillCall) -> Contract | None:
        return bind(call, self._skills).contract if call.skill in self._skills else None
