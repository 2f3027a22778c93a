"""Thoughts of a model before its answer: left out of the answer, and told to whoever watches."""

from __future__ import annotations

import re
from typing import Any

from pydantic_ai.messages import ModelResponse, TextPart, ThinkingPart
from pydantic_core import from_json

_THOUGHTS = re.compile(r"<(think|thinking|thought|reasoning)>(.*?)</\1>", re.DOTALL | re.IGNORECASE)
_THOUGHT_ENDS = re.compile(r"\A.*</(?:think|thinking|thought|reasoning)>", re.DOTALL | re.IGNORECASE)
_THOUGHT_BEGINS = re.compile(r"<(?:think|thinking|thought|reasoning)>(.*)\Z", re.DOTALL | re.IGNORECASE)

_MARK_BEGINS = re.compile(r"<[/\w]*\Z")
_OPENING = re.compile(r"[{\[]")


def without_thoughts(text: str) -> str:
    """Return a text without what a model thought aloud, also where one of the marks is missing."""
    return _THOUGHT_BEGINS.sub("", _THOUGHT_ENDS.sub("", _THOUGHTS.sub("", text)))


def thought_of(response: ModelResponse) -> str:
    """Return what a model says of why it calls what it calls: in its thoughts, or as `thought` beside a call; "" if nothing.

    Of an answer that is still being written it is the beginning.
    """
    thinking = "".join(part.content for part in response.parts if isinstance(part, ThinkingPart))
    text = "".join(part.content for part in response.parts if isinstance(part, TextPart))
    marked = _THOUGHTS.search(text)
    begun = _THOUGHT_BEGINS.search(text)
    if thinking or marked is not None or begun is not None:
        return (thinking or (marked[2] if marked else _MARK_BEGINS.sub("", begun[1]) if begun else "")).strip()
    answer = json_so_far(text)
    said = answer.get("thought") if isinstance(answer, dict) else None
    return said.strip() if isinstance(said, str) else ""


def json_so_far(text: str) -> Any:
    """Return the JSON value that a text writes or begins to write, from its first bracket on; None where it cannot be read."""
    begin = _OPENING.search(text)
    if begin is None:
        return None
    try:
        return from_json(text[begin.start() :].rstrip("` \n"), allow_partial="trailing-strings")
    except ValueError:
        return None
