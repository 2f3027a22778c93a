"""Skills, scenes and errors in the protocol's words."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from typing import Any

import mcp_types as types
from pydantic import Field, TypeAdapter, ValidationError

from robosandbox.agent.flat_schema import flat
from robosandbox.agent.tools import (
    AchieveArguments,
    CheckArguments,
    RefuseArguments,
    SimulateArguments,
    description,
    error_data,
    rounded,
    schema,
    wrong_arguments,
)
from robosandbox.errors import InputError, SkillError
from robosandbox.printable import printable
from robosandbox.types import (
    ArmState,
    Observation,
    ObservedScene,
    SkillResult,
    StrictModel,
)
from robosandbox.values import frozen
from robosandbox.workcell.orders import (
    FollowArguments,
    JudgeArguments,
    OrderResult,
    PlanArguments,
    RecoverArguments,
    RunArguments,
    UndoArguments,
)
from robosandbox.world.arguments import terms
from robosandbox.world.operators import Operator
from robosandbox.world.scene_json import describe_scene


class LookArguments(StrictModel):
    """See the objects, the arm's state and, if asked, a camera's picture; nothing moves."""

    camera: str | None = Field(default=None, description="Name of a camera whose picture is wanted as well.")


class ResetArguments(StrictModel):
    """Start the task over: objects and arm go to where a seed's layout has them; what was done is lost."""

    seed: int = Field(default=0, ge=0, description="The layout; 0 is the task as written.")


class LoadArguments(StrictModel):
    """Put the robot at another bundled task; what was done is lost."""

    task: str = Field(description="Its name, such as put_in_bin.", min_length=1, max_length=60)


class StopArguments(StrictModel):
    """Stop what is under way, whoever asked for it; the arm holds where it is."""


def _object(**fields: str | list[str]) -> dict[str, Any]:
    """Return the schema of an answer: these fields, of these types, or an error; none is required, as clients check both."""
    return {
        "type": "object",
        "properties": {
            **{name: {"type": kind} for name, kind in fields.items()},
            "error": {"type": ["object", "null"]},
        },
    }


@frozen
class Own:
    """A tool of the server's own.

    Attributes:
        arguments: What it takes; the docstring is its description.
        answers: Schema of what it answers.
        moves: Whether the robot or the world may move.
        undoes: Whether what was done may be lost.
    """

    arguments: type[StrictModel]
    answers: dict[str, Any]
    moves: bool = False
    undoes: bool = False


_PLANNED = _object(plan=["array", "null"], refusal=["object", "null"])
_EPISODE = _object(success="boolean", reason="string", detail="string", answer="string", done="array")
_TASK = _object(task="string", prompt="string", seed="integer")
OWN: dict[str, Own] = {
    "look": Own(LookArguments, _object(scene="object", state="object", doing=["string", "null"], cameras="array")),
    "plan": Own(PlanArguments, _PLANNED),
    "check": Own(CheckArguments, _object(ok="boolean", problems="array")),
    "simulate": Own(SimulateArguments, _object(ok="boolean")),
    "run": Own(RunArguments, _EPISODE, moves=True),
    "follow": Own(FollowArguments, _EPISODE, moves=True),
    "achieve": Own(AchieveArguments, _EPISODE, moves=True),
    "judge": Own(JudgeArguments, _object(success="boolean", detail="object")),
    "reset": Own(ResetArguments, _TASK, moves=True, undoes=True),
    "undo": Own(UndoArguments, _object(undone="string"), moves=True, undoes=True),
    "recover": Own(RecoverArguments, _object(fault="string")),
    "stop": Own(StopArguments, _object(stopped=["string", "null"])),
    "load": Own(LoadArguments, _TASK, moves=True, undoes=True),
    "refuse": Own(RefuseArguments, _PLANNED),
}
"""Tools of the server's own, by name."""


def catalogue(skills: Sequence[Operator]) -> list[types.Tool]:
    """Return the tools: the skills under their own names and schemas, and the server's own.

    Raises:
        InputError: A skill has the name of a tool of the server's own.
    """
    taken = [skill.name for skill in skills if skill.name in OWN]
    if taken:
        raise InputError(f"the skill {taken[0]!r} has the name of a tool that the server offers itself; rename it")
    moving = [
        types.Tool(
            name=skill.name,
            description=f"{skill.description} {terms(skill)}".strip(),
            input_schema=flat(skill.schema),
            output_schema=_object(skill="string", detail="object", side_effects="array"),
            annotations=types.ToolAnnotations(read_only_hint=False, destructive_hint=False, open_world_hint=False),
        )
        for skill in skills
    ]
    own = [
        types.Tool(
            name=name,
            description=description(tool.arguments),
            input_schema=schema(tool.arguments, skills),
            output_schema=tool.answers,
            annotations=types.ToolAnnotations(
                read_only_hint=not tool.moves, destructive_hint=tool.undoes, open_world_hint=False
            ),
        )
        for name, tool in OWN.items()
    ]
    return moving + own


def own_arguments(name: str, arguments: dict[str, Any]) -> StrictModel | types.CallToolResult | None:
    """Return the arguments of one of the own tools, the mistake in them, or None for another tool."""
    tool = OWN.get(name)
    if tool is None:
        return None
    try:
        return tool.arguments.model_validate(arguments)
    except ValidationError as error:
        return failed("invalid_argument", wrong_arguments(name, error, tool.arguments))


def skill_failed(error: SkillError) -> types.CallToolResult:
    """Return a skill's failure with its evidence and repairs."""
    return answer({"error": error_data(error.failure)}, said=error.message, is_error=True)


def failed(code: str, message: str) -> types.CallToolResult:
    """Return a failure of the call itself."""
    return answer({"error": {"code": code, "message": message}}, said=message, is_error=True)


def answer(data: dict[str, Any], *, said: str | None = None, is_error: bool = False) -> types.CallToolResult:
    """Return data for programs, with numbers rounded, and the same as text for models."""
    data = rounded(data)
    text = json.dumps(data) if said is None else f"{printable(said)}\n{json.dumps(data)}"
    return types.CallToolResult(
        content=[types.TextContent(type="text", text=text)], structured_content=data, is_error=is_error
    )


def ended(came: SkillResult | OrderResult) -> types.CallToolResult:
    """Return what came of a call or an order; an error where it did not succeed."""
    if isinstance(came, SkillResult):
        return answer(came.model_dump(mode="json"))
    return answer(came.data, is_error=came.failure is not None)


def seen(scene: ObservedScene) -> dict[str, Any]:
    """Return the scene as JSON data."""
    return describe_scene(scene)


def state_data(state: Observation) -> dict[str, Any]:
    """Return the arm's state as JSON data; of several arms, each by its name."""
    arms: dict[str, Any] = TypeAdapter(dict[str, ArmState]).dump_python(dict(state.arms), mode="json")
    return next(iter(arms.values())) if len(arms) == 1 else arms


def base64_text(data: bytes) -> str:
    """Return bytes as the protocol carries them."""
    return base64.b64encode(data).decode()
