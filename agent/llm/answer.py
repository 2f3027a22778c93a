"""Answer of a model, a plan whose calls have the skills' own schemas or a refusal, and its checks."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Annotated, Any

from pydantic import Field, ValidationError
from pydantic_ai.tools import ToolDefinition

from robosandbox.agent.flat_schema import flat
from robosandbox.agent.llm.forms import Call, MisuseError, as_call
from robosandbox.agent.tools import RefuseArguments, said_of, step_schema
from robosandbox.types import ObservedScene, Plan, Refusal, RefusalCode, SkillCall, StrictModel
from robosandbox.validation import nearest
from robosandbox.world.arguments import fitting, object_arguments
from robosandbox.world.operators import Operator
from robosandbox.world.verifier import MAX_STEPS, Constraints, verify

PLAN = "plan"
REFUSE = "refuse"
_FORM = 'The form is {"steps": [{"skill": NAME, "arguments": {...}}, ...]} or {"code": CODE, "message": SENTENCE}.'


class StepAnswer(StrictModel):
    """A step of `plan`; arguments are checked against the skill's own schema afterwards."""

    skill: str
    arguments: dict[str, Any] = Field(default_factory=dict)


class PlanAnswer(StrictModel):
    """Arguments of `plan`."""

    steps: Annotated[tuple[StepAnswer, ...], Field(min_length=1, max_length=MAX_STEPS)]


def answer_tools(
    skills: Sequence[Operator], scene: ObservedScene | None = None, *, max_steps: int = MAX_STEPS
) -> list[ToolDefinition]:
    """Return the two tools, `plan` with a variant of its steps for each skill.

    Args:
        skills: What a plan may call.
        scene: With it the schema names the ids that each argument may have, so that a server that writes by the schema
            cannot name another; skills for which there is no object are left out.
        max_steps: How many calls a plan may have.
    """
    variants = [
        step_schema(skill, arguments) for skill in skills if (arguments := skill_arguments(skill, scene)) is not None
    ]
    if not variants and scene is not None:
        return answer_tools(skills, max_steps=max_steps)
    plan_schema = {
        "type": "object",
        "properties": {"steps": {"type": "array", "minItems": 1, "maxItems": max_steps, "items": {"anyOf": variants}}},
        "required": ["steps"],
        "additionalProperties": False,
    }
    refusal = {
        "type": "object",
        "properties": {
            "code": {"type": "string", "enum": [code.value for code in RefusalCode]},
            "message": {"type": "string", "description": "One sentence for the person.", "maxLength": 200},
            # Bounded, since a small model that is held to a schema writes on for as long as the schema lets it.
            "candidates": {
                "type": "array",
                "items": {"type": "string", "maxLength": 64},
                "maxItems": 10,
                "description": "Object ids that could be meant.",
            },
        },
        "required": ["code", "message"],
        "additionalProperties": False,
    }
    return [
        ToolDefinition(
            name=PLAN, description="Carry out these skill calls in order.", parameters_json_schema=plan_schema
        ),
        ToolDefinition(name=REFUSE, description="Do nothing, and say why.", parameters_json_schema=refusal),
    ]


def read_answer(
    call: Call,
    scene: ObservedScene,
    skills: Sequence[Operator],
    *,
    max_steps: int = MAX_STEPS,
    constraints: Constraints | None = None,
) -> Plan | Refusal:
    """Return the plan or refusal that was called.

    Args:
        call: What a model answered.
        scene: What it planned for.
        skills: What it may call.
        max_steps: How many calls a plan may have.
        constraints: What the person asked besides.

    Raises:
        MisuseError: It is none that can be right; with what is wrong, what is valid, and a valid example.
    """
    if call.name == PLAN:
        return _plan(call.arguments, scene, skills, max_steps, constraints)
    return _refusal(call.arguments, scene, skills)


def _plan(
    data: Any, scene: ObservedScene, skills: Sequence[Operator], max_steps: int, constraints: Constraints | None
) -> Plan:
    try:
        answer = PlanAnswer.model_validate(_with_plain_steps(data))
    except ValidationError as error:
        raise MisuseError(_correction(f"`{PLAN}` was answered wrongly: {_told(error)}", None, scene, skills)) from None
    plan = Plan(steps=tuple(SkillCall(skill=step.skill, arguments=step.arguments) for step in answer.steps))
    wrong = tuple(map(str, verify(plan, scene, skills, constraints=constraints).problems))
    if len(plan.steps) > max_steps:
        wrong = (f"steps: there are {len(plan.steps)}; at most {max_steps} are carried out",)
    if wrong:
        raise MisuseError(
            _correction(f"The plan cannot be carried out: {'; '.join(wrong[:5])}", plan, scene, skills, constraints)
        )
    return plan


def _with_plain_steps(data: Any) -> Any:
    """Return what `plan` was given with its steps in the plain form, `skill` and `arguments`, where they are in another."""
    if not isinstance(data, dict) or not isinstance(data.get("steps"), list):
        return data
    steps = []
    for step in data["steps"]:
        call = as_call(step)
        steps.append(step if call is None else {"skill": call.name, "arguments": call.arguments})
    return {**data, "steps": steps}


def _refusal(data: Any, scene: ObservedScene, skills: Sequence[Operator]) -> Refusal:
    try:
        answer = RefuseArguments.model_validate(data)
    except ValidationError as error:
        raise MisuseError(
            _correction(f"`{REFUSE}` was answered wrongly: {_told(error)}", None, scene, skills)
        ) from None
    return as_refusal(answer, scene, [skill.name for skill in skills])


def as_refusal(given: RefuseArguments, scene: ObservedScene, skills: Iterable[str]) -> Refusal:
    """Return a refusal with those of its candidates that are there: objects of the scene, and skills by name."""
    known = {*(item.id for item in scene.objects), *skills}
    candidates = tuple(name for name in dict.fromkeys(given.candidates) if name in known)
    return Refusal(code=given.code, message=given.message, candidates=candidates)


def _told(error: ValidationError) -> str:
    """Return what is wrong field by field: its path, what is asked of it, and the value that it has."""
    return "; ".join(map(said_of, error.errors(include_url=False)[:5]))[:1000]


def skill_arguments(skill: Operator, scene: ObservedScene | None) -> dict[str, Any] | None:
    """Return a skill's flat schema with the ids that fit each argument; None where no object fits one."""
    schema = flat(skill.schema)
    if scene is None:
        return schema
    for name in object_arguments(skill):
        ids = fitting(skill, name, scene)
        if not ids:
            return None
        schema["properties"][name]["enum"] = ids
    return schema


def _correction(
    reason: str,
    plan: Plan | None,
    scene: ObservedScene,
    skills: Sequence[Operator],
    constraints: Constraints | None = None,
) -> str:
    """Return the reason with a valid example.

    The example is never a motion that the model has not asked for, since small models copy what they are shown: it is their
    own plan with misspelt names and superfluous arguments put right, where that makes it valid, and else a refusal.

    Args:
        reason: What is wrong, with the field and its value.
        plan: What the model planned; None where its answer is no plan.
        scene: What it planned for.
        skills: What it may call.
        constraints: What the person asked besides.
    """
    mended = None if plan is None else _mended(plan, scene, skills, constraints)
    if mended is not None:
        steps = [{"skill": call.skill, "arguments": dict(call.arguments)} for call in mended.steps]
        return f"{reason}. Valid, if it is what the person asks for: {json.dumps({'steps': steps})}"
    return f"{reason}. {_FORM} Valid, where nothing else is: {json.dumps(_fitting_refusal(plan, scene, skills))}"


def _mended(
    plan: Plan, scene: ObservedScene, skills: Sequence[Operator], constraints: Constraints | None
) -> Plan | None:
    """Return a plan with its names spelt right and without arguments that its skills do not take; None if still wrong."""
    by_name = {skill.name: skill for skill in skills}
    ids = [item.id for item in scene.objects]
    steps = []
    for call in plan.steps:
        name = _known(call.skill, by_name)
        if name is None:
            return None
        takes = by_name[name].schema.get("properties", {})
        arguments = {key: value for key, value in call.arguments.items() if key in takes}
        for key in object_arguments(by_name[name]):
            if key in arguments:
                arguments[key] = _known(str(arguments[key]), ids)
        steps.append(SkillCall(skill=name, arguments=arguments))
    mended = Plan(steps=tuple(steps))
    return None if verify(mended, scene, skills, constraints=constraints).problems else mended


def _known(name: str, names: Iterable[str]) -> str | None:
    """Return a name itself where it is known, else the one that it looks like; None where two look alike, or none."""
    names = list(names)
    if name in names:
        return name
    near = nearest(name, names)
    return near[0] if len(near) == 1 else None


def _fitting_refusal(plan: Plan | None, scene: ObservedScene, skills: Sequence[Operator]) -> dict[str, str]:
    """Return a refusal that fits what was wrong."""
    by_name = {skill.name: skill for skill in skills}
    for call in plan.steps if plan else ():
        if call.skill not in by_name:
            return {"code": RefusalCode.UNSUPPORTED.value, "message": "I have no skill for that."}
        for key in object_arguments(by_name[call.skill]):
            if key in call.arguments and scene.find(str(call.arguments[key])) is None:
                return {"code": RefusalCode.OBJECT_NOT_FOUND.value, "message": "I do not see that object."}
    if plan is not None:
        return {"code": RefusalCode.IMPOSSIBLE.value, "message": "That cannot be done here."}
    return {"code": RefusalCode.UNRECOGNIZED.value, "message": "I do not understand that."}
