"""The twin as gate: each plan is tried on the twin before anything moves, shown, and confirmed or refused."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from robosandbox.agent.preview import preview_lines
from robosandbox.errors import CollisionError, Failure, RefusedPromptError
from robosandbox.progress import doing
from robosandbox.types import Plan, SkillCall
from robosandbox.world.operators import bind

if TYPE_CHECKING:
    from robosandbox.agent.agent import Agent

# What people answer to "carry it out?".
_YES = frozenset({"yes", "y", "yes please", "ok", "okay", "go ahead", "do it", "carry it out", "ja"})
_NO = frozenset({"no", "n", "no thanks", "don't", "do not", "leave it", "nein"})


class UnconfirmedError(RefusedPromptError):
    """A plan waits for a person's yes, which the next sentence may be; the message shows it and asks."""


class Gate:
    """Tries plans on the twin, and lets those pass that a person has confirmed.

    Where nobody can be asked, those pass that work there and touch nothing but what they name. What moves nothing passes.

    Args:
        agent: Whose plans. While it `takes_answers`, a plan waits for the next sentence.
        refuses: Whether plans are refused here where nobody can be asked; not where the process does so that has the world.

    Attributes:
        ask: Shows a person lines about a plan, and returns whether it is to be carried out; None where nobody is there.
    """

    def __init__(self, agent: Agent[Any], *, refuses: bool = True) -> None:
        self._agent = agent
        self._refuses = refuses
        self.ask: Callable[[Sequence[str]], bool] | None = None

    def of(self, agent: Agent[Any]) -> Gate:
        """Return the gate of another agent, with the same person before it."""
        gate = Gate(agent, refuses=self._refuses)
        gate.ask = self.ask
        return gate

    def __call__(self, plan: Plan) -> bool:
        """Return whether a plan may be carried out.

        Raises:
            UnconfirmedError: The next sentence may say so.
            SkillError: It fails on the twin, or touches there what it does not name, and nobody can be asked.
        """
        agent = self._agent
        if self.ask is None and not agent.takes_answers and not self._refuses:
            return True
        sets = plan.tempo and "set_tempo" in agent.calls
        tempo = [SkillCall(skill="set_tempo", arguments={"tempo": plan.tempo})] if sets else []
        with doing("trying the plan on the twin"):
            told = agent.ctx.rehearse([bind(call, agent.calls) for call in (*tempo, *plan.steps)])
        if told.get("ok") and not told.get("moves", True):
            return True
        if self.ask is not None:
            confirmed = self.ask(preview_lines(told))
            agent.ctx.confirmed = confirmed
            return confirmed
        if agent.takes_answers:
            raise UnconfirmedError(f"on the twin: {'; '.join(preview_lines(told))}; carry it out? say yes or no")
        _refuse(told)
        return True


def answer_to_question(sentence: str) -> bool | None:
    """Return whether a sentence says yes or no; None where it says something else."""
    said = sentence.strip().lower().rstrip(".!")
    return True if said in _YES else False if said in _NO else None


def _refuse(told: Mapping[str, Any]) -> None:
    """Raise what speaks against a plan on the twin, if something does."""
    if not told.get("ok"):
        failure = Failure.model_validate(told["error"])
        message = f"not carried out: on the twin {told['would_fail']} would fail: {failure.message}"
        # Repairs were tried on a twin that had gone on from here.
        raise failure.model_copy(update={"message": message, "repairs": ()}).exception()
    if touched := told.get("would_touch"):
        raise CollisionError(
            f"not carried out: on the twin it would touch {', '.join(touched)}, which no call names; clear the way, or have a "
            "person confirm it"
        )
