"""Skills, scenes and errors in the protocol's words."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from typing import Any

import mcp_types as types
from pydantic import Field, TypeAdapter, ValidationError

from robosandbox.agent.llm.scene import describe_scene
from robosandbox.errors import InputError, SkillError
from robosandbox.protocols import Skill
from robosandbox.types import (
    MAX_PROMPT_LENGTH,
    Observation,
    ObservedScene,
    Plan,
    Refusal,
    RefusalCode,
    SkillCall,
    SkillResult,
    StrictModel,
)
from robosandbox.world.arguments import terms
from robosandbox.world.verifier import MAX_STEPS, verify

LOOK, PLAN, CHECK, REFUSE = "look", "plan", "check_plan", "refuse"


class LookArguments(StrictModel):
    """See the objects, the arm's state and, if asked, a camera's picture; nothing moves."""

    camera: str | None = Field(default=None, description="Name of a camera whose picture is wanted as well.")


class PlanArguments(StrictModel):
    """Turn a sentence into skill calls or a refusal, with the planner that the server was started with; nothing moves."""

    prompt: str = Field(description="What the person said.", min_length=1, max_length=MAX_PROMPT_LENGTH)


class CheckArguments(StrictModel):
    """Check skill calls of your own against skills, scene and order before you make them; nothing moves."""

    steps: tuple[SkillCall, ...] = Field(description="The calls in order.", min_length=1, max_length=MAX_STEPS)


class RefuseArguments(StrictModel):
    """Say that a request will not be carried out, and why; nothing moves. A wrong motion is worse than none."""

    code: RefusalCode
    message: str = Field(description="A sentence for the person.", min_length=1, max_length=600)
    candidates: tuple[str, ...] = Field(default=(), description="Object ids that could be meant.")


_OWN: dict[str, type[StrictModel]] = {
    LOOK: LookArguments,
    PLAN: PlanArguments,
    CHECK: CheckArguments,
    REFUSE: RefuseArguments,
}


def catalogue(skills: Sequence[Skill[Any]]) -> list[types.Tool]:
    """Return the tools: the skills under their own names and schemas, and four that move nothing.

    Raises:
        InputError: A skill has the name of one of those four.
    """
    taken = [skill.name for skill in skills if skill.name in _OWN]
    if taken:
        raise InputError(f"the skill {taken[0]!r} has the name of a tool that the server offers itself; rename it")
    moving = [
        types.Tool(
            name=skill.name,
            description=f"{skill.description} {terms(skill)}".strip(),
            input_schema={"type": "object", **skill.schema},
            annotations=types.ToolAnnotations(read_only_hint=False, destructive_hint=False, open_world_hint=False),
        )
        for skill in skills
    ]
    still = [
        types.Tool(
            name=name,
            description=" ".join((model.__doc__ or "").split()),
            input_schema={key: value for key, value in model.model_json_schema().items() if key != "description"},
            annotations=types.ToolAnnotations(read_only_hint=True, open_world_hint=False),
        )
        for name, model in _OWN.items()
    ]
    return moving + still


def own_arguments(name: str, arguments: dict[str, Any]) -> StrictModel | types.CallToolResult | None:
    """Return the arguments of one of the four own tools, the mistake in them, or None for another tool."""
    model = _OWN.get(name)
    if model is None:
        return None
    try:
        return model.model_validate(arguments)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"]) or "arguments"
        return failed("invalid_argument", f"{name}: {where}: {first['msg']}; it takes {', '.join(model.model_fields)}")


def done(result: SkillResult) -> types.CallToolResult:
    """Return a skill's checked outcome."""
    return answer(result.model_dump(mode="json"))


def skill_failed(error: SkillError) -> types.CallToolResult:
    """Return a skill's failure with its evidence and repairs."""
    return answer({"error": error.record().model_dump(mode="json")}, said=error.message, is_error=True)


def failed(code: str, message: str) -> types.CallToolResult:
    """Return a failure of the call itself."""
    return answer({"error": {"code": code, "message": message}}, said=message, is_error=True)


def answer(data: dict[str, Any], *, said: str | None = None, is_error: bool = False) -> types.CallToolResult:
    """Return data for programs, and the same as text for models."""
    text = json.dumps(data) if said is None else f"{said}\n{json.dumps(data)}"
    return types.CallToolResult(
        content=[types.TextContent(type="text", text=text)], structured_content=data, is_error=is_error
    )


def planned(planner_answer: Plan | Refusal) -> dict[str, Any]:
    """Return a planner's answer as `robo-sandbox plan --json` prints it."""
    dump = planner_answer.model_dump(mode="json")
    if isinstance(planner_answer, Refusal):
        return {"plan": None, "refusal": dump}
    return {"plan": dump["steps"], "refusal": None}


def checked(arguments: CheckArguments, scene: ObservedScene, skills: Sequence[Skill[Any]]) -> dict[str, Any]:
    """Return what is wrong with a client's own plan."""
    wrong = verify(Plan(steps=arguments.steps), scene, skills).problems
    return {"ok": not wrong, "problems": [str(problem) for problem in wrong]}


def seen(scene: ObservedScene) -> dict[str, Any]:
    """Return the scene as JSON data."""
    return describe_scene(scene)


def state_data(state: Observation) -> dict[str, Any]:
    """Return the arm's state as JSON data."""
    data: dict[str, Any] = TypeAdapter(Observation).dump_python(state, mode="json")
    return data


def base64_text(data: bytes) -> str:
    """Return bytes as the protocol carries them."""
    return base64.b64encode(data).decode()
