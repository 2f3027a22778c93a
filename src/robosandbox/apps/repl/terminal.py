"""Lines from a person: history, completion, a status bar, and the running skill's phase."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from prompt_toolkit import PromptSession
from prompt_toolkit.completion import CompleteEvent, Completer, Completion, PathCompleter
from prompt_toolkit.document import Document
from prompt_toolkit.patch_stdout import patch_stdout

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_UNAVAILABLE
from robosandbox.apps.commands.live import LiveView
from robosandbox.apps.repl.completion import endings, verbs_for
from robosandbox.apps.repl.history import open_history
from robosandbox.apps.repl.shell import Shell
from robosandbox.apps.repl.showing import object_names
from robosandbox.apps.repl.slash import COMMANDS
from robosandbox.apps.repl.typed_ahead import TypedAhead
from robosandbox.cache import state_file
from robosandbox.errors import ServiceUnavailableError, SkillError


class Terminal:
    """Asks for lines until the person leaves.

    Args:
        shell: Carries them out.
    """

    def __init__(self, shell: Shell) -> None:
        self._shell = shell
        self._live = LiveView()
        self._ahead = TypedAhead()
        self._live.watch(shell.workcell.agent, shell.host.events)
        if shell.link is not None:
            shell.link.tell = self._tell
        self._session: PromptSession[str] = PromptSession(
            "> ",
            history=open_history(state_file("history")),
            completer=_Completer(shell),
            complete_while_typing=False,
            bottom_toolbar=self._status,
        )

    def run(self) -> int:
        """Carry out lines.

        Returns:
            The exit code: whether the sim was there at the end.
        """
        self._look_again()
        print(self._greeting())
        while True:
            try:
                if self._ahead.left:
                    break
                if self._ahead.lines:
                    typed = self._ahead.lines.popleft()
                    print(f"> {typed}")
                else:
                    with patch_stdout():
                        typed = self._session.prompt()
                if self._carry_out_all(typed):
                    break
                self._look_again()
            except KeyboardInterrupt:
                continue
            except EOFError:
                break
        return EXIT_UNAVAILABLE if self._shell.away else EXIT_DONE

    def _carry_out_all(self, typed: str) -> bool:
        """Carry out what was typed, or pasted in several lines; return whether it was the last."""
        for line in typed.splitlines():
            if line.strip() and self._carry_out(line):
                return True
            if self._shell.interrupts.count:
                break
        return False

    def _carry_out(self, line: str) -> bool:
        """Carry out a line; return whether it was the last."""
        try:
            with _echo_off(), self._ahead.listening():
                if not line.lstrip().startswith("/"):
                    self._live.show("planning")
                outcome = self._shell.execute(line)
        finally:
            self._live.close()
        if outcome.text:
            print(outcome.text, flush=True)
        return outcome.leave

    def _look_again(self) -> None:
        """See what is there, for completion and the status bar."""
        shell = self._shell
        if shell.scene is not None or shell.away:
            return
        try:
            with shell.interrupts.guard():
                shell.look()
        except (SkillError, ServiceUnavailableError):
            shell.scene = None

    def _greeting(self) -> str:
        shell = self._shell
        seen = f": {', '.join(item.id for item in shell.scene.objects) or 'no objects'}" if shell.scene else ""
        return f"{shell.workcell.task.name} with {shell.robot_name}{seen}\nSay what to do; /help helps, Ctrl-D leaves."

    def _tell(self, line: str) -> None:
        """Say something that happened, from any thread."""
        print(line, flush=True)
        self._session.app.invalidate()

    def _status(self) -> str:
        shell = self._shell
        parts = [shell.workcell.task.name, shell.robot_name]
        if shell.away:
            parts.append("the sim is away")
        elif shell.scene is not None:
            parts.append(f"holds {', '.join(sorted(shell.scene.in_hands)) or 'nothing'}")
        return " " + " | ".join(parts)


class _Completer(Completer):
    """Offers what goes on where the cursor is."""

    def __init__(self, shell: Shell) -> None:
        self._shell = shell
        self._verbs = verbs_for(shell.workcell.agent.skills)
        self._files = PathCompleter(expanduser=True)

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterable[Completion]:
        text = document.text_before_cursor.lstrip()
        command, space, rest = text.partition(" ")
        if not text.startswith("/"):
            yield from self._sentence(text)
        elif not space:
            yield from _offered(text, list(COMMANDS))
        elif command == "/plan":
            yield from self._sentence(rest)
        elif command == "/photo":
            file, space, camera = rest.rpartition(" ")
            if space and file:
                yield from _offered(camera, self._shell.workcell.cameras)
            else:
                yield from self._files.get_completions(Document(rest), complete_event)

    def _sentence(self, text: str) -> Iterator[Completion]:
        scene = self._shell.scene
        names = object_names(scene.objects) if scene else []
        answers = self._shell.candidates
        if answers and not text:
            names = []
        elif " " not in text:
            # A sentence begins with a verb.
            names = [*self._verbs, *names]
        yield from _offered(text, [*answers, *names])


def _offered(text: str, phrases: Iterable[str]) -> Iterator[Completion]:
    for phrase, there in endings(text, list(dict.fromkeys(phrases))):
        yield Completion(phrase, start_position=-there)


@contextmanager
def _echo_off() -> Iterator[None]:
    """Keep what is typed meanwhile off the screen; the next prompt shows it, and Ctrl-C drops it."""
    if sys.platform == "win32":
        yield
        return
    import termios

    terminal = sys.stdin.fileno()
    before = termios.tcgetattr(terminal)
    quiet = [*before]
    quiet[3] &= ~termios.ECHO
    termios.tcsetattr(terminal, termios.TCSADRAIN, quiet)
    try:
        yield
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)
