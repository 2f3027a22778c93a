"""The robot as data for a model: its gripper, its limits, and what of the scene it cannot handle at all."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robosandbox.agent.context import AgentContext
from robosandbox.agent.goal import GoalContext
from robosandbox.types import ObservedScene, Plan, SkillCall
from robosandbox.world.operators import Operator
from robosandbox.world.verifier import verify

_PICK = "pick"


def describe_robot(ctx: GoalContext, scene: ObservedScene, skills: Mapping[str, Operator]) -> dict[str, Any]:
    """Return what is known of the robot; little of one in another process, whose sim keeps its limits itself.

    Args:
        ctx: Whose robot.
        scene: What is seen.
        skills: What it may do, by name.
    """
    if not isinstance(ctx, AgentContext):
        return {}
    spec = ctx.arm.spec
    data: dict[str, Any] = {"arm": spec.name}
    if spec.gripper is not None:
        geometry = spec.gripper.geometry
        if geometry.cup is not None:
            data["suction_cup"] = round(geometry.cup, 3)
        else:
            data["gripper_opens"] = [round(geometry.min_aperture, 3), round(geometry.max_aperture, 3)]
    for limits in (spec.limits, ctx.limits):
        if limits is not None:
            data |= limits.model_dump(mode="json", exclude_none=True)
    cannot = {item.id: cause for item in scene.objects if (cause := _why_no_pick(item.id, scene, skills))}
    return data | ({"cannot_pick": cannot} if cannot else {})


def _why_no_pick(name: str, scene: ObservedScene, skills: Mapping[str, Operator]) -> str:
    """Return why an object can never be picked up; "" where something done first may help, or nothing is needed."""
    if _PICK not in skills:
        return ""
    plan = Plan(steps=(SkillCall(skill=_PICK, arguments={"object": name}),))
    problems = verify(plan, scene, list(skills.values())).problems
    return next((problem.cause for problem in problems if problem.is_final), "")
