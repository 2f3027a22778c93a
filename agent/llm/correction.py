"""Correction sent to a model whose answer cannot be used: what is wrong with it, and an answer that would be valid.

The example is never a motion that the model has not asked for, since small models copy what they are shown: it is their
own plan with misspelt names and superfluous arguments put right, where that makes it valid, and else a refusal.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence

from robosandbox.types import ObservedScene, Plan, RefusalCode, SkillCall
from robosandbox.validation import nearest
from robosandbox.world.arguments import object_arguments
from robosandbox.world.operators import Operator
from robosandbox.world.verifier import Constraints, verify

_FORM = 'The form is {"steps": [{"skill": NAME, "arguments": {...}}, ...]} or {"code": CODE, "message": SENTENCE}.'


def correction(
    reason: str,
    plan: Plan | None,
    scene: ObservedScene,
    skills: Sequence[Operator],
    constraints: Constraints | None = None,
) -> str:
    """Return the reason with a valid example.

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
    return f"{reason}. {_FORM} Valid, where nothing else is: {json.dumps(_refusal(plan, scene, skills))}"


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


def _refusal(plan: Plan | None, scene: ObservedScene, skills: Sequence[Operator]) -> dict[str, str]:
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
