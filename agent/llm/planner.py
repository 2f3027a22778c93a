"""A planner that asks a language model and believes nothing that it does not check."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic_ai.messages import (
    BinaryContent,
    ModelMessage,
    ModelRequest,
    ModelRequestPart,
    ModelResponse,
    ToolCallPart,
    ToolReturnPart,
    UserContent,
    UserPromptPart,
)

from robosandbox.agent.agent import check_prompt
from robosandbox.agent.llm.answer import MisuseError, read_answer, tools
from robosandbox.agent.llm.prompt import INSTRUCTIONS, question
from robosandbox.agent.llm.service import Service, open_cassette, png, run_apart
from robosandbox.agent.llm.settings import LLMSettings
from robosandbox.errors import PlannerAnswerError
from robosandbox.protocols import Attempt, Skill
from robosandbox.types import ObservedScene, Plan, Refusal


class LLMPlanner:
    """Plans by asking a model, each time from the request, the scene as it is now and what has failed.

    An answer that is no plan that can be right and no refusal goes back to the model with the reason, up to `max_turns`.

    Args:
        skills: What plans may call.
        settings: Model, endpoint and limits.

    Raises:
        InputError: A key is missing, or the cassette cannot be used.
    """

    def __init__(self, skills: Sequence[Skill[Any]], settings: LLMSettings) -> None:
        self._skills = tuple(skills)
        self._tools = tools(self._skills)
        self._settings = settings
        self._player = open_cassette(settings)

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal:
        """Return the model's plan, or its refusal.

        Args:
            prompt: What was said.
            scene: What perception sees now.
            history: The attempts so far, oldest first.

        Raises:
            PlannerUnavailableError: The service does not answer.
            PlannerAnswerError: It answers with nothing usable.
            InputError: The prompt is too long, or the service does not know the model or the key.
            RenderingError: The picture cannot be taken.
        """
        check_prompt(prompt)
        content: list[UserContent] = [question(prompt, scene, history)]
        if self._settings.picture is not None:
            content.append(BinaryContent(data=png(self._settings.picture()), media_type="image/png"))
        return run_apart(self._converse(content, scene))

    async def _converse(self, content: list[UserContent], scene: ObservedScene) -> Plan | Refusal:
        messages: list[ModelMessage] = [_request([UserPromptPart(content=content)])]
        reason = ""
        async with Service(self._settings, self._player) as service:
            for _ in range(self._settings.max_turns):
                response = await service.ask(messages, self._tools)
                try:
                    return read_answer(response, scene, self._skills)
                except MisuseError as misuse:
                    reason = str(misuse)
                    messages += [response, _request(_correction(response, reason))]
        raise PlannerAnswerError(
            f"{self._settings.model}: no usable answer in {self._settings.max_turns} turns; the last one: {reason[:600]}"
        )


def _request(parts: Sequence[ModelRequestPart]) -> ModelRequest:
    return ModelRequest(parts=parts, instructions=INSTRUCTIONS)


def _correction(response: ModelResponse, reason: str) -> list[ModelRequestPart]:
    """Return the reply to a misused answer: a result for each of its tool calls, as the protocol asks."""
    calls = [part for part in response.parts if isinstance(part, ToolCallPart)]
    if not calls:
        return [UserPromptPart(content=reason)]
    return [ToolReturnPart(tool_name=call.tool_name, tool_call_id=call.tool_call_id, content=reason) for call in calls]
