"""An answer while it is being written: the thought so far, and the calls that are complete. Nothing of it is checked yet."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

from pydantic_ai.messages import ModelResponse, TextPart, ToolCallPart

from robosandbox.agent.episode import Writing
from robosandbox.agent.llm.forms import MisuseError, as_call, json_so_far, thought_of, without_thoughts
from robosandbox.agent.overheard import Hearer
from robosandbox.types import SkillCall

# Seconds between two looks at an answer. Chosen: ten a second look continuous, and reading it costs a fraction of that.
_PAUSE = 0.1


class AnswerStream:
    """Tells what is new in an answer that grows.

    Args:
        hearer: Who is told.
    """

    def __init__(self, hearer: Hearer) -> None:
        self._hearer = hearer
        self._thought = ""
        self._calls = 0
        self._looked = 0.0

    @property
    def due(self) -> bool:
        """True when it is time to look again."""
        return time.monotonic() - self._looked >= _PAUSE

    def show(self, response: ModelResponse, *, whole: bool) -> None:
        """Tell what has come since the last time.

        Args:
            response: The answer so far.
            whole: Whether it is complete; until then the last call may break off and is not told.
        """
        self._looked = time.monotonic()
        thought, calls = thought_of(response), list(_calls_in(response))
        calls = calls if whole else calls[:-1]
        new = thought[len(self._thought) :] if thought.startswith(self._thought) else ""
        if new or calls[self._calls :]:
            self._hearer(Writing(thought=new, calls=tuple(calls[self._calls :])))
            self._thought, self._calls = (thought if new else self._thought), max(self._calls, len(calls))


def _calls_in(response: ModelResponse) -> Iterator[SkillCall]:
    """Yield the calls of an answer in whatever form, the one that is being written included."""
    parts = [part for part in response.parts if isinstance(part, ToolCallPart)]
    for part in parts:
        arguments = part.args if isinstance(part.args, dict) else json_so_far(part.args or "{}")
        yield from _calls_of({"name": part.tool_name, "arguments": arguments})
    if not parts:
        yield from _calls_of(
            json_so_far(without_thoughts("".join(p.content for p in response.parts if isinstance(p, TextPart))))
        )


def _calls_of(value: Any) -> Iterator[SkillCall]:
    """Yield the calls in a JSON value; a call with `steps` stands for these."""
    if isinstance(value, list):
        for item in value:
            yield from _calls_of(item)
    if not isinstance(value, dict):
        return
    try:
        call = as_call(value)
    except MisuseError:
        return
    inner = value if call is None else call.arguments
    if call is not None and not (isinstance(inner, dict) and "steps" in inner):
        yield SkillCall.model_construct(skill=call.name, arguments=inner if isinstance(inner, dict) else {})
        return
    for item in inner.values() if isinstance(inner, dict) else ():
        yield from _calls_of(item)
