"""Usage of models: requests, tokens, seconds, money, and each exchange, for whoever wants to know."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import asdict, dataclass, field
from typing import Any

from robosandbox.values import frozen


@frozen(kw_only=True)
class Exchange:
    """One request and what came of it.

    Attributes:
        asked: What was new in it, as text; pictures by their media type.
        answered: The answer as text, with calls as JSON and thoughts in `<think>`; "" where there was none.
        mode: How the model was held to a form.
        input_tokens: Of the question, as the service counted them.
        output_tokens: Of the answer.
        cost: US dollars, as far as the price is known.
        seconds: From the request to the answer or failure, on the wall clock.
    """

    asked: str = ""
    answered: str = ""
    mode: str = ""
    input_tokens: int = 0
    output_tokens: int = 0
    cost: float = 0.0
    seconds: float = 0.0


@dataclass(slots=True)
class Usage:
    """Requests to models so far, and their cost.

    Attributes:
        exchanges: Every request, those that failed included, in order.
        sent_back: Why answers, and calls in them, were sent back in place of being carried out: their form, or the check.
    """

    exchanges: list[Exchange] = field(default_factory=list)
    sent_back: list[str] = field(default_factory=list)

    @property
    def requests(self) -> int:
        """Number of requests sent."""
        return len(self.exchanges)

    @property
    def input_tokens(self) -> int:
        """Tokens of all questions."""
        return sum(one.input_tokens for one in self.exchanges)

    @property
    def output_tokens(self) -> int:
        """Tokens of all answers."""
        return sum(one.output_tokens for one in self.exchanges)

    @property
    def seconds(self) -> float:
        """Seconds waited for all of them."""
        return sum(one.seconds for one in self.exchanges)

    @property
    def cost(self) -> float:
        """US dollars of all of them, as far as prices are known."""
        return sum(one.cost for one in self.exchanges)

    def record(self) -> dict[str, Any] | None:
        """Return the numbers as JSON data; None where no model was asked."""
        if not self.requests:
            return None
        return {
            "requests": self.requests,
            "input_tokens": self.input_tokens,
            "output_tokens": self.output_tokens,
            "seconds": round(self.seconds, 3),
            "cost": round(self.cost, 6),
            "sent_back": len(self.sent_back),
        }

    def __str__(self) -> str:
        """Return what was asked in a line: "2 requests, 1,240 tokens in, 38 out, 3.1 s, $0.0021; 1 answer sent back"."""
        said = f"{_counted(self.requests, 'request')}, {self.input_tokens:,} tokens in, {self.output_tokens:,} out"
        said += f", {self.seconds:.1f} s" + (f", ${self.cost:.4f}" if self.cost else "")
        return said + (f"; {_counted(len(self.sent_back), 'answer')} sent back" if self.sent_back else "")

    def transcript(self) -> list[dict[str, Any]]:
        """Return the exchanges as JSON data."""
        return [{**asdict(one), "seconds": round(one.seconds, 3)} for one in self.exchanges]


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


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


def count_exchange(exchange: Exchange) -> None:
    """Add one request to every meter that is open in this context."""
    for usage in _METERS.get():
        usage.exchanges.append(exchange)


def count_sent_back(reason: str) -> None:
    """Note in every meter that is open in this context why an answer, or a call in it, was sent back."""
    for usage in _METERS.get():
        usage.sent_back.append(reason)
