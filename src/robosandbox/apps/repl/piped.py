"""Lines from a pipe or a file: one command each, one answer each, no escape codes."""

from __future__ import annotations

from collections.abc import Iterable

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_UNAVAILABLE
from robosandbox.apps.commands.live import LiveView
from robosandbox.apps.repl.shell import Shell


def run_lines(shell: Shell, lines: Iterable[str]) -> int:
    """Carry out lines; empty ones and those that begin with # are skipped.

    Returns:
        The exit code: that of the last line that did not succeed, at once where the sim is gone for good.

    Raises:
        KeyboardInterrupt: Ctrl-C came; the running skill was stopped.
    """
    shell.host.events.subscribe(LiveView(plain=True))
    code = EXIT_DONE
    for line in lines:
        said = line.strip()
        if not said or said.startswith("#"):
            continue
        outcome = shell.execute(said)
        if outcome.text:
            print(outcome.text, flush=True)
        code = outcome.code or code
        if shell.interrupts.count:
            raise KeyboardInterrupt
        if outcome.leave or outcome.code == EXIT_UNAVAILABLE:
            break
    return code
