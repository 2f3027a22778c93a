"""Stream of a model's text to listeners while it is still being written."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from robosandbox.agent.episode import Writing

Hearer = Callable[[Writing], None]

_HEARER: ContextVar[Hearer | None] = ContextVar("hearer", default=None)


@contextmanager
def overheard(hearer: Hearer | None) -> Iterator[None]:
    """Have models that are asked within the block, in this context, tell what they write as it comes; None: only at the end."""
    token = _HEARER.set(hearer)
    try:
        yield
    finally:
        _HEARER.reset(token)


def hearer() -> Hearer | None:
    """Return who listens in this context; None where nobody does."""
    return _HEARER.get()
