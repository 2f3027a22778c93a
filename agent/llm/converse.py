"""Asking a model until its answer can be used: what is wrong with one goes back to it as the result of its tool calls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from pydantic_ai.messages import (
    ModelMessage,
    ModelRequest,
    ModelRequestPart,
    ModelResponse,
    ToolCallPart,
    ToolReturnPart,
    UserContent,
    UserPromptPart,
)
from pydantic_ai.tools import ToolDefinition

from robosandbox.agent.llm.answer import MisuseError
from robosandbox.agent.llm.cassette import Player
from robosandbox.agent.llm.service import Service, run_apart
from robosandbox.agent.llm.settings import LLMSettings
from robosandbox.errors import PlannerAnswerError

AnswerT = TypeVar("AnswerT")


def converse(
    settings: LLMSettings,
    player: Player | None,
    *,
    instructions: str,
    content: Sequence[UserContent],
    tools: Sequence[ToolDefinition],
    read: Callable[[ModelResponse], AnswerT],
) -> AnswerT:
    """Return the first answer of a model that can be read, in at most `settings.max_turns` turns.

    Args:
        settings: Model, endpoint and limits.
        player: A cassette to answer from in place of the endpoint.
        instructions: What the model is told of its part.
        content: What it is asked: text, and a picture where it sees.
        tools: How it may answer.
        read: Turns an answer into what is wanted; raises MisuseError with what is wrong with it.

    Raises:
        PlannerUnavailableError: The service does not answer.
        PlannerAnswerError: It answers with nothing usable.
        InputError: The service does not know the model or the key.
    """

    def request(parts: Sequence[ModelRequestPart]) -> ModelRequest:
        return ModelRequest(parts=parts, instructions=instructions)

    async def turns() -> AnswerT:
        messages: list[ModelMessage] = [request([UserPromptPart(content=list(content))])]
        reason = ""
        async with Service(settings, player) as service:
            for _ in range(settings.max_turns):
                response = await service.ask(messages, list(tools))
                try:
                    return read(response)
                except MisuseError as misuse:
                    reason = str(misuse)
                    messages += [response, request(_correction(response, reason))]
        raise PlannerAnswerError(
            f"{settings.model}: no usable answer in {settings.max_turns} turns; the last one: {reason[:600]}"
        )

    return run_apart(turns())


def _correction(response: ModelResponse, reason: str) -> list[ModelRequestPart]:
    """Return the reply to a misused answer: a result for each of its tool calls, as the protocol asks."""
    calls = [part for part in response.parts if isinstance(part, ToolCallPart)]
    if not calls:
        return [UserPromptPart(content=reason)]
    return [ToolReturnPart(tool_name=call.tool_name, tool_call_id=call.tool_call_id, content=reason) for call in calls]
