"""A model that always answers with tool calls, whatever its server can be held to: what an agent of pydantic-ai is run on.

pydantic-ai carries the conversation, its history and the results of calls; each of its models speaks one vendor's protocol. What
none of them does is done here: a server that refuses tools is asked for JSON by a schema or for text, what it writes is read in
every usual form, and a form that cannot be read is corrected before the agent hears of it. `Service` keeps retries and the
deadline, since the vendors' libraries each retry in their own way and without one.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import field, replace
from typing import Any, Generic, TypeVar

from pydantic_ai import Agent, ModelRetry, RunContext, StructuredDict, ToolOutput
from pydantic_ai.messages import (
    ModelMessage,
    ModelRequest,
    ModelRequestPart,
    ModelResponse,
    TextPart,
    ThinkingPart,
    ToolCallPart,
    ToolReturnPart,
    UserContent,
    UserPromptPart,
)
from pydantic_ai.models import ModelRequestParameters
from pydantic_ai.models.wrapper import WrapperModel
from pydantic_ai.settings import ModelSettings
from pydantic_ai.tools import ToolDefinition
from pydantic_ai.usage import UsageLimits

from robosandbox.agent.llm.budget import Budget
from robosandbox.agent.llm.forms import Call, MisuseError, NoAnswerError, find_answer
from robosandbox.agent.llm.modes import Mode, after_no_answer, after_refusal
from robosandbox.agent.llm.prompt import data_text, untagged
from robosandbox.agent.llm.service import ModelConnection, ModeRefusedError, Service, run_apart
from robosandbox.agent.usage import count_sent_back
from robosandbox.errors import PlannerAnswerError
from robosandbox.printable import printable
from robosandbox.values import frozen

AnswerT = TypeVar("AnswerT")

NO_LIMITS = UsageLimits(request_limit=None)
"""Limits of one run of an agent: none, since `Budget` counts over all runs of a prompt."""


class Endpoint(WrapperModel):
    """A model at a service, for one run of an agent.

    Args:
        connection: Leads to it.
        instructions: Returns what it is told of its part in a mode.
        exact_tools: What it may call where a server writes by the schema; the agent's tools if empty.
        find: Returns the calls in an answer, given the agent's tools; raises MisuseError.
        turns: Answers asked for in the run, those that cannot be read included.
    """

    def __init__(
        self,
        connection: ModelConnection,
        *,
        instructions: Callable[[Mode], str],
        exact_tools: Sequence[ToolDefinition] = (),
        find: Callable[[ModelResponse, Sequence[ToolDefinition]], Sequence[Call]],
        turns: int,
    ) -> None:
        super().__init__(connection.model)
        self._connection = connection
        self._instructions = instructions
        self._exact_tools = exact_tools
        self._find = find
        self._turns = turns
        self._asked = 0

    async def request(
        self,
        messages: list[ModelMessage],
        model_settings: ModelSettings | None,
        model_request_parameters: ModelRequestParameters,
    ) -> ModelResponse:
        """Return the model's next calls as tool calls.

        Raises:
            PlannerError: The service does not answer, or with nothing that can be read.
            InputError: The service does not know the model or the key.
        """
        del model_settings
        tools = [*model_request_parameters.function_tools, *model_request_parameters.output_tools]
        key, endpoints = self._connection.endpoint_key, self._connection.endpoints
        mode = endpoints.of(key).mode or Mode.SCHEMA
        tried = {mode}
        said: list[ModelMessage] = []
        reason = _last_correction(messages)
        while self._asked < self._turns:
            offered = (self._exact_tools or tools) if mode is Mode.SCHEMA else tools
            try:
                response = await self._connection.ask(self._spoken([*messages, *said], mode), offered, mode)
            except ModeRefusedError as refusal:
                endpoints.forget_mode(key)
                later = after_refusal(tried)
                if later is None:
                    raise PlannerAnswerError(str(refusal)) from None
                mode, said = later, []
                tried.add(mode)
                continue
            self._asked += 1
            try:
                calls = self._find(response, tools)
            except MisuseError as misuse:
                reason = str(misuse)
                count_sent_back(reason)
                # A server that was to hold the model to a form, and did not, is asked in the next way.
                is_loose = isinstance(misuse, NoAnswerError) and mode.binds
                if not is_loose or endpoints.of(key).mode is mode:
                    said += [response, ModelRequest(parts=correction(response, reason))]
                if is_loose:
                    endpoints.forget_mode(key)
                    mode = after_no_answer(tried)
                    tried.add(mode)
                continue
            endpoints.learn(key, mode=mode)
            return _with_calls(response, calls, number=len(messages))
        raise PlannerAnswerError(f"{key[2]}: no usable answer in {self._turns} turns; the last one: {reason[:600]}")

    def _spoken(self, messages: Sequence[ModelMessage], mode: Mode) -> list[ModelMessage]:
        """Return a conversation as a server in this mode takes it, with the instructions that go with it."""
        told = [message if mode.has_tools else _in_text(message) for message in messages]
        last = max(index for index, message in enumerate(told) if isinstance(message, ModelRequest))
        newest = told[last]
        assert isinstance(newest, ModelRequest)
        told[last] = replace(newest, instructions=self._instructions(mode))
        return told


@frozen(kw_only=True)
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
    tools: Sequence[ToolDefinition]
    exact_tools: Sequence[ToolDefinition] = field(default=())
    read: Callable[[Call], AnswerT]


def converse(service: Service, question: Question[AnswerT], *, budgets: Sequence[Budget]) -> AnswerT:
    """Return the first answer of a model that can be used, in at most `max_turns` turns.

    Args:
        service: The model and its endpoint.
        question: What to ask.
        budgets: What may be spent, and what has been.

    Raises:
        PlannerUnavailableError: The service does not answer.
        PlannerAnswerError: It answers with nothing usable.
        InputError: The service does not know the model or the key.
    """

    def read(ctx: RunContext[Any], arguments: Any) -> Any:
        try:
            return question.read(Call(ctx.tool_name or "", arguments))
        except MisuseError as misuse:
            count_sent_back(str(misuse))
            raise ModelRetry(_quotable(str(misuse))) from None

    async def ask() -> AnswerT:
        async with ModelConnection(service, budgets) as connection:
            model = Endpoint(
                connection,
                instructions=question.instructions,
                exact_tools=question.exact_tools,
                find=lambda response, tools: [find_answer(response, tools)],
                turns=turns,
            )
            result = await agent.run(question.content, model=model, usage_limits=NO_LIMITS, infer_name=False)
        answer: AnswerT = result.output
        return answer

    turns = service.settings.max_turns
    outputs = [
        ToolOutput(StructuredDict(tool.parameters_json_schema), name=tool.name, description=tool.description)
        for tool in question.tools
    ]
    agent: Agent[Any, Any] = Agent(output_type=outputs, retries={"output": turns}, name="plan")
    agent.output_validator(read)
    return run_apart(ask())


def _last_correction(messages: Sequence[ModelMessage]) -> str:
    """Return why the last answer of a conversation could not be used; "" where it could."""
    return next(
        (str(p.content) for p in messages[-1].parts if isinstance(p, ToolReturnPart) and p.outcome == "retried"), ""
    )


def _quotable(reason: str) -> str:
    """Return a reason, which may quote ids and what a model wrote, as one line in which no tag can stand."""
    return untagged(printable(reason))


def correction(response: ModelResponse, reason: str) -> list[ModelRequestPart]:
    """Return the reply to an answer that cannot be read: a result for each of its tool calls, as the protocol asks."""
    reason = _quotable(reason)
    calls = [part for part in response.parts if isinstance(part, ToolCallPart)]
    if not calls:
        return [UserPromptPart(content=reason)]
    return [ToolReturnPart(tool_name=call.tool_name, tool_call_id=call.tool_call_id, content=reason) for call in calls]


def _with_calls(response: ModelResponse, calls: Sequence[Call], *, number: int) -> ModelResponse:
    """Return a response whose calls are tool calls; those that were written as text get ids that are the same on a replay."""
    native = [part for part in response.parts if isinstance(part, ToolCallPart)]
    parts = [
        ToolCallPart(
            tool_name=call.name,
            args=_object(call),
            tool_call_id=native[index].tool_call_id if native else f"call_{number}_{index}",
        )
        for index, call in enumerate(calls)
    ]
    return replace(response, parts=[*(part for part in response.parts if not isinstance(part, ToolCallPart)), *parts])


def _object(call: Call) -> dict[str, Any]:
    """Return a call's arguments as an object; what is none is kept, to be told that it is not taken."""
    return call.arguments if isinstance(call.arguments, dict) else {"arguments": call.arguments}


def _in_text(message: ModelMessage) -> ModelMessage:
    """Return a message without tool calls: they, and their results, as text."""
    if isinstance(message, ModelResponse):
        texts = [part for part in message.parts if isinstance(part, TextPart | ThinkingPart)]
        if any(isinstance(part, TextPart) for part in texts):
            return replace(message, parts=texts)
        calls = [
            {"name": part.tool_name, "arguments": part.args} for part in message.parts if isinstance(part, ToolCallPart)
        ]
        return replace(message, parts=[TextPart(content=json.dumps({"calls": calls}))])
    parts: list[ModelRequestPart] = []
    for part in message.parts:
        if isinstance(part, ToolReturnPart) and isinstance(part.content, str):
            parts.append(UserPromptPart(content=part.content))
        elif isinstance(part, ToolReturnPart):
            parts.append(UserPromptPart(content=f"<result>\n{data_text({part.tool_name: part.content})}\n</result>"))
        else:
            parts.append(part)
    return replace(message, parts=parts)
