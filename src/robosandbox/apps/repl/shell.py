"""A shell that carries out one line after another, and remembers what was said and what came of it."""

from __future__ import annotations

import logging
from datetime import datetime
from pathlib import Path

from robosandbox.agent import episode as events
from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, EXIT_UNAVAILABLE
from robosandbox.apps.commands.run import sentence
from robosandbox.apps.repl.interrupts import Interrupts
from robosandbox.apps.repl.link import Link
from robosandbox.apps.repl.outcome import Outcome
from robosandbox.apps.repl.slash import COMMANDS, find
from robosandbox.errors import (
    InputError,
    InternalError,
    PlannerError,
    RenderingError,
    ServiceUnavailableError,
    SkillError,
)
from robosandbox.types import MAX_PROMPT_LENGTH, ObservedScene, Plan, Refusal, RefusalCode
from robosandbox.values import frozen
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.workcell import Workcell

_log = logging.getLogger(__name__)

# What people type to a program that they do not know yet: a command's name without its slash, and other words for it.
_BARE = {
    **{name.removeprefix("/"): name for name in COMMANDS},
    **dict.fromkeys(("exit", "bye", "/exit"), "/quit"),
    **dict.fromkeys(("?", "/?"), "/help"),
    **dict.fromkeys(("undo that", "undo it"), "/undo"),
    **dict.fromkeys(("once more", "repeat", "do it again", "again please"), "/again"),
    "stop": "/cancel",
}


@frozen
class LogEntry:
    """A line of the log."""

    time: datetime
    said: str
    outcome: str


class Shell:
    """Takes sentences and /commands for one robot.

    Args:
        host: Owns the workcell in which sentences are carried out.
        link: The connection, where the world is another process's.
        robot: The robot that other tasks are loaded with; each task's own if left out.

    Attributes:
        interrupts: What Ctrl-C does meanwhile.
        log: What was said and what came of it, oldest first.
        plan: The last plan.
        candidates: What the open question offers as answers.
        scene: What was seen last; None when that is out of date.
        said: The last sentence.
    """

    def __init__(self, host: WorkcellHost, link: Link | None = None, *, robot: Path | str | None = None) -> None:
        self.host = host
        self.link = link
        self._robot = robot
        self.log: list[LogEntry] = []
        self.plan: Plan | None = None
        self.candidates: tuple[str, ...] = ()
        self.scene: ObservedScene | None = None
        self.said: str = ""
        self.interrupts: Interrupts = Interrupts(host, lambda: self.away)
        host.events.subscribe(self.interrupts)
        host.events.subscribe(self._note_plan)

    @property
    def workcell(self) -> Workcell:
        """The workcell."""
        return self.host.cell

    @property
    def robot_name(self) -> str:
        """The robot's model, and its name where it is another process's."""
        return self.workcell.robot_name + (f" as {self.link.robot_id!r}" if self.link else "")

    @property
    def away(self) -> bool:
        """True while the sim is gone."""
        return self.link is not None and self.link.away

    def execute(self, line: str) -> Outcome:
        """Carry out a sentence or a /command; every way in which it may end is in the outcome."""
        line = _BARE.get(line.strip().lower().rstrip(".!"), line.strip())
        try:
            with self.interrupts.guard():
                return self._command(line) if line.startswith("/") else self.say(line)
        except KeyboardInterrupt:
            return Outcome("cancelled", EXIT_FAILED)
        except ServiceUnavailableError as error:
            return Outcome(_one_line(error), EXIT_UNAVAILABLE)
        except (InputError, PlannerError, RenderingError, SkillError) as error:
            return Outcome(_one_line(error), EXIT_FAILED)
        except Exception as fault:
            # One wrong line must not take the conversation with it.
            return Outcome(str(InternalError.log(repr(line[:60]), fault, _log)), EXIT_FAILED)

    def look(self) -> ObservedScene:
        """Return what perception sees now."""
        self.scene = self.workcell.observe()
        return self.scene

    def reset(self, seed: int | None) -> Outcome:
        """Start over with a seed's layout, the present one's if none is named."""
        chosen = self.workcell.seed if seed is None else seed
        said = "/reset" if seed is None else f"/reset {seed}"
        self.host.reset(chosen).done.result()
        self.scene = None
        return self._noted(said, Outcome(f"reset: {self.workcell.task.name} with seed {chosen}"))

    def undo(self) -> Outcome:
        """Go back to the state before the last command that changed it."""
        what = self.host.goal("undo", self.workcell.undo).done.result()
        self.scene = None
        self.candidates = ()
        return self._noted("/undo", Outcome(f"undone: {what}"))

    def recover(self) -> Outcome:
        """End a fault that has stopped the arm."""
        fault = self.host.goal("recover", self.workcell.recover).done.result()
        return self._noted("/recover", Outcome(f"recovered from: {fault}" if fault else "there was no fault"))

    def load(self, task: str, robot: str | None) -> Outcome:
        """Put another task in the place of this one."""
        self.host.load(task, robot or self._robot).done.result()
        self.scene = self.plan = None
        self.candidates = ()
        return self._noted(f"/load {task}", Outcome(f"loaded: {self.workcell.task.name} with {self.robot_name}"))

    def _command(self, line: str) -> Outcome:
        name, _, rest = line.partition(" ")
        return find(name).run(self, rest.strip())

    def say(self, prompt: str) -> Outcome:
        """Carry out a sentence."""
        self.said = prompt
        self.candidates = ()
        try:
            episode = self.host.goal(prompt, lambda: self.workcell.agent.run(prompt, takes_answers=True)).done.result()
        except KeyboardInterrupt:
            return self._noted(prompt, Outcome(f"cancelled: {self._where_left()}", EXIT_FAILED))
        except (InputError, ServiceUnavailableError, SkillError) as error:
            self._noted(prompt[:MAX_PROMPT_LENGTH], Outcome(_one_line(error)))
            raise
        finally:
            if self.interrupts.moved:
                self.scene = None
        text = sentence(episode)
        if episode.refusal is not None and episode.refusal.code is RefusalCode.AMBIGUOUS:
            self.candidates = episode.refusal.candidates
            text += _unmentioned(episode.refusal)
        return self._noted(prompt, Outcome(text, EXIT_DONE if episode.success else EXIT_FAILED))

    def _where_left(self) -> str:
        if self.away:
            return "the sim is away; look at /scene when it is back"
        if self.interrupts.running:
            return "the skill did not stop in time and was left" + ("; /cancel stops it" if self.link else "")
        return "while planning; the arm holds where it was" if self.interrupts.moved else "nothing has moved"

    def _noted(self, said: str, outcome: Outcome) -> Outcome:
        self.log.append(LogEntry(datetime.now(), said, outcome.text))
        return outcome

    def _note_plan(self, event: events.AgentEvent) -> None:
        if isinstance(event, events.Planned):
            self.plan = event.plan


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _unmentioned(refusal: Refusal) -> str:
    """Return the candidates as a second line where the question does not name them."""
    if all(name in refusal.message for name in refusal.candidates):
        return ""
    return f"\n  could be: {', '.join(refusal.candidates)}"
