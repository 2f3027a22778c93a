"""Outcome of a line of input."""

from __future__ import annotations

from robosandbox.apps.commands.console import EXIT_DONE
from robosandbox.values import frozen


@frozen
class Outcome:
    """Outcome of a line of input.

    Attributes:
        text: For the person; may be empty.
        code: The exit code that a program with this line alone would have.
        leave: Whether no more lines are wanted.
    """

    text: str
    code: int = EXIT_DONE
    leave: bool = False
