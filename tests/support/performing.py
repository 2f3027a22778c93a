"""Calls of skills as tests make them: bound and carried out, as everybody's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robosandbox.agent.context import AgentContext
from robosandbox.skills.base import Skill
from robosandbox.types import SkillCall, SkillResult
from robosandbox.world.operators import BoundCall, bind


def bound(skill: Skill, arguments: Mapping[str, Any]) -> BoundCall:
    """Return a call of a skill."""
    return bind(SkillCall(skill=skill.name, arguments=dict(arguments)), {skill.name: skill})


def perform(ctx: AgentContext, skill: Skill, arguments: Mapping[str, Any]) -> SkillResult:
    """Carry out a call of a skill; raises SkillError."""
    return ctx.perform(bound(skill, arguments))
