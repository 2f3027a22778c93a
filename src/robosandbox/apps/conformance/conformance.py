"""Checks that any skill or planner must pass; call them from your own tests.

    from robosandbox.apps.conformance import check_planner, check_skill

Each raises AssertionError with a sentence that says which promise is broken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from robosandbox.agent.context import AgentContext
from robosandbox.agent.planner import StubPlanner
from robosandbox.agent.protocols import Planner
from robosandbox.errors import InputError, InvalidArgumentError, SkillError
from robosandbox.skills.base import Skill
from robosandbox.skills.pick import Pick
from robosandbox.skills.words import Slot
from robosandbox.types import ObservedScene, Plan, Refusal, SkillCall, SkillResult
from robosandbox.world.abilities import Abilities
from robosandbox.world.alternatives import FailedCall
from robosandbox.world.contracts import apply_effects, first_refuted, lookup
from robosandbox.world.operators import Operator, bind
from robosandbox.world.predicate import View


def check_skill(skill: Skill, ctx: AgentContext, arguments: dict[str, object]) -> SkillResult | SkillError:
    """Run a skill once and check that it keeps its contract and ends in one of the two ways a skill may end.

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
    seen = ctx.look()
    check_contract(skill, seen, arguments)
    check_words(skill, seen, arguments)
    before = ctx.driver.time
    skills = {skill.name: skill}
    call = SkillCall(skill=skill.name, arguments=arguments)
    try:
        bind(SkillCall(skill=skill.name, arguments={**arguments, "no_such_argument": 1}), skills)
    except InvalidArgumentError:
        demand(ctx.driver.time == before, f"{skill.name}: time passed before its arguments were checked")
    else:
        raise AssertionError(f"{skill.name}: accepted an unknown argument")
    try:
        result = ctx.perform(bind(call, skills))
    except SkillError as error:
        demand(bool(error.message), f"{skill.name}: raised {type(error).__name__} without a message")
        kind = type(error).evidence_type
        demand(kind is None or isinstance(error.evidence, kind), f"{skill.name}: {type(error).__name__} lacks evidence")
        bound = bind(call, skills)
        said = SkillCall(skill=skill.name, arguments=dict(bound.arguments))
        contract = bound.contract.resolved(seen)
        check_alternatives(
            skill, FailedCall(call=said, error=error.failure, contract=contract, before=seen, scene=ctx.look())
        )
        return error
    demand(isinstance(result, SkillResult), f"{skill.name}: returned {type(result).__name__}, not SkillResult")
    demand(result.skill == skill.name, f"{skill.name}: its result is signed {result.skill!r}")
    return result


# What of a robot people name behind a verb, by what may be.
_BODY = {"": "", "hand": "the hand", "wrist": "the wrist", "fingers": "the gripper"}


def check_words(skill: Skill, scene: ObservedScene, arguments: Mapping[str, object]) -> None:
    """Check that each verb with which a skill says people ask for it is understood, beside what has to be said with it.

    Args:
        skill: The skill.
        scene: In which the arguments make sense.
        arguments: Valid arguments for it; one that is a thing stands for the verb's object.
    """
    told, scene = skill.words, replace(scene, poses=("camera",))
    planner = StubPlanner([skill, Pick()])
    for words in told if isinstance(told, tuple) else (told,) if told else ():
        named = {words.object, *(name for slot in words.slots for name in slot.argument.split())} - {""}
        strange = named - {*skill.schema["properties"]}
        demand(not strange, f"{skill.name}: its words fill {', '.join(sorted(strange))}, which it does not take")
        others = [item.id for item in scene.objects if item.id != arguments.get(words.object)]
        by_argument = {slot.argument: slot for slot in reversed(words.slots)}
        needed = [by_argument[argument] for argument in (*words.needed, *words.required[:1])]
        extra = " ".join(_said_of(slot, others) for slot in dict.fromkeys(needed))
        # What is done with what the hand holds already is said of a hand that holds it.
        held = str(arguments.get("held", "")) if words.hand == "holding" and not words.object else ""
        seen = scene.holding(held) if held else scene
        firsts, rests = set[str](), set[str]()
        for verb in words.verbs:
            # Of "move the hand", "bring the hand", "move the arm" the last is made of the others, as the grammar makes it.
            first, _, rest = verb.partition(" ")
            if first in firsts and rest in rests:
                continue
            firsts.add(first)
            rests.add(rest)
            named_here = "{}" in verb or words.body == "fingers"
            thing = str(arguments.get(words.object, "")) if words.object else _BODY[words.body] * named_here
            said = verb.replace("{}", thing) if "{}" in verb else f"{verb} {thing}"
            sentence = " ".join(f"{said} {extra}".split())
            answer = planner.plan(sentence, seen)
            calls = [step.skill for step in answer.steps] if isinstance(answer, Plan) else []
            demand(skill.name in calls, f"{skill.name}: “{sentence}” is not understood as it: {answer}")


def _said_of(slot: Slot, things: Sequence[str]) -> str:
    """Return what somebody may say for an argument."""
    samples = {
        "angle": "30 degrees",
        "length": "5 cm",
        "duration": "2 seconds",
        "force": "5 newtons",
        "share": "50 percent",
        "number": "2",
        "point": "0.2, 0.1, 0.3",
        "name": "camera",
        "pose": "camera",
        "speed": "10 cm per second",
        "pair": " and ".join(things[:2]),
        "object": things[0] if things else "",
    }
    if slot.kind == "phrase":
        return slot.phrases[0][0]
    begins, ends = (table[0][0] if table and not slot.bare else "" for table in (slot.beginnings, slot.endings))
    return f"{slot.prepositions[0]} {begins} {samples[slot.kind]} {'' if begins else ends}"


def check_contract(skill: Operator, scene: ObservedScene, arguments: Mapping[str, object]) -> None:
    """Check that a skill says what it needs and brings about, in relations that are known and fit one another.

    Args:
        skill: The skill.
        scene: In which the arguments make sense.
        arguments: Valid arguments for it.
    """
    contract = skill.contract(**skill.check(arguments))
    demand(bool(contract.gives), f"{skill.name}: its contract promises nothing, so nobody can plan with it")
    for one in (*contract.needs, *contract.gives):
        try:
            lookup(one)
        except InputError as error:
            raise AssertionError(f"{skill.name}: its contract names {error}") from None
    resolved = contract.resolved(scene)
    after = View(scene=apply_effects(contract, scene), before=scene, robot=Abilities())
    broken = first_refuted(resolved.gives, after)
    demand(
        broken is None or first_refuted(resolved.needs, View.of(scene)) is not None,
        f"{skill.name}: its promises contradict one another: {broken and broken[0]} does not hold once all are kept",
    )


def check_alternatives(skill: Operator, failed: FailedCall) -> None:
    """Check that the other ways that a skill declares for a failed call say why, and name relations and calls that there are.

    Args:
        skill: The skill.
        failed: A call of it that failed.
    """
    for way in skill.alternatives(failed, **failed.call.arguments):
        demand(bool(way.why), f"{skill.name}: an alternative does not say why it may help")
        demand(bool(way.first or way.cleared or way.call), f"{skill.name}: an alternative, {way.why}, does nothing")
        for one in way.first:
            try:
                lookup(one)
            except InputError as error:
                raise AssertionError(f"{skill.name}: an alternative, {way.why}, names {error}") from None
        if way.call is not None and way.call.skill == skill.name:
            skill.check(way.call.arguments)


def check_planner(planner: Planner, scene: ObservedScene, skills: Sequence[Operator], prompts: Sequence[str]) -> None:
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
