"""What asking models costs: requests, tokens and seconds, counted for whoever wants to know while work is going on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any


@dataclass(slots=True)
class Usage:
    """What was asked of models so far.

    Attributes:
        requests: Sent, those that failed included.
        input_tokens: Of all questions, as the services counted them.
        output_tokens: Of all answers.
        seconds: From each request to its answer or failure, on the wall clock.
    """

    requests: int = 0
    input_tokens: int = 0
    output_tokens: int = 0
    seconds: float = 0.0

    def record(self) -> dict[str, Any] | None:
        """Return the numbers as JSON data; None where no model was asked."""
        if not self.requests:
            return None
        return {
            "requests": self.requests,
            "input_tokens": self.input_tokens,
            "output_tokens": self.output_tokens,
            "seconds": round(self.seconds, 3),
        }


_METERS: ContextVar[tuple[Usage, ...]] = ContextVar("model usage", default=())


@contextmanager
def metered(usage: Usage | None = None) -> Iterator[Usage]:
    """Count what models are asked within the block, in this context; blocks may be nested.

    Args:
        usage: What is counted into; a new one when left out.
    """
    usage = Usage() if usage is None else usage
    token = _METERS.set((*_METERS.get(), usage))
    try:
        yield usage
    finally:
        _METERS.reset(token)


def count_request(*, seconds: float, input_tokens: int = 0, output_tokens: int = 0) -> None:
    """Add one request to every meter that is open in this context."""
    for usage in _METERS.get():
        usage.requests += 1
        usage.input_tokens += input_tokens
        usage.output_tokens += output_tokens
        usage.seconds += seconds
