"""The tools of a model that acts: the skills with what they need and bring about, and what moves nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field
from pydantic_ai.tools import ToolDefinition

from robosandbox.agent.llm.answer import skill_arguments
from robosandbox.agent.tools import (
    AchieveArguments,
    AskArguments,
    CheckArguments,
    FinishArguments,
    ProgramArguments,
    RefuseArguments,
    SimulateArguments,
    description,
    schema as schema_of,
)
from robosandbox.errors import InputError
from robosandbox.types import ObservedScene, StrictModel
from robosandbox.world.arguments import terms
from robosandbox.world.operators import Operator

_THOUGHT = (
    240  # Characters of a thought before a call. Chosen: a small model writes on for as long as a schema lets it.
)
_CALL = "call"
LOOK, ASK, PROGRAM = "look", "ask_person", "program"


class SceneLookArguments(StrictModel):
    """See the scene as it is now, and where a camera is named its picture with the ids drawn on it; nothing moves."""

    camera: Annotated[str, Field(max_length=60, description="Name of a camera; none where left out.")] = ""


OWN: dict[str, type[StrictModel]] = {
    LOOK: SceneLookArguments,
    "check": CheckArguments,
    "simulate": SimulateArguments,
    "achieve": AchieveArguments,
    PROGRAM: ProgramArguments,
    ASK: AskArguments,
    "finish": FinishArguments,
    "refuse": RefuseArguments,
}


def acting_tools(
    skills: Sequence[Operator], scene: ObservedScene | None = None, *, can_ask: bool, can_program: bool = False
) -> list[ToolDefinition]:
    """Return the tools.

    Args:
        skills: What moves.
        scene: With it the schemas name the ids that each argument may have; skills for which there is no object are left out.
        can_ask: Whether a person is there to answer.
        can_program: Whether programs are carried out.

    Raises:
        InputError: A skill has the name of a tool.
    """
    taken = next((skill.name for skill in skills if skill.name in OWN), None)
    if taken is not None:
        raise InputError(f"the skill {taken!r} has the name of a tool that models are offered; rename it")
    left_out = {name for name, is_there in ((ASK, can_ask), (PROGRAM, can_program)) if not is_there}
    moving = [
        ToolDefinition(
            name=skill.name, description=f"{skill.description} {terms(skill)}".strip(), parameters_json_schema=arguments
        )
        for skill in skills
        if (arguments := skill_arguments(skill, scene)) is not None
    ]
    still = [
        ToolDefinition(name=name, description=description(model), parameters_json_schema=schema_of(model, skills))
        for name, model in OWN.items()
        if name not in left_out
    ]
    return [*moving, *still]


def one_call(tools: Sequence[ToolDefinition]) -> ToolDefinition:
    """Return what a server that writes by a schema answers with: a thought, and a call of one of the tools."""
    calls = [
        {
            "type": "object",
            "description": tool.description,
            "properties": {"name": {"const": tool.name}, "arguments": tool.parameters_json_schema},
            "required": ["name", "arguments"],
            "additionalProperties": False,
        }
        for tool in tools
    ]
    schema = {
        "type": "object",
        "properties": {"thought": {"type": "string", "maxLength": _THOUGHT}, _CALL: {"anyOf": calls}},
        "required": ["thought", _CALL],
        "additionalProperties": False,
    }
    return ToolDefinition(name=_CALL, description="What to do next.", parameters_json_schema=schema)
