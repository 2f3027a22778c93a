"""`plan --steps`: whether somebody else's plan can be right, step by step; nothing moves."""

from __future__ import annotations

import json as jsonlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, print_json
from robosandbox.errors import InputError
from robosandbox.progress import doing, nothing_done

if TYPE_CHECKING:
    from robosandbox.types import Plan
    from robosandbox.workcell.embedded import EmbeddedWorkcell


def read_steps(source: str) -> Plan:
    """Return the plan in a file, or on stdin for "-": a JSON list of calls, or what `plan --json` prints.

    Raises:
        InputError: There is none, or it is no such list.
    """
    from robosandbox.types import Plan, SkillCall

    try:
        if source == "-":
            nothing_done()
        text = sys.stdin.read() if source == "-" else Path(source).read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"--steps: {source}: byte {error.start} is not UTF-8 text") from None
    except OSError as error:
        raise InputError(f"--steps: {source}: {error.strerror}; give a file, or - for stdin") from None
    try:
        data: Any = jsonlib.loads(text)
    except ValueError as error:
        raise InputError(f"--steps: {'stdin' if source == '-' else source} is no JSON: {error}") from None
    if isinstance(data, dict) and "plan" in data:
        data = data["plan"]
    try:
        return Plan(steps=tuple(TypeAdapter(list[SkillCall]).validate_python(data)))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        form = '[{"skill": "pick", "arguments": {"object": "red_cube"}}, ...]'
        raise InputError(f"--steps: {where + ': ' if where else ''}{first['msg']}; the form is {form}") from None


def verify_steps(session: EmbeddedWorkcell, plan: Plan, *, json: bool) -> int:
    """Print what is wrong with a plan, and the relations that would hold after it."""
    from robosandbox.skills.primitives.abilities import RobotAbilities
    from robosandbox.world.symbolic_state import symbolic_state
    from robosandbox.world.verifier import verify

    robot = RobotAbilities(session.ctx, session.task.limits)
    with doing("checking the plan"):
        verdict = verify(plan, session.observe(), list(session.calls.values()), robot=robot)
    stated = symbolic_state(verdict.end)
    if json:
        print_json(
            {
                "problems": [problem.record() for problem in verdict.problems],
                "end": [str(one.fact) for one in stated if one.finding.is_sure],
                "unsure": [str(one.fact) for one in stated if not one.finding.is_sure],
            }
        )
    elif verdict.problems:
        print("\n".join(str(problem) for problem in verdict.problems))
    else:
        print(f"nothing stands against these {len(plan.steps)} steps; in the end:")
        print("\n".join(f"  {one.fact}" for one in stated if one.finding.is_sure))
    return EXIT_FAILED if verdict.problems else EXIT_DONE
