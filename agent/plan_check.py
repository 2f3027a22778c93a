"""Whether a plan can be right, before anything moves: its calls against the skills, its objects and order against the scene.

What a grammar plans is right by construction; what comes from outside, a language model or a client, is checked here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from robosandbox.protocols import Skill
from robosandbox.types import DetectedObject, ObservedScene, Plan, SkillCall
from robosandbox.validation import did_you_mean

MAX_STEPS = 40
OBJECT_ARGUMENTS = ("object", "target", "container", "drawer")
_PLACES = frozenset({"place_on", "place_in", "place_beside", "place_at", "pour"})
_EMPTY_HANDED = frozenset({"pick", "stack", "push", "tap", "open_drawer", "close_drawer"})


def problems(plan: Plan, scene: ObservedScene, skills: Sequence[Skill[Any]]) -> tuple[str, ...]:
    """Return what is wrong with a plan, a sentence each, in the order of its steps; nothing when it can be right."""
    if len(plan.steps) > MAX_STEPS:
        return (f"the plan has {len(plan.steps)} steps; at most {MAX_STEPS} are carried out",)
    found: list[str] = []
    by_name = {skill.name: skill for skill in skills}
    for number, call in enumerate(plan.steps, start=1):
        found += [f"step {number} {_short(call)}: {text}" for text in _call_problems(call, scene, by_name)]
    return tuple(found) or tuple(_order_problems(plan, scene, by_name))


def _call_problems(call: SkillCall, scene: ObservedScene, skills: dict[str, Skill[Any]]) -> list[str]:
    from jsonschema import Draft202012Validator

    skill = skills.get(call.skill)
    if skill is None:
        return [
            f"there is no skill {call.skill[:60]!r}; there is {', '.join(skills)}{did_you_mean(call.skill, skills)}"
        ]
    # The schema and not the skill's own check: a remote skill's is done where the robot is.
    wrong = next(iter(Draft202012Validator(dict(skill.schema)).iter_errors(call.arguments)), None)
    if wrong is not None:
        where = ".".join(str(part) for part in wrong.absolute_path)
        return [f"{where + ': ' if where else ''}{wrong.message[:300]}"]
    for key, value in call.arguments.items():
        if isinstance(value, float) and not math.isfinite(value):
            return [f"{key}: {value} is not a finite number"]
    ids = [item.id for item in scene.objects]
    return [
        f"{key}: no object {str(call.arguments[key])[:60]!r} is seen; there is {', '.join(ids) or 'nothing'}"
        f"{did_you_mean(str(call.arguments[key]), ids)}"
        for key in OBJECT_ARGUMENTS
        if key in call.arguments and scene.find(str(call.arguments[key])) is None
    ]


def _order_problems(plan: Plan, scene: ObservedScene, skills: dict[str, Skill[Any]]) -> list[str]:
    """Follow what the gripper holds from step to step; up to the first skill whose effect is not known here."""
    held = scene.held
    for number, call in enumerate(plan.steps, start=1):
        where = f"step {number} {_short(call)}"
        things = {key: item for key in OBJECT_ARGUMENTS if (item := scene.find(str(call.arguments.get(key))))}
        if call.skill in _EMPTY_HANDED and held is not None:
            return [f"{where}: the gripper would hold {held}; place it first"]
        if call.skill in _PLACES and held is None:
            return [f"{where}: the gripper would be empty; pick the object first"]
        wrong = _thing_problem(call, things, held)
        if wrong:
            return [f"{where}: {wrong}"]
        match call.skill:
            case "pick":
                held = str(call.arguments["object"])
            case "place_on" | "place_in" | "place_beside" | "place_at":
                held = None
            case "stack" | "push" | "tap" | "open_drawer" | "close_drawer" | "pour" | "home":
                pass
            case _:
                return []
    return []


def _thing_problem(call: SkillCall, things: dict[str, DetectedObject], held: str | None) -> str | None:
    moved, target = things.get("object"), things.get("target")
    if moved is not None and call.skill in ("pick", "stack") and moved.shape.opens:
        return f"{moved.id} is {moved.shape.name}, which stays where it is"
    if target is not None:
        if target.id in (held, moved.id if moved else None):
            return f"{target.id} cannot be its own target"
        if call.skill in ("place_on", "stack") and not target.shape.flat_top:
            return f"{target.id} is {target.shape.name}: nothing stays on top of it" + (
                "; use place_in" if target.shape.is_open_container else ""
            )
    vessel = things.get("container")
    if vessel is not None:
        if vessel.id == held:
            return f"{vessel.id} cannot be put into itself"
        if not vessel.shape.holds_things:
            return f"{vessel.id} is {vessel.shape.name} and holds nothing; use place_on"
    return None


def _short(call: SkillCall) -> str:
    text = " ".join(str(call).split())
    return text if len(text) <= 120 else text[:117] + "..."
