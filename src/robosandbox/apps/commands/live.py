"""An episode as it happens, on stderr: a line per skill, and its phases while it runs."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.text import Text

from robosandbox.agent import episode as events
from robosandbox.apps.commands.waiting import stderr_console
from robosandbox.printable import printable

if TYPE_CHECKING:
    from rich.status import Status

    from robosandbox.agent.agent import Agent
    from robosandbox.agent.goal import GoalContext
    from robosandbox.skills.events import EventStream


# Characters of one line about a tool. Chosen: a wide terminal's.
_LONGEST = 160


class LiveView:
    """A listener for agents that prints to stderr; on a terminal the running phase moves, else phases are listed."""

    def __init__(self, *, plain: bool = False) -> None:
        """Show what comes; `plain` as where there is no terminal."""
        self._console = Console(stderr=True, highlight=False, force_terminal=False) if plain else stderr_console()
        self._status: Status | None = None
        self._phases: list[str] = []
        self._thought = ""
        self._drafted: list[str] = []

    def watch(self, agent: Agent[Any], events: EventStream | None = None) -> None:
        """Show what an agent does, and on a terminal what a model writes while it writes.

        Args:
            agent: Whose planner may ask a model.
            events: Tell what it does; its own if left out.
        """
        (events or agent.ctx.events).subscribe(self)
        agent.streams = agent.streams or self._console.is_terminal

    def __call__(self, event: events.AgentEvent) -> None:
        """Show an event."""
        match event:
            case events.Started():
                self.show("planning")
            case events.Writing():
                self._thought += event.thought
                self._drafted += map(str, event.calls)
                self.show(self._being_written())
            case events.Planned(plan, replan):
                self._think(self._thought)
                if not plan.answer:
                    self._print("new plan" if replan else "plan", str(plan), "cyan")
            case events.Thought(text):
                self._think(text)
            case events.Consulted():
                self._hide()
                self._print(event.tool, _in_a_line(event), "blue")
            case events.SkillStarted(call, index, total):
                self._phases = []
                self.show(f"{index + 1}/{total} {call}")
            case events.PhaseEntered(call, phase):
                # A phase that a skill enters anew at once is told once.
                if self._phases[-1:] != [phase]:
                    self._phases.append(phase)
                self.show(f"{call}: {phase}")
            case events.SkillEnded(call, result):
                self._hide()
                self._print("done", f"{call} [{' > '.join(self._phases)}]", "green")
                for effect in result.side_effects:
                    self._print("note", effect, "yellow")
            case events.SkillFailed(call, error):
                self._hide()
                self._print("failed", f"{call} at {error.phase}: {error.message}", "red")
                for repair in error.repairs:
                    self._print("could", f"{', '.join(map(str, repair.calls))}: {repair.why}", "yellow")
            case events.Replanning():
                self.show("planning anew")
            case events.Ended(episode):
                self._end(episode)

    def _end(self, episode: events.Episode) -> None:
        """Take the moving line away, and say what models were asked."""
        self._hide()
        if episode.model_usage.requests:
            self._print("asked", str(episode.model_usage), "dim")

    def show(self, text: str) -> None:
        """Have the moving line, where there is one, say something."""
        if not self._console.is_terminal:
            return
        if self._status is None:
            self._status = status = self._console.status(Text(printable(text)))
            status.start()
        else:
            self._status.update(Text(printable(text)))

    def close(self) -> None:
        """Take the moving line away, whatever it shows."""
        self._hide()

    def _being_written(self) -> str:
        """Return the end of what a model has written so far, as much as a line holds."""
        text = ", ".join(self._drafted) or printable(self._thought)
        return f"{'drafts' if self._drafted else 'thinks'}: {text[-_LONGEST:]}"

    def _think(self, thought: str) -> None:
        """Keep a thought in view now that it is complete; nothing where there is none."""
        self._hide()
        if thought:
            self._print("thinks", printable(thought)[:_LONGEST], "dim")
        self._thought, self._drafted = "", []

    def _print(self, head: str, text: str, style: str) -> None:
        self._console.print(Text.assemble((f"{head:>8}", style), "  ", printable(text)), soft_wrap=True)

    def _hide(self) -> None:
        if self._status is not None:
            self._status.stop()
            self._status = None


def ask_here(agent: Agent[Any], live: LiveView) -> None:
    """Let planners ask the person at this terminal; where there is none, nobody is there to answer."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return

    def ask(question: str) -> str:
        live.close()
        print(f"{printable(question)}\n> ", end="", file=sys.stderr, flush=True)
        return sys.stdin.readline().strip()

    agent.ask = ask


def _in_a_line(event: events.Consulted) -> str:
    """Return what a tool was asked and what it said, cut to a line's length."""
    text = f"{json.dumps(dict(event.arguments))} -> {json.dumps(dict(event.answer))}"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


@contextmanager
def cancel_on_interrupt(ctx: GoalContext, agent: Agent[Any]) -> Iterator[None]:
    """Let the first Ctrl-C end the episode properly, at once while the planner thinks; the second one ends the program."""

    def handle(number: int, frame: FrameType | None) -> None:
        del number, frame
        signal.signal(signal.SIGINT, before)
        agent.left = True
        # Not by print: the interrupted code may be within it, and a buffer is not entered twice.
        with suppress(OSError):
            os.write(2, b"stopping; Ctrl-C again quits\n")
        if agent.thinks:
            raise KeyboardInterrupt
        ctx.cancel()

    before = signal.signal(signal.SIGINT, handle)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        agent.left = False
