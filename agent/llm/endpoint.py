"""A model that always answers with tool calls, whatever its server can be held to: what an agent of pydantic-ai is run on.

pydantic-ai carries the conversation, its history and the results of calls; each of its models speaks one vendor's protocol. What
none of them does is done here: a server that refuses tools is asked for JSON by a schema or for text, what it writes is read in
every usual form, and a form that cannot be read is corrected before the agent hears of it. `Service` keeps retries and the
deadline, since the vendors' libraries each retry in their own way and without one.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pydantic_ai.messages import (
    ModelMessage,
    ModelRequest,
    ModelRequestPart,
    ModelResponse,
    TextPart,
    ThinkingPart,
    ToolCallPart,
    ToolReturnPart,
    UserPromptPart,
)
from pydantic_ai.models import ModelRequestParameters
from pydantic_ai.models.wrapper import WrapperModel
from pydantic_ai.settings import ModelSettings

from robosandbox.agent.llm.endpoint_capabilities import EndpointCache
from robosandbox.agent.llm.forms import AnswerTool, Call, MisuseError, NoAnswerError
from robosandbox.agent.llm.modes import Mode, after_no_answer, after_refusal
from robosandbox.agent.llm.prompt import data_text, untagged
from robosandbox.agent.llm.service import ModeRefusedError, Service
from robosandbox.agent.usage import count_sent_back
from robosandbox.errors import PlannerAnswerError
from robosandbox.printable import printable


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerRequest:
    """Request to a model besides the conversation.

    Attributes:
        instructions: Of its part, by the mode in which it is to answer.
        tools: What it may call.
        exact_tools: The same for a server that writes by a schema.
        find: Reads the calls in an answer; raises MisuseError.
        turns: Answers asked for, those that cannot be read included.
    """

    instructions: Callable[[Mode], str]
    tools: Sequence[AnswerTool]
    exact_tools: Sequence[AnswerTool]
    find: Callable[[ModelResponse], Sequence[Call]]
    turns: int


class Endpoint(WrapperModel):
    """A model at a service, for one run of an agent.

    Args:
        service: Where it is.
        endpoints: Capabilities of endpoints; what is learnt is added.
        asked: What it is told and may call.
    """

    def __init__(self, service: Service, endpoints: EndpointCache, asked: AnswerRequest) -> None:
        super().__init__(service.model)
        self._service = service
        self._endpoints = endpoints
        self._asked = asked
        self._turns = 0

    async def request(
        self,
        messages: list[ModelMessage],
        model_settings: ModelSettings | None,
        model_request_parameters: ModelRequestParameters,
    ) -> ModelResponse:
        """Return the model's next calls.

        Raises:
            PlannerError: The service does not answer, or with nothing that can be read.
            InputError: The service does not know the model or the key.
        """
        del model_settings, model_request_parameters
        return await self.calls(messages)

    async def calls(self, messages: Sequence[ModelMessage], *, reason: str = "") -> ModelResponse:
        """Return the model's next calls as tool calls; `reason` is why its answer before could not be used.

        Raises:
            PlannerError: The service does not answer, or with nothing that can be read.
            InputError: The service does not know the model or the key.
        """
        key = self._service.endpoint_key
        mode = self._endpoints.of(key).mode or Mode.SCHEMA
        tried = {mode}
        said: list[ModelMessage] = []
        while self._turns < self._asked.turns:
            tools = self._asked.exact_tools if mode is Mode.SCHEMA else self._asked.tools
            try:
                response = await self._service.ask(self._spoken([*messages, *said], mode), tools, mode)
            except ModeRefusedError as refusal:
                self._endpoints.forget_mode(key)
                later = after_refusal(tried)
                if later is None:
                    raise PlannerAnswerError(str(refusal)) from None
                mode, said = later, []
                tried.add(mode)
                continue
            self._turns += 1
            try:
                calls = self._asked.find(response)
            except MisuseError as misuse:
                reason = str(misuse)
                count_sent_back(reason)
                # A server that was to hold the model to a form, and did not, is asked in the next way.
                is_loose = isinstance(misuse, NoAnswerError) and mode.binds
                if not is_loose or self._endpoints.of(key).mode is mode:
                    said += [response, ModelRequest(parts=correction(response, reason))]
                if is_loose:
                    self._endpoints.forget_mode(key)
                    mode = after_no_answer(tried)
                    tried.add(mode)
                continue
            self._endpoints.learn(key, mode=mode)
            return _with_calls(response, calls, number=len(messages))
        raise PlannerAnswerError(
            f"{key[2]}: no usable answer in {self._asked.turns} turns; the last one: {reason[:600]}"
        )

    def _spoken(self, messages: Sequence[ModelMessage], mode: Mode) -> list[ModelMessage]:
        """Return a conversation as a server in this mode takes it, with the instructions that go with it."""
        told = [message if mode.has_tools else _in_text(message) for message in messages]
        last = max(index for index, message in enumerate(told) if isinstance(message, ModelRequest))
        newest = told[last]
        assert isinstance(newest, ModelRequest)
        told[last] = replace(newest, instructions=self._asked.instructions(mode))
        return told


def correction(response: ModelResponse, reason: str) -> list[ModelRequestPart]:
    """Return the reply to an answer that cannot be used: a result for each of its tool calls, as the protocol asks.

    A reason may quote ids and what the model wrote: no tag can stand in it, and no line of its own.
    """
    reason = untagged(printable(reason))
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
