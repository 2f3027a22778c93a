"""Settings of a model-backed planner, given by the person who starts it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, Literal, get_args
from urllib.parse import urlsplit

from numpy.typing import NDArray

from robosandbox.errors import InputError
from robosandbox.values import frozen
from robosandbox.world.verifier import MAX_STEPS

Service = Literal["openai", "responses", "anthropic"]
Mode = Literal["plan", "act", "code"]
Picture = Callable[[], NDArray[Any]]

KEY_VARIABLES: dict[Service, str] = {
    "openai": "OPENAI_API_KEY",
    "responses": "OPENAI_API_KEY",
    "anthropic": "ANTHROPIC_API_KEY",
}


@frozen(kw_only=True)
class LLMSettings:
    """A model, where it is served, and the limits of one plan.

    Attributes:
        service: The protocol that the endpoint speaks.
        model: The model's name there.
        base_url: The endpoint; None is the service's own.
        cassette: A file that exchanges are recorded to, or replayed from when it exists.
        picture: Takes an RGB picture (height, width, 3) uint8 for models that see; None sends the scene as text alone.
        mode: Whether the model gives whole plans, acts call by call, or acts and may write programs of calls.
        max_turns: Answers asked for, the first included: of a plan, or of a prompt where the model acts.
        max_steps: Skill calls in a plan, or in a prompt where the model acts.
        max_tokens: Of all answers and questions of a prompt together.
        max_cost: US dollars for a prompt, as far as prices are known; None is no limit.
        time_limit: Seconds for a prompt, waiting, retries and new plans after failures included.
        session: Limits of all prompts together, by the names of `Limits`.
        attempts: Requests per answer when the transport fails.
        back_off: Seconds to wait before the second request; doubled each time.
        max_answer_bytes: Of one answer as it arrives.
    """

    service: Service
    model: str
    base_url: str | None = None
    cassette: Path | None = None
    picture: Picture | None = None
    mode: Mode = "plan"
    max_turns: int = 4
    max_steps: int = MAX_STEPS
    max_tokens: int = 60_000
    max_cost: float | None = None
    time_limit: float = 60.0
    session: Mapping[str, float] = field(default_factory=dict)
    attempts: int = 4
    back_off: float = 0.5
    max_answer_bytes: int = 1_000_000

    def __post_init__(self) -> None:
        if self.mode not in get_args(Mode):
            raise InputError(f"--mode: {self.mode!r} is not one of {', '.join(get_args(Mode))}")
        if not self.model.strip():
            raise InputError("--model: is missing; name the model, as in --model gpt-5 or --model qwen3:14b")
        if self.base_url is not None:
            _check_url(self.base_url)
        for name in ("max_turns", "max_steps", "max_tokens", "time_limit", "attempts", "back_off", "max_answer_bytes"):
            if not getattr(self, name) > 0:
                raise InputError(f"--{name.replace('_', '-')}: {getattr(self, name)}; give more than 0")
        if self.max_cost is not None and not self.max_cost > 0:
            raise InputError(f"--max-cost: {self.max_cost}; give US dollars above 0")
        if self.max_steps > MAX_STEPS:
            raise InputError(f"--max-steps: {self.max_steps}; no plan has more than {MAX_STEPS}")


def _check_url(base_url: str) -> None:
    try:
        url = urlsplit(base_url)
        host, _ = url.hostname, url.port
    except ValueError as error:
        raise InputError(f"--base-url: {base_url[:100]!r}: {error}; give e.g. http://127.0.0.1:11434/v1") from None
    if url.username or url.password:
        raise InputError(
            f"--base-url: holds a user or password, which would be logged; give the key in "
            f"{' or '.join(KEY_VARIABLES.values())} instead"
        )
    if url.scheme not in ("http", "https") or not host:
        raise InputError(f"--base-url: {base_url[:100]!r} is no web address; give e.g. http://127.0.0.1:11434/v1")
