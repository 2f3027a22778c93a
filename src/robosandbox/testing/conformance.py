"""Checks that any skill or planner must pass; call them from your own tests.

    from robosandbox.testing import check_planner, check_skill

Each raises AssertionError with a sentence that says which promise is broken.
"""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.errors import InvalidArgumentError, SkillError
from robosandbox.protocols import Planner, Skill, SkillContext
from robosandbox.types import ObservedScene, Plan, Refusal, SkillResult


def check_skill(skill: Skill, ctx: SkillContext, arguments: dict[str, object]) -> SkillResult | SkillError:
    """Run a skill once and check that it ends in one of the two ways a skill may end.

    Args:
        skill: The skill.
        ctx: A loaded world.
        arguments: Valid arguments for it.

    Returns:
        Its result, or the SkillError that it raised.
    """
    schema = skill.schema
    demand(bool(skill.name) and bool(skill.description), f"{skill.name!r} lacks a name or a description")
    demand(schema.get("type") == "object", f"{skill.name}: its schema is no JSON object schema")
    demand(schema.get("additionalProperties") is False, f"{skill.name}: its schema admits unknown arguments")
    before = ctx.sim.time
    try:
        skill(ctx, {**arguments, "no_such_argument": 1})
    except InvalidArgumentError:
        demand(ctx.sim.time == before, f"{skill.name}: time passed before its arguments were checked")
    else:
        raise AssertionError(f"{skill.name}: accepted an unknown argument")
    try:
        result = skill(ctx, arguments)
    except SkillError as error:
        demand(bool(error.message), f"{skill.name}: raised {type(error).__name__} without a message")
        kind = type(error).evidence_type
        demand(kind is None or isinstance(error.evidence, kind), f"{skill.name}: {type(error).__name__} lacks evidence")
        return error
    demand(isinstance(result, SkillResult), f"{skill.name}: returned {type(result).__name__}, not SkillResult")
    demand(result.skill == skill.name, f"{skill.name}: its result is signed {result.skill!r}")
    return result


def check_planner(planner: Planner, scene: ObservedScene, skills: Sequence[Skill], prompts: Sequence[str]) -> None:
    """Check that a planner answers each prompt with a plan of known skills and arguments, or a refusal, repeatably."""
    schemas = {skill.name: skill.schema for skill in skills}
    for prompt in prompts:
        answer = planner.plan(prompt, scene)
        demand(isinstance(answer, Plan | Refusal), f"{prompt!r}: answered with {type(answer).__name__}")
        demand(answer == planner.plan(prompt, scene), f"{prompt!r}: two answers for the same scene")
        if isinstance(answer, Refusal):
            demand(bool(answer.message), f"{prompt!r}: refused without a sentence")
            continue
        for call in answer.steps:
            demand(call.skill in schemas, f"{prompt!r}: plans {call.skill!r}, which is no skill here")
            schema = schemas[call.skill]
            known, needed = schema.get("properties", {}), schema.get("required", [])
            demand(set(call.arguments) <= set(known), f"{prompt!r}: {call} has unknown arguments")
            demand(set(needed) <= set(call.arguments), f"{prompt!r}: {call} lacks arguments")


def demand(holds: bool, otherwise: str) -> None:
    """Raise an AssertionError that says what is wrong `otherwise`, where something does not hold."""
    if not holds:
        raise AssertionError(otherwise)
