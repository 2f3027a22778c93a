"""Previews of plans for `run --dry-run` and `run --confirm`, shown in place of the motion or before it."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, print_json
from robosandbox.errors import InputError
from robosandbox.printable import printable
from robosandbox.progress import doing

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robosandbox.workcell.embedded import EmbeddedWorkcell
    from robosandbox.workcell.workcell import Workcell

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


def ask_before(session: Workcell, prompt: str | None, *, always: bool = False) -> None:
    """Ask the person at this terminal about each plan, the first and those after failures, where plans are to be confirmed.

    Args:
        session: Whose plans.
        prompt: As it was given.
        always: Whether the person has asked for that; else nobody is asked where there is no terminal.

    Raises:
        InputError: The prompt comes from stdin, where the answer would come from, and the person has asked for it.
    """
    from robosandbox.agent.gate import Gate

    gate = session.agent.approve
    if always and prompt == "-":
        raise InputError(
            "--confirm: the prompt is read from stdin, and so would be your answer; give the prompt itself"
        )
    if isinstance(gate, Gate) and (always or (prompt != "-" and sys.stdin.isatty() and sys.stderr.isatty())):
        gate.ask = _ask


def _ask(lines: Sequence[str]) -> bool:
    for line in lines:
        print(f"    plan  {printable(line)}", file=sys.stderr)
    print("carry it out? [y/N] ", end="", file=sys.stderr, flush=True)
    answer = sys.stdin.readline()
    if not answer.endswith("\n"):
        # Whoever is not there has not ended the line either.
        print(file=sys.stderr)
    return answer.strip().lower() in ("y", "yes")
