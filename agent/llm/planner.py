"""A planner that asks a language model and believes nothing that it does not check."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from pydantic_ai.messages import BinaryContent, UserContent

from robosandbox.agent.agent import check_prompt
from robosandbox.agent.llm.answer import answer_tools, read_answer
from robosandbox.agent.llm.budget import Budget, SpendingLimits
from robosandbox.agent.llm.endpoint import Question, converse
from robosandbox.agent.llm.pictures import png
from robosandbox.agent.llm.prompt import instructions, question
from robosandbox.agent.llm.service import Service
from robosandbox.agent.llm.settings import LLMSettings
from robosandbox.agent.protocols import Attempt
from robosandbox.types import ObservedScene, Plan, Refusal
from robosandbox.world.operators import Operator
from robosandbox.world.verifier import Constraints


class LLMPlanner:
    """Plans by asking a model, each time from the request, the scene as it is now and what has failed.

    An answer that is no plan that can be right and no refusal goes back to the model with the reason, up to `max_turns`.
    The time limit holds for a prompt, new plans after failures included.

    Args:
        skills: What plans may call.
        settings: Model, endpoint and limits.

    Attributes:
        certain: Returns what a prompt holds every plan to, whatever the model makes of it.

    Raises:
        InputError: A key is missing, or the cassette cannot be used.
    """

    certain: Callable[[str, ObservedScene], Constraints]

    def __init__(self, skills: Sequence[Operator], settings: LLMSettings) -> None:
        self._skills = tuple(skills)
        self.certain = partial(constraints_of, skills=self._skills)
        self._tools = answer_tools(self._skills, max_steps=settings.max_steps)
        self._settings = settings
        self._service = Service(settings)
        self._prompt = prompt_budget(settings)
        self._session = Budget(SpendingLimits(**settings.session), of="session")  # type: ignore[arg-type]

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal:
        """Return the model's plan, or its refusal.

        Args:
            prompt: What was said.
            scene: What perception sees now.
            history: The attempts so far, oldest first; none begins a new prompt.

        Raises:
            PlannerUnavailableError: The service does not answer in time.
            PlannerAnswerError: It answers with nothing usable.
            InputError: The prompt is too long, or the service does not know the model or the key.
            RenderingError: The picture cannot be taken.
        """
        check_prompt(prompt)
        most = self._settings.max_steps
        self._prompt = self._prompt if history else prompt_budget(self._settings)
        asked = self.certain(prompt, scene)
        if history:
            # What a plan before this one has moved need not be moved again.
            asked = replace(asked, moved=frozenset(), fewest=0)
        content: list[UserContent] = [question(prompt, scene, history, certain=asked)]
        if self._settings.picture is not None:
            content.append(BinaryContent(data=png(self._settings.picture()), media_type="image/png"))
        return converse(
            self._service,
            Question(
                instructions=lambda mode: instructions(self._skills, mode),
                content=content,
                tools=self._tools,
                exact_tools=answer_tools(self._skills, scene, max_steps=most),
                read=lambda call: read_answer(call, scene, self._skills, max_steps=most, constraints=asked),
            ),
            budgets=(self._prompt, self._session),
        )


def constraints_of(prompt: str, scene: ObservedScene, skills: Sequence[Operator]) -> Constraints:
    """Return what a model is held to whatever it makes of the prompt: what the grammar is sure that it forbids."""
    # Its tables take a second to load, which a model's first answer takes as well.
    from robosandbox.agent.language.bounds import bounds_of

    bounds = bounds_of(prompt, scene, [skill.name for skill in skills])
    return Constraints(never=bounds.never, only=bounds.only)


def prompt_budget(settings: LLMSettings) -> Budget:
    """Return what a prompt may cost; the answers of a plan are counted by whoever asks for it."""
    turns = settings.max_turns if settings.mode != "plan" else None
    limits = SpendingLimits(
        turns=turns,
        tokens=settings.max_tokens,
        cost=settings.max_cost,
        seconds=settings.time_limit,
        steps=settings.max_steps,
    )
    return Budget(limits)
