"""Asking a model until its answer can be used: in the mode that the server keeps, and with what was wrong as a correction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from pydantic_ai.messages import (
    ModelMessage,
    ModelRequest,
    ModelRequestPart,
    UserContent,
    UserPromptPart,
)

from robosandbox.agent.llm.budget import Budget
from robosandbox.agent.llm.cassette import Player
from robosandbox.agent.llm.endpoint import correction
from robosandbox.agent.llm.forms import Call, MisuseError, NoAnswerError, Tool, find_answer
from robosandbox.agent.llm.modes import KnownModes, Mode
from robosandbox.agent.llm.service import ModeRefusedError, Service, run_apart
from robosandbox.agent.llm.settings import LLMSettings
from robosandbox.errors import PlannerAnswerError

AnswerT = TypeVar("AnswerT")


@dataclass(frozen=True, slots=True, kw_only=True)
class Question(Generic[AnswerT]):
    """What a model is asked.

    Attributes:
        instructions: What it is told of its part, by the mode in which it is to answer.
        content: What it is asked: text, and a picture where it sees.
        tools: What it may answer with.
        exact_tools: The same where a server writes by the schema; `tools` if empty.
        read: Turns a call into what is wanted; raises MisuseError with what is wrong with it.
    """

    instructions: Callable[[Mode], str]
    content: Sequence[UserContent]
    tools: Sequence[Tool]
    exact_tools: Sequence[Tool] = field(default=())
    read: Callable[[Call], AnswerT]


def converse(
    settings: LLMSettings,
    player: Player | None,
    modes: KnownModes,
    question: Question[AnswerT],
    *,
    budgets: Sequence[Budget],
) -> AnswerT:
    """Return the first answer of a model that can be used, in at most `settings.max_turns` turns.

    Args:
        settings: Model, endpoint and limits.
        player: A cassette to answer from in place of the endpoint.
        modes: What is known of endpoints; what is learnt is added.
        question: What to ask.
        budgets: What may be spent, and what has been.

    Raises:
        PlannerUnavailableError: The service does not answer.
        PlannerAnswerError: It answers with nothing usable.
        InputError: The service does not know the model or the key.
    """
    return run_apart(_turns(settings, player, modes, question, budgets))


async def _turns(
    settings: LLMSettings,
    player: Player | None,
    modes: KnownModes,
    question: Question[AnswerT],
    budgets: Sequence[Budget],
) -> AnswerT:
    reason = ""
    async with Service(settings, player, budgets) as service:
        mode = modes.best(settings, service.url)
        said: list[ModelMessage] = []
        turn = 0
        while turn < settings.max_turns:
            asked = _request([UserPromptPart(content=list(question.content))], question, mode)
            tools = question.exact_tools or question.tools if mode is Mode.SCHEMA else question.tools
            try:
                response = await service.ask([asked, *said], tools, mode)
            except ModeRefusedError as refusal:
                later = mode.next
                if later is None:
                    raise PlannerAnswerError(str(refusal)) from None
                mode, said = later, []
                continue
            turn += 1
            try:
                call = find_answer(response, question.tools)
                modes.remember(settings, service.url, mode)
                return question.read(call)
            except MisuseError as misuse:
                reason, later = str(misuse), mode.next
                kept = not isinstance(misuse, NoAnswerError) or modes.works(settings, service.url, mode)
                if later is not None and not kept:
                    # A server that was to hold the model to a form, and did not, is asked in the next way.
                    mode, said = later, []
                    continue
                said += [response, _request(correction(response, reason), question, mode)]
    raise PlannerAnswerError(
        f"{settings.model}: no usable answer in {settings.max_turns} turns; the last one: {reason[:600]}"
    )


def _request(parts: Sequence[ModelRequestPart], question: Question[AnswerT], mode: Mode) -> ModelRequest:
    return ModelRequest(parts=parts, instructions=question.instructions(mode))
