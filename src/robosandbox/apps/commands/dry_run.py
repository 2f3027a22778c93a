"""Previews of plans for `run --dry-run` and `run --confirm`, shown in place of the motion or before it."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, print_json
from robosandbox.errors import InputError
from robosandbox.progress import doing

if TYPE_CHECKING:
    from robosandbox.types import Plan
    from robosandbox.workcell.embedded import EmbeddedWorkcell

_ACTIVITY = "trying the plan on the twin"


def print_preview(session: EmbeddedWorkcell, prompt: str, json: bool) -> int:
    """Print a plan and what came of it on the twin; the world itself does not move."""
    from robosandbox.agent.preview import preview
    from robosandbox.agent.usage import metered
    from robosandbox.types import Refusal

    with metered() as usage, doing("planning"):
        answer = session.agent.plan(prompt)
    with doing(_ACTIVITY):
        tried = None if isinstance(answer, Refusal) else preview(session.ctx, answer, session.calls)
    if json:
        dump = answer.model_dump(mode="json")
        refused = isinstance(answer, Refusal)
        print_json(
            {
                "prompt": prompt,
                "plan": None if refused else dump["steps"],
                "refusal": dump if refused else None,
                "preview": tried.record() if tried else None,
                "model_usage": usage.record(),
            }
        )
    elif isinstance(answer, Refusal):
        print(f"refused ({answer.code}): {answer.message}")
    elif tried is not None:
        print("\n".join(tried.lines()))
    return EXIT_DONE if tried is not None and tried.success else EXIT_FAILED


def ask_before(session: EmbeddedWorkcell, prompt: str | None) -> None:
    """Have the agent ask the person about each plan, the first and those after failures, before anything moves.

    Raises:
        InputError: The prompt comes from stdin, where the answer would come from.
    """
    from robosandbox.agent.preview import preview

    if prompt == "-":
        raise InputError(
            "--confirm: the prompt is read from stdin, and so would be your answer; give the prompt itself"
        )

    def ask(plan: Plan) -> bool:
        with doing(_ACTIVITY):
            tried = preview(session.ctx, plan, session.calls)
        for line in tried.lines():
            print(f"    plan  {line}", file=sys.stderr)
        print("carry it out? [y/N] ", end="", file=sys.stderr, flush=True)
        answer = sys.stdin.readline()
        if not answer.endswith("\n"):
            # Whoever is not there has not ended the line either.
            print(file=sys.stderr)
        return answer.strip().lower() in ("y", "yes")

    session.agent.approve = ask
