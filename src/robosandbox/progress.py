"""Progress messages of the process for a person who waits: long work tells them, front ends show them.

Long work runs inside `doing("loading panda.xml")`. The logger `robosandbox.progress` gets a record at level INFO whenever
what is being done changes; an empty message means that nothing long is.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager

LOGGER = logging.getLogger("robosandbox.progress")

_local = threading.local()


def nothing_done() -> None:
    """Tell that the next move is another's: of the person who is asked for a line, or of a client that is waited for."""
    LOGGER.info("")


@contextmanager
def doing(what: str) -> Iterator[None]:
    """Tell that something long is being done; inside another such block, in place of that one.

    Args:
        what: A verb form and its object, as "measuring the gripper of ur5e.xml".
    """
    stack: list[str] = getattr(_local, "stack", [])
    _local.stack = [*stack, what]
    LOGGER.info("%s", what)
    try:
        yield
    finally:
        _local.stack = stack
        LOGGER.info("%s", stack[-1] if stack else "")
