"""Budget of asking a model, for a prompt and for a session: turns, tokens, money, seconds, steps.

pydantic-ai limits one run of one agent. A prompt here is several runs (one per call that moves the robot) or several plans, and
a session is several prompts; seconds and steps it does not count at all.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robosandbox.errors import InputError, PlannerAnswerError, PlannerUnavailableError
from robosandbox.validation import parse_yaml, read_text
from robosandbox.values import frozen

if TYPE_CHECKING:
    from pydantic_ai.messages import ModelResponse

# Begins the names of environment variables: ROBOSANDBOX_MODEL_MAX_TOKENS, ROBOSANDBOX_MODEL_SESSION_COST.
_VARIABLE = "ROBOSANDBOX_MODEL_"
_FILE = f"{_VARIABLE}LIMITS"


@frozen(kw_only=True)
class SpendingLimits:
    """Limits of spending; None is no limit.

    Attributes:
        turns: Answers asked for.
        tokens: Of all questions and answers.
        cost: US dollars, as far as prices are known.
        seconds: Of waiting for the model, retries included.
        steps: Skill calls.
    """

    turns: int | None = None
    tokens: int | None = None
    cost: float | None = None
    seconds: float | None = None
    steps: int | None = None


OPTIONS = {
    "max_turns": ("prompt", "turns"),
    "max_tokens": ("prompt", "tokens"),
    "max_cost": ("prompt", "cost"),
    "time_limit": ("prompt", "seconds"),
    "max_steps": ("prompt", "steps"),
    **{f"session_{field.name}": ("session", field.name) for field in fields(SpendingLimits)},
}
"""The options' names, with what they limit."""


@dataclass(slots=True)
class Budget:
    """Budget: limits and what has been spent of them.

    Attributes:
        limits: The limits.
        of: What they are for: "prompt" or "session".
        spent: What has been spent, by the names of the limits.
    """

    limits: SpendingLimits
    of: str = "prompt"
    spent: dict[str, float] = field(
        default_factory=lambda: dict.fromkeys((f.name for f in fields(SpendingLimits)), 0.0)
    )

    def left(self, name: str) -> float:
        """Return how much is left; infinite without a limit."""
        limit = getattr(self.limits, name)
        return float("inf") if limit is None else limit - self.spent[name]

    def add(self, **amounts: float) -> None:
        """Count what was spent, by the names of the limits."""
        for name, amount in amounts.items():
            self.spent[name] += amount

    def take(self, response: ModelResponse) -> None:
        """Count an answer."""
        self.add(turns=1, tokens=response.usage.total_tokens, cost=price(response))

    def check(self, where: str) -> None:
        """Refuse to ask on.

        Raises:
            PlannerAnswerError: Turns, tokens or money are spent.
            PlannerUnavailableError: The time is.
        """
        for name, unit in (("turns", "answers"), ("tokens", "tokens"), ("cost", "US dollars")):
            if self.left(name) <= 0:
                limit, spent = getattr(self.limits, name), self.spent[name]
                raise PlannerAnswerError(
                    f"{where}: {spent:,.6g} {unit} spent without an end; at most {limit:,.6g} for a {self.of}; "
                    f"ask for less at once, or give a higher {self._option(name)}"
                )
        if self.left("seconds") <= 0:
            raise PlannerUnavailableError(
                f"{where}: the {self.limits.seconds:g} s for this {self.of} are spent; give a longer "
                f"{self._option('seconds')}, or use a faster model"
            )

    def _option(self, name: str) -> str:
        option = next(option for option, limit in OPTIONS.items() if limit == (self.of, name))
        return f"--{option.replace('_', '-')}"


def read_limits(given: Mapping[str, Any], file: Path | None = None) -> dict[str, Any]:
    """Return the limits that were said, by their options' names: as options, else in the environment, else in a file.

    Args:
        given: Options by name; None is not said.
        file: YAML with the same names; ROBOSANDBOX_MODEL_LIMITS when left out.

    Raises:
        InputError: A file or value is wrong.
    """
    named = file or os.environ.get(_FILE)
    said = _of_file(Path(named)) if named else {}
    for option in OPTIONS:
        text = os.environ.get(f"{_VARIABLE}{option.upper()}")
        if text:
            said[option] = _number(option, text, f"{_VARIABLE}{option.upper()}")
    return said | {option: given[option] for option in OPTIONS if given.get(option) is not None}


def _of_file(file: Path) -> dict[str, Any]:
    try:
        data = parse_yaml(read_text(file), file.name) or {}
    except InputError as error:
        raise InputError(f"--model-limits: {error}") from None
    if not isinstance(data, dict):
        raise InputError(f"--model-limits: {file}: holds no names with values; write e.g. max_tokens: 50000")
    unknown = next((name for name in data if name not in OPTIONS), None)
    if unknown is not None:
        raise InputError(f"--model-limits: {file}: {str(unknown)[:60]!r} is no limit; there is {', '.join(OPTIONS)}")
    return {name: _number(name, value, f"--model-limits: {file}: {name}") for name, value in data.items()}


def _number(option: str, value: Any, source: str) -> float:
    """Return a limit's number; a whole one where it counts."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = 0.0
    whole = OPTIONS[option][1] in ("turns", "tokens", "steps")
    if not 0.0 < number < float("inf") or (whole and number != int(number)):
        raise InputError(f"{source}: {str(value)[:60]!r}; give a {'whole ' if whole else ''}number above 0")
    return int(number) if whole else number


def price(response: ModelResponse) -> float:
    """Return what an answer costs, US dollars; nothing where no price is known, as of a server of one's own."""
    if response.usage.cost is not None:
        return float(response.usage.cost)
    try:
        return float(response.cost().total_price)
    except (AssertionError, LookupError, ValueError):
        return 0.0
