"""What a model may answer: a plan whose calls have the skills' own schemas, or a refusal; and how its answer is read."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Annotated, Any

from pydantic import Field, ValidationError, field_validator
from pydantic_ai.messages import ModelResponse, TextPart, ToolCallPart
from pydantic_ai.tools import ToolDefinition

from robosandbox.agent.plan_check import MAX_STEPS, problems
from robosandbox.protocols import Skill
from robosandbox.types import ObservedScene, Plan, Refusal, RefusalCode, SkillCall, StrictModel

PLAN = "plan"
REFUSE = "refuse"
_FENCED = re.compile(r"\A\s*```(?:json)?\s*(\{.*\})\s*```\s*\Z", re.DOTALL)
_UNPRINTABLE = re.compile(r"[\x00-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069]+")


class MisuseError(Exception):
    """An answer is neither a plan that can be right nor a refusal; the message tells the model why."""


class RefusalAnswer(StrictModel):
    """What `refuse` takes."""

    code: RefusalCode
    message: Annotated[str, Field(min_length=1, max_length=600)]
    candidates: Annotated[tuple[str, ...], Field(max_length=50)] = ()

    @field_validator("message")
    @classmethod
    def _message_is_printable(cls, value: str) -> str:
        text = _UNPRINTABLE.sub(" ", value).strip()
        if not text:
            raise ValueError("says nothing")
        return text


class StepAnswer(StrictModel):
    """A step of `plan`; arguments are checked against the skill's own schema afterwards."""

    skill: str
    arguments: dict[str, Any] = Field(default_factory=dict)


class PlanAnswer(StrictModel):
    """What `plan` takes."""

    steps: Annotated[tuple[StepAnswer, ...], Field(min_length=1, max_length=MAX_STEPS)]


def tools(skills: Sequence[Skill[Any]]) -> list[ToolDefinition]:
    """Return the two tools, `plan` with a variant of its steps for each skill."""
    variants = [
        {
            "type": "object",
            "description": skill.description,
            "properties": {"skill": {"const": skill.name}, "arguments": _plain(dict(skill.schema))},
            "required": ["skill", "arguments"],
            "additionalProperties": False,
        }
        for skill in skills
    ]
    plan_schema = {
        "type": "object",
        "properties": {"steps": {"type": "array", "minItems": 1, "maxItems": MAX_STEPS, "items": {"anyOf": variants}}},
        "required": ["steps"],
        "additionalProperties": False,
    }
    refusal = {
        "type": "object",
        "properties": {
            "code": {"type": "string", "enum": [code.value for code in RefusalCode]},
            "message": {"type": "string", "description": "One sentence for the person.", "maxLength": 600},
            "candidates": {
                "type": "array",
                "items": {"type": "string"},
                "description": "Object ids that could be meant.",
            },
        },
        "required": ["code", "message"],
        "additionalProperties": False,
    }
    return [
        ToolDefinition(
            name=PLAN, description="Carry out these skill calls in order.", parameters_json_schema=plan_schema, kind="output"
        ),
        ToolDefinition(name=REFUSE, description="Do nothing, and say why.", parameters_json_schema=refusal, kind="output"),
    ]  # fmt: skip


def read_answer(response: ModelResponse, scene: ObservedScene, skills: Sequence[Skill[Any]]) -> Plan | Refusal:
    """Return the plan or refusal in an answer.

    Raises:
        MisuseError: There is none that can be right.
    """
    if response.finish_reason == "length":
        raise MisuseError("The answer was cut off; answer with one short tool call.")
    calls = [part for part in response.parts if isinstance(part, ToolCallPart)]
    if len(calls) > 1:
        names = ", ".join(call.tool_name[:40] for call in calls)
        raise MisuseError(
            f"There were {len(calls)} tool calls ({names}); make exactly one: all steps go into one `plan`."
        )
    if calls:
        name, data = calls[0].tool_name, _arguments(calls[0])
    else:
        name, data = _from_text("".join(part.content for part in response.parts if isinstance(part, TextPart)))
    if name == PLAN:
        return _plan(data, scene, skills)
    if name == REFUSE:
        return _refusal(data, scene, skills)
    raise MisuseError(f"There is no tool {name[:60]!r}; call `{PLAN}` or `{REFUSE}`.")


def _arguments(call: ToolCallPart) -> Any:
    if isinstance(call.args, str):
        return _parsed(call.args)
    return call.args or {}


def _parsed(text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MisuseError(f"The arguments are not valid JSON ({error}); call the tool again.") from None


def _from_text(text: str) -> tuple[str, Any]:
    """Read the answer of a model that writes its JSON as text; only when the text is nothing else."""
    fenced = _FENCED.match(text)
    stripped = (fenced[1] if fenced else text).strip()
    if stripped.startswith("{") and stripped.endswith("}"):
        data = _parsed(stripped)
        if {"steps"} == data.keys():
            return PLAN, data
        if {"code", "message"} <= data.keys():
            return REFUSE, data
    raise MisuseError(f"Text alone is no answer; call the tool `{PLAN}` or `{REFUSE}` exactly once.")


def _plan(data: Any, scene: ObservedScene, skills: Sequence[Skill[Any]]) -> Plan:
    try:
        answer = PlanAnswer.model_validate(data)
    except ValidationError as error:
        raise MisuseError(f"`{PLAN}` was called wrongly: {_told(error)}") from None
    plan = Plan(steps=tuple(SkillCall(skill=step.skill, arguments=step.arguments) for step in answer.steps))
    wrong = problems(plan, scene, skills)
    if wrong:
        raise MisuseError(f"The plan cannot be carried out: {'; '.join(wrong[:5])}")
    return plan


def _refusal(data: Any, scene: ObservedScene, skills: Sequence[Skill[Any]]) -> Refusal:
    try:
        answer = RefusalAnswer.model_validate(data)
    except ValidationError as error:
        raise MisuseError(f"`{REFUSE}` was called wrongly: {_told(error)}") from None
    known = {*(item.id for item in scene.objects), *(skill.name for skill in skills)}
    candidates = tuple(name for name in dict.fromkeys(answer.candidates) if name in known)
    return Refusal(code=answer.code, message=answer.message, candidates=candidates)


def _told(error: ValidationError) -> str:
    lines = [
        f"{'.'.join(str(part) for part in item['loc']) or 'arguments'}: {item['msg']}"
        for item in error.errors(include_url=False)
    ]
    return "; ".join(lines[:5])[:1000]


def _plain(schema: dict[str, Any]) -> dict[str, Any]:
    """Return a schema without the titles, which say nothing to a model."""
    plain = {key: value for key, value in schema.items() if key != "title"}
    properties = plain.get("properties", {})
    plain["properties"] = {
        name: {key: value for key, value in item.items() if key != "title"} for name, item in properties.items()
    }
    return plain
