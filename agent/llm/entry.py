"""What asks a model: the planners `openai`, `anthropic` and `auto`, and the perception `vlm`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robosandbox.agent.llm.settings import LLMSettings, Picture, Service
from robosandbox.errors import InputError
from robosandbox.extras import missing_extra
from robosandbox.perception.factory import Setup
from robosandbox.protocols import Planner, Skill
from robosandbox.world.verifier import MAX_STEPS

if TYPE_CHECKING:
    from robosandbox.agent.llm.planner import LLMPlanner
    from robosandbox.agent.llm.pointing import PointingPerception


def with_model(
    service: Service,
    skills: Sequence[Skill[Any]],
    *,
    model: str = "",
    base_url: str | None = None,
    cassette: Path | None = None,
    picture: Picture | None = None,
    time_limit: float = 60.0,
    max_turns: int = 4,
    max_steps: int = MAX_STEPS,
) -> LLMPlanner:
    """Return a planner that asks a model.

    Args:
        service: What its endpoint speaks: OpenAI's chat completions (OpenAI, Ollama, vLLM, llama.cpp), or Anthropic's.
        skills: What plans may call.
        model: Its name at the endpoint.
        base_url: The endpoint, for OpenAI's protocol up to and with `/v1`; the service's own when left out.
        cassette: A file to record exchanges to, or to replay when it exists.
        picture: Takes a camera picture for a model that sees.
        time_limit: Seconds for a prompt, retries and new plans after failures included.
        max_turns: Answers asked for per plan, the first included.
        max_steps: Skill calls in a plan.

    Raises:
        InputError: An option is wrong, a key is missing, or the package is not installed.
    """
    settings = LLMSettings(
        service=service,
        model=model,
        base_url=base_url,
        cassette=cassette,
        picture=picture,
        time_limit=time_limit,
        max_turns=max_turns,
        max_steps=max_steps,
    )
    try:
        from robosandbox.agent.llm.planner import LLMPlanner
    except ModuleNotFoundError as error:
        raise missing_extra(error, "--planner", "llm") from None
    return LLMPlanner(skills, settings)


openai = partial(with_model, "openai")
anthropic = partial(with_model, "anthropic")


def auto(
    skills: Sequence[Skill[Any]],
    *,
    model: str = "",
    base_url: str | None = None,
    cassette: Path | None = None,
    picture: Picture | None = None,
    time_limit: float = 60.0,
    dialogue: bool = False,
) -> Planner:
    """Return a planner that asks a model only about what the grammar is not sure of; arguments as for `with_model`.

    With `dialogue` prompts may refer to those before them, as far as the grammar understands them. A model whose name begins with `claude` and that has no `base_url` is Anthropic's.
    """
    from robosandbox.agent.llm.auto import AutoPlanner
    from robosandbox.agent.planner import StubPlanner

    service: Service = "anthropic" if model.startswith("claude") and base_url is None else "openai"
    thinker = with_model(
        service, skills, model=model, base_url=base_url, cassette=cassette, picture=picture, time_limit=time_limit
    )
    return AutoPlanner(StubPlanner(skills, dialogue=dialogue), thinker)


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
