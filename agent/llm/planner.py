"""A planner that asks a language model and believes nothing that it does not check."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic_ai.messages import BinaryContent, UserContent

from robosandbox.agent.agent import check_prompt
from robosandbox.agent.llm.answer import read_answer, tools
from robosandbox.agent.llm.converse import converse
from robosandbox.agent.llm.prompt import INSTRUCTIONS, question
from robosandbox.agent.llm.service import open_cassette, png
from robosandbox.agent.llm.settings import LLMSettings
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
        return converse(
            self._settings,
            self._player,
            instructions=INSTRUCTIONS,
            content=content,
            tools=self._tools,
            read=lambda response: read_answer(response, scene, self._skills),
        )
