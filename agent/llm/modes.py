"""In which way a server can be held to the form of an answer, and which of the ways it is known to keep."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from robosandbox.agent.llm.settings import LLMSettings


class Mode(StrEnum):
    """How an answer is asked for, the most binding first."""

    SCHEMA = "schema"
    """The server writes JSON by a schema and nothing else (`response_format`, `output_config.format`)."""
    TOOLS = "tools"
    """The model must call one of the tools (`tool_choice` required, Anthropic's `any`)."""
    TEXT = "text"
    """The form is only described; the answer is read from the text."""

    @property
    def next(self) -> Mode | None:
        """What to try where this mode does not work; None after the last."""
        modes = list(Mode)
        later = modes[modes.index(self) + 1 :]
        return later[0] if later else None


@dataclass
class KnownModes:
    """Which mode gave a readable answer, by endpoint and model; what is not known yet begins with the most binding one."""

    _works: dict[tuple[str, str, str], Mode] = field(default_factory=dict)

    def best(self, settings: LLMSettings, url: str) -> Mode:
        """Return the mode to begin with."""
        return self._works.get((settings.service, url, settings.model), Mode.SCHEMA)

    def works(self, settings: LLMSettings, url: str, mode: Mode) -> bool:
        """Say whether a mode has given a readable answer."""
        return self._works.get((settings.service, url, settings.model)) is mode

    def remember(self, settings: LLMSettings, url: str, mode: Mode) -> None:
        """Note that a mode works."""
        self._works[settings.service, url, settings.model] = mode


_OF_THIS_PROCESS = KnownModes()


def known_modes(settings: LLMSettings) -> KnownModes:
    """Return what this process has learnt; nothing yet for a cassette, which must replay what was recorded from the start."""
    return KnownModes() if settings.cassette is not None else _OF_THIS_PROCESS
