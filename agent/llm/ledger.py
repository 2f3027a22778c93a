"""Ledger of a prompt: its cost, the last success, and what is still due before it may be called done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from robosandbox.agent.course import PromptDone, Report
from robosandbox.agent.llm.budget import Budget
from robosandbox.agent.tools import FinishArguments, not_holding, relations
from robosandbox.types import ObservedScene, Plan
from robosandbox.world.operators import Operator, bind
from robosandbox.world.verifier import Constraints


class PromptLedger:
    """The state of a prompt that is carried out call by call.

    Args:
        skills: What can be called, by name.
        budgets: What may be spent.
        note: What later prompts are told of this one; calls that succeed are added.

    Attributes:
        due: What every plan for the prompt keeps to.
        failed: The last call, where it failed.
    """

    def __init__(self, skills: Mapping[str, Operator], budgets: Sequence[Budget], note: dict[str, Any]) -> None:
        self._skills = skills
        self._budgets = tuple(budgets)
        self._note = note
        self.due: Constraints = Constraints()
        self.failed: str | None = None
        self._succeeded = 0
        self._moved: set[str] = set()

    @property
    def of_each_call(self) -> Constraints:
        """Constraints that each call keeps; what is to be moved in all cannot be asked of one."""
        return replace(self.due, moved=frozenset(), fewest=0)

    def over_budget(self, plan: Plan) -> str:
        """Return which limit of calls a plan would break; "" for none."""
        over = (one for one in self._budgets if len(plan.steps) > one.left("steps"))
        return next((f"steps: at most {one.limits.steps} calls are carried out for a {one.of}" for one in over), "")

    def take(self, report: Report) -> None:
        """Note what came of calls that were begun."""
        begun = len(report.steps) + (report.failure is not None)
        for budget in self._budgets:
            budget.add(steps=begun)
        for step in report.steps:
            self._moved |= {*bind(step.call, self._skills).contract.moves}
            self._note["calls"].append(str(step.call))
        self._succeeded += len(report.steps)
        self.failed = None if report.failure is None else str(report.failure.failed)

    def finished(self, given: FinishArguments, scene: ObservedScene) -> PromptDone | dict[str, Any]:
        """Return the end, unless what was asked or measured speaks against it.

        Raises:
            InputError: What is said to hold is no relation.
        """
        if self.failed is not None:
            return {"ok": False, "error": f"{self.failed} failed and nothing has succeeded since: mend it, or refuse"}
        facts = relations(given.holds)
        wrong = not_holding(facts, scene)
        if wrong:
            return {"ok": False, "error": "that does not hold", "not_holding": wrong}
        if not self._succeeded and not facts:
            return {"ok": False, "error": "holds: nothing was done; list the relations that hold already, or refuse"}
        dealt_with = self._moved | {str(name) for fact in facts for name in fact.arguments}
        seen = {item.id for item in scene.objects}
        left = sorted(self.due.moved - dealt_with)
        if left or len(dealt_with & seen) < self.due.fewest:
            due = ", ".join(left) or f"at least {self.due.fewest} things"
            error = f"the request asks to move {due}; do it, list what holds already, or refuse"
            return {"ok": False, "error": error}
        return PromptDone(summary=given.summary)
