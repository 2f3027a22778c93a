"""Orders to a workcell beside single calls, the same at each of its faces: sentences, plans, goals, trials, verdicts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pydantic import Field, ValidationError

from robosandbox.agent.episode import Episode
from robosandbox.agent.tools import (
    AchieveArguments,
    CheckArguments,
    SimulateArguments,
    Steps,
    checked,
    error_data,
    relations,
    wrong_arguments,
)
from robosandbox.errors import Failure, InputError, InvalidArgumentError, PlannerError, RefusedPromptError
from robosandbox.types import MAX_PROMPT_LENGTH, Plan, Refusal, StrictModel
from robosandbox.values import frozen
from robosandbox.workcell.workcell import Workcell

_STOP_WORDS = frozenset({"stop", "halt", "stop it"})


class RunArguments(StrictModel):
    """Carry out a sentence with the workcell's planner: plans, looks, plans anew after failures."""

    prompt: str = Field(description="What the person said.", min_length=1, max_length=MAX_PROMPT_LENGTH)


class PlanArguments(StrictModel):
    """Turn a sentence into skill calls or a refusal, with the workcell's planner; nothing moves."""

    prompt: str = Field(description="What the person said.", min_length=1, max_length=MAX_PROMPT_LENGTH)


class FollowArguments(StrictModel):
    """Carry out skill calls as they are; a failure ends it."""

    steps: Steps


class UndoArguments(StrictModel):
    """Go back to before the last order, call or reset that changed something; what came of it is lost."""


class RecoverArguments(StrictModel):
    """End a fault that has stopped the arm, once somebody has looked after what was the matter; nothing moves."""


class JudgeArguments(StrictModel):
    """Ask whether the task has succeeded since the last reset, by the simulated state; time may pass while it is watched."""


@frozen
class OrderResult:
    """Result of an order.

    Attributes:
        data: As JSON data.
        failure: Why it was not carried out; None where it was.
    """

    data: dict[str, Any]
    failure: Failure | None = None


@frozen
class OrderKind:
    """A kind of order.

    Attributes:
        arguments: What it takes; the docstring is its description.
        carry_out: Does it in a workcell, within a goal of its context.
        moves: Whether the robot or the world may move.
        undoes: Whether what was done may be lost: the world is put into an earlier state.
    """

    arguments: type[StrictModel]
    carry_out: Callable[[Workcell, Any], OrderResult]
    moves: bool = False
    undoes: bool = False


@frozen
class BoundOrder:
    """An order whose arguments are checked.

    Attributes:
        name: Its kind, a key of `ORDERS`.
        arguments: An instance of what that takes.
    """

    name: str
    arguments: StrictModel

    @property
    def kind(self) -> OrderKind:
        """What kind of order it is."""
        return ORDERS[self.name]

    def carry_out(self, cell: Workcell) -> OrderResult:
        """Do it, within a goal of the cell's context.

        Raises:
            SkillError: It cannot be done, or the planner has no answer.
        """
        try:
            return self.kind.carry_out(cell, self.arguments)
        except InputError as error:
            raise InvalidArgumentError(f"{self.name}: {error}") from None
        except PlannerError as error:
            raise RefusedPromptError(f"{self.name}: {error}") from None


def bind_order(name: str, arguments: Mapping[str, Any]) -> BoundOrder:
    """Return an order of `ORDERS` with its arguments checked.

    Raises:
        InvalidArgumentError: It takes others.
    """
    kind = ORDERS[name].arguments
    try:
        return BoundOrder(name, kind.model_validate(dict(arguments)))
    except ValidationError as error:
        raise InvalidArgumentError(wrong_arguments(name, error, kind)) from None


def says_stop(sentence: str) -> bool:
    """Tell whether who says this while something moves wants it to stop."""
    return sentence.strip().lower().rstrip(".!") in _STOP_WORDS


def planned(answer: Plan | Refusal) -> dict[str, Any]:
    """Return a planner's answer as `robo-sandbox plan --json` prints it, without what is empty."""
    dump = answer.model_dump(mode="json")
    if isinstance(answer, Refusal):
        return {"plan": None, "refusal": dump}
    return {
        "plan": dump["steps"],
        "refusal": None,
        **{name: dump[name] for name in ("answer", "then", "note") if dump[name]},
    }


def ended(episode: Episode) -> OrderResult:
    """Return what came of a prompt or of goals: what was done, what was answered, and why it ended."""
    data = {
        "success": episode.success,
        "reason": episode.final_reason.value,
        "detail": episode.final_detail,
        "answer": episode.answer,
        "done": [
            {"call": str(step.call), **step.result.model_dump(mode="json", exclude={"skill"})} for step in episode.steps
        ],
        "refusal": episode.refusal.model_dump(mode="json") if episode.refusal else None,
        "error": error_data(episode.error) if episode.error else None,
    }
    if episode.success:
        return OrderResult(data)
    return OrderResult(data, episode.error or RefusedPromptError(episode.final_detail).failure)


def _achieved(cell: Workcell, arguments: AchieveArguments) -> OrderResult:
    # What is no relation would be taken for a sentence.
    goals = relations(arguments.goals)
    return ended(cell.agent.run(", ".join(map(str, goals))))


def _judged(cell: Workcell) -> OrderResult:
    verdict = cell.judge()
    return OrderResult({"success": verdict.success, "detail": dict(verdict.detail)})


ORDERS: dict[str, OrderKind] = {
    "run": OrderKind(
        RunArguments, lambda cell, given: ended(cell.agent.run(given.prompt, takes_answers=True)), moves=True
    ),
    "follow": OrderKind(
        FollowArguments, lambda cell, given: ended(cell.agent.follow(Plan(steps=given.steps))), moves=True
    ),
    "achieve": OrderKind(AchieveArguments, _achieved, moves=True),
    "plan": OrderKind(PlanArguments, lambda cell, given: OrderResult(planned(cell.agent.plan(given.prompt)))),
    "check": OrderKind(
        CheckArguments,
        lambda cell, given: OrderResult(checked(Plan(steps=given.steps), cell.observe(), list(cell.calls.values()))),
    ),
    "simulate": OrderKind(
        SimulateArguments,
        lambda cell, given: OrderResult(cell.simulate(Plan(steps=given.steps))),
    ),
    "undo": OrderKind(UndoArguments, lambda cell, given: OrderResult({"undone": cell.undo()}), moves=True, undoes=True),
    "recover": OrderKind(RecoverArguments, lambda cell, given: OrderResult({"fault": cell.recover()})),
    "judge": OrderKind(JudgeArguments, lambda cell, given: _judged(cell)),
}
"""The kinds of orders, by name."""
