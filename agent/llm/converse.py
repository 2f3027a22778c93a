"""One question to a model, asked until its answer can be used, with what was wrong as a correction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from pydantic_ai.messages import ModelMessage, ModelRequest, ToolCallPart, UserContent, UserPromptPart

from robosandbox.agent.llm.budget import Budget
from robosandbox.agent.llm.cassette import Player
from robosandbox.agent.llm.endpoint import AnswerRequest, Endpoint, correction
from robosandbox.agent.llm.endpoint_capabilities import EndpointCache
from robosandbox.agent.llm.forms import AnswerTool, Call, MisuseError, find_answer
from robosandbox.agent.llm.modes import Mode
from robosandbox.agent.llm.service import Service, run_apart
from robosandbox.agent.llm.settings import LLMSettings
from robosandbox.agent.usage import count_sent_back

AnswerT = TypeVar("AnswerT")


@dataclass(frozen=True, slots=True, kw_only=True)
class Question(Generic[AnswerT]):
    """Question to a model.

    Attributes:
        instructions: What it is told of its part, by the mode in which it is to answer.
        content: What it is asked: text, and a picture where it sees.
        tools: What it may answer with.
        exact_tools: The same where a server writes by the schema; `tools` if empty.
        read: Turns a call into what is wanted; raises MisuseError with what is wrong with it.
    """

    instructions: Callable[[Mode], str]
    content: Sequence[UserContent]
    tools: Sequence[AnswerTool]
    exact_tools: Sequence[AnswerTool] = field(default=())
    read: Callable[[Call], AnswerT]


def converse(
    settings: LLMSettings,
    player: Player | None,
    endpoints: EndpointCache,
    question: Question[AnswerT],
    *,
    budgets: Sequence[Budget],
) -> AnswerT:
    """Return the first answer of a model that can be used, in at most `settings.max_turns` turns.

    Args:
        settings: Model, endpoint and limits.
        player: A cassette to answer from in place of the endpoint.
        endpoints: Capabilities of endpoints; what is learnt is added.
        question: What to ask.
        budgets: What may be spent, and what has been.

    Raises:
        PlannerUnavailableError: The service does not answer.
        PlannerAnswerError: It answers with nothing usable.
        InputError: The service does not know the model or the key.
    """
    return run_apart(_turns(settings, player, endpoints, question, budgets))


async def _turns(
    settings: LLMSettings,
    player: Player | None,
    endpoints: EndpointCache,
    question: Question[AnswerT],
    budgets: Sequence[Budget],
) -> AnswerT:
    asked = AnswerRequest(
        instructions=question.instructions,
        tools=question.tools,
        exact_tools=question.exact_tools or question.tools,
        find=lambda response: [find_answer(response, question.tools)],
        turns=settings.max_turns,
    )
    said: list[ModelMessage] = [ModelRequest(parts=[UserPromptPart(content=list(question.content))])]
    reason = ""
    async with Service(settings, player, budgets, endpoints) as service:
        endpoint = Endpoint(service, endpoints, asked)
        while True:
            response = await endpoint.calls(said, reason=reason)
            call = next(part for part in response.parts if isinstance(part, ToolCallPart))
            try:
                return question.read(Call(call.tool_name, call.args))
            except MisuseError as misuse:
                reason = str(misuse)
                count_sent_back(reason)
                said += [response, ModelRequest(parts=correction(response, reason))]
