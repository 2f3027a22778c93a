"""One goal at a time, near or remote: what was cancelled before it is forgotten."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_goal(cancelled: threading.Event, timeout: float | None) -> Iterator[None]:
    """Run one goal.

    Args:
        cancelled: Set by whoever stops it; cleared before and after.
        timeout: Simulated seconds that it may take; None is no limit.

    Raises:
        ValueError: The timeout is not positive.
    """
    if timeout is not None and not timeout > 0.0:
        raise ValueError(f"timeout is {timeout}; it takes seconds above 0")
    cancelled.clear()
    try:
        yield
    finally:
        cancelled.clear()
