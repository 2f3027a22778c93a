"""Entry points that ask a model: the planners `openai`, `responses`, `anthropic` and `auto`, and the perception `vlm`."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from robosandbox.agent.course import Director
from robosandbox.agent.llm.budget import OPTIONS, read_limits
from robosandbox.agent.llm.settings import LLMSettings, Mode, Picture, Service
from robosandbox.agent.protocols import Planner
from robosandbox.errors import InputError
from robosandbox.extras import missing_extra
from robosandbox.perception.factory import Setup
from robosandbox.types import ObservedScene
from robosandbox.world.operators import Operator

if TYPE_CHECKING:
    from robosandbox.agent.llm.planner import LLMPlanner
    from robosandbox.agent.llm.pointing import PointingPerception


def _with_limits(factory: Callable[..., PlannerT]) -> Callable[..., PlannerT]:
    """Give a function that takes `**limits` a signature in which each limit is named, for whoever checks options by it."""
    kept = inspect.signature(factory)
    named = [item for item in kept.parameters.values() if item.kind is not inspect.Parameter.VAR_KEYWORD]
    limits = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation="float | None")
        for name in OPTIONS
    ]
    factory.__signature__ = kept.replace(parameters=[*named, *limits])  # type: ignore[attr-defined]
    return factory


@_with_limits
def with_model(
    service: Service,
    skills: Sequence[Operator],
    *,
    model: str = "",
    base_url: str | None = None,
    cassette: Path | None = None,
    picture: Picture | None = None,
    mode: Mode = "plan",
    model_limits: Path | None = None,
    **limits: float | None,
) -> LLMPlanner:
    """Return a planner that asks a model.

    Args:
        service: What its endpoint speaks: OpenAI's chat completions (OpenAI, Ollama, vLLM, llama.cpp), OpenAI's responses, or
            Anthropic's.
        skills: What plans may call.
        model: Its name at the endpoint.
        base_url: The endpoint, for OpenAI's protocol up to and with `/v1`; the service's own when left out.
        cassette: A file to record exchanges to, or to replay when it exists.
        picture: Takes a camera picture for a model that sees.
        mode: `plan`: the model gives whole plans; `act`: it acts call by call and is told what came of each; `code`: it may
            write short programs of calls as well.
        model_limits: A YAML file of limits; ROBOSANDBOX_MODEL_LIMITS when left out.
        limits: For a prompt `max_turns` (for a plan where it plans), `max_tokens`, `max_cost` in US dollars, `time_limit` in
            seconds and `max_steps`; for all prompts `session_turns`, `session_tokens`, `session_cost`, `session_seconds`,
            `session_steps`. One that is not given is read from ROBOSANDBOX_MODEL_MAX_TURNS and so on, then from the file.

    Raises:
        InputError: An option is wrong, a key is missing, or the package is not installed.
    """
    said = read_limits(limits, model_limits)
    of_a_prompt = _USUAL.get(mode, {}) | {name: value for name, value in said.items() if OPTIONS[name][0] == "prompt"}
    settings = LLMSettings(
        service=service,
        model=model,
        base_url=base_url,
        cassette=cassette,
        picture=picture,
        mode=mode,
        session={OPTIONS[name][1]: value for name, value in said.items() if OPTIONS[name][0] == "session"},
        **of_a_prompt,
    )
    try:
        if mode != "plan":
            from robosandbox.agent.llm.acting import ActingPlanner

            if mode == "code":
                from robosandbox.agent.llm import program as _  # noqa: F401  asked for here, not in the middle of a task

            return ActingPlanner(skills, settings)
        from robosandbox.agent.llm.planner import LLMPlanner
    except ModuleNotFoundError as error:
        if error.name == "pydantic_monty":
            raise missing_extra(error, "--mode code", "code") from None
        raise missing_extra(error, "--planner", "llm") from None
    return LLMPlanner(skills, settings)


PlannerT = TypeVar("PlannerT")

# What a prompt may cost where nothing is said. Chosen: a call with its result takes some thousand tokens, as the whole
# conversation is sent each time, and a task some ten calls.
_ACTING: dict[str, Any] = {"max_turns": 40, "max_tokens": 400_000, "time_limit": 300.0}
_USUAL: dict[Mode, dict[str, Any]] = {"act": _ACTING, "code": _ACTING}

openai = partial(with_model, "openai")
responses = partial(with_model, "responses")
anthropic = partial(with_model, "anthropic")


@_with_limits
def auto(
    skills: Sequence[Operator],
    *,
    model: str = "",
    base_url: str | None = None,
    cassette: Path | None = None,
    picture: Picture | None = None,
    mode: Mode = "plan",
    model_limits: Path | None = None,
    dialogue: bool = False,
    moves: Sequence[Operator] = (),
    **limits: float | None,
) -> Planner:
    """Return a planner that asks a model only about what the grammar is not sure of; arguments as for `with_model`.

    With `dialogue` prompts may refer to those before them, as far as the grammar understands them. A model whose name begins with `claude` and that has no `base_url` is Anthropic's.
    """
    from robosandbox.agent.llm.auto import AutoDirector, AutoPlanner
    from robosandbox.agent.partial import PartialReading, partial_reading
    from robosandbox.agent.planner import StubPlanner

    service: Service = "anthropic" if model.startswith("claude") and base_url is None else "openai"
    thinker = with_model(
        service,
        skills,
        model=model,
        base_url=base_url,
        cassette=cassette,
        picture=picture,
        mode=mode,
        model_limits=model_limits,
        **limits,
    )
    grammar, alone = StubPlanner(skills, dialogue=dialogue, moves=moves), StubPlanner(skills, moves=moves)

    def read(prompt: str, scene: ObservedScene) -> PartialReading:
        return partial_reading(alone, prompt, scene, skills)

    thinker.certain = lambda prompt, scene: read(prompt, scene).constraints
    kind = AutoDirector if isinstance(thinker, Director) else AutoPlanner
    return kind(grammar, thinker, read)


def vlm(
    *,
    setup: Setup = Setup(),  # noqa: B008  frozen
    calibration: Path | None = None,
    model: str | None = None,
    base_url: str | None = None,
    cassette: Path | None = None,
    camera: str | None = None,
    time_limit: float = 60.0,
) -> PointingPerception:
    """Return a perception whose objects a model that sees points at and names.

    Args:
        setup: Robot and table; how the task describes its objects is not used.
        calibration: A file that `robo-sandbox calibrate` wrote.
        model: Its name at the endpoint; ROBOSANDBOX_VLM_MODEL when left out. One that begins with `claude` and has no
            `base_url` is Anthropic's; others speak OpenAI's chat completions.
        base_url: The endpoint; ROBOSANDBOX_VLM_URL when left out, or the service's own.
        cassette: A file to record exchanges to, or to replay when it exists; ROBOSANDBOX_VLM_CASSETTE when left out.
        camera: Whose picture is sent; that of the first one that looks when left out.
        time_limit: Seconds for an answer, retries included.

    Raises:
        InputError: An option is wrong, a key is missing, or the package is not installed.
    """
    model = model or os.environ.get("ROBOSANDBOX_VLM_MODEL", "")
    if not model:
        raise InputError("--perception vlm: no model is named; give --model to look, or set ROBOSANDBOX_VLM_MODEL")
    base_url = base_url or os.environ.get("ROBOSANDBOX_VLM_URL") or None
    recorded = os.environ.get("ROBOSANDBOX_VLM_CASSETTE")
    settings = LLMSettings(
        service="anthropic" if model.startswith("claude") and base_url is None else "openai",
        model=model,
        base_url=base_url,
        cassette=cassette or (Path(recorded) if recorded else None),
        time_limit=time_limit,
    )
    try:
        from robosandbox.agent.llm.pointing import PointingPerception
    except ModuleNotFoundError as error:
        raise missing_extra(error, "--perception vlm", "llm") from None
    return PointingPerception(settings, setup=setup, calibration=calibration, camera=camera)
