"""A program that a model runs in a world: its calls one by one, what it may ask, and what it came to."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from robosandbox.agent.goal import GoalContext
from robosandbox.agent.llm.program import Program, ProgramEnd
from robosandbox.agent.tools import not_holding, relations
from robosandbox.errors import InputError
from robosandbox.types import Plan, SkillCall
from robosandbox.world.operators import Operator
from robosandbox.world.scene_json import describe_scene

_LONGEST_VALUE = 2_000  # Characters of a program's value as JSON. Chosen: a page.


class RunningProgram:
    """A program under way.

    Args:
        code: The text.
        ctx: The world that it looks at.
        skills: What it may call, by name.
    """

    def __init__(self, code: str, ctx: GoalContext, skills: Mapping[str, Operator]) -> None:
        self._ctx = ctx
        takes = {name: list(skill.schema.get("properties", {})) for name, skill in skills.items()}
        self._program = Program(code, takes, {"scene": self._scene, "holds": self._holds})
        self._done: list[dict[str, Any]] = []

    def begin(self) -> Plan | dict[str, Any]:
        """Return the first call, or what the program came to without one."""
        return self._next(self._program.begin())

    def go_on(self, told: Mapping[str, Any]) -> Plan | dict[str, Any]:
        """Return the next call now that the last one came to this, or what the program came to: it ends with a failure."""
        self._done += told["done"]
        if not told["ok"]:
            return self._came_to(told)
        return self._next(self._program.go_on(told))

    def broken_off(self, why: Mapping[str, Any]) -> dict[str, Any]:
        """Return what the program came to, now that its next call is turned down."""
        return self._came_to(why)

    def _next(self, answer: SkillCall | ProgramEnd) -> Plan | dict[str, Any]:
        if isinstance(answer, SkillCall):
            return Plan(steps=(answer,))
        if answer.error:
            return self._came_to({"ok": False, "error": answer.error})
        return self._came_to({"ok": True, **_told(answer.value)})

    def _came_to(self, end: Mapping[str, Any]) -> dict[str, Any]:
        printed = {"printed": self._program.printed} if self._program.printed else {}
        return {**end, "done": self._done, **printed}

    def _scene(self) -> Any:
        return describe_scene(self._ctx.look())

    def _holds(self, text: str) -> bool:
        try:
            return not not_holding(relations([str(text)]), self._ctx.look())
        except InputError as error:
            raise ValueError(str(error)) from None


def _told(value: Any) -> dict[str, Any]:
    """Return a program's value as a model is told it; nothing of one that is too long."""
    if value is None:
        return {}
    try:
        is_short = len(json.dumps(value, allow_nan=False)) <= _LONGEST_VALUE
    except (TypeError, ValueError, RecursionError):
        is_short = False
    return {"value": value} if is_short else {"note": "its value is no short JSON and left out"}
