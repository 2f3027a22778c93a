"""What a model thinks aloud before it answers: left out of the answer, and told to whoever watches."""

from __future__ import annotations

import json
import re

from pydantic_ai.messages import ModelResponse, TextPart, ThinkingPart

_THOUGHTS = re.compile(r"<(think|thinking|thought|reasoning)>(.*?)</\1>", re.DOTALL | re.IGNORECASE)
_THOUGHT_ENDS = re.compile(r"\A.*</(?:think|thinking|thought|reasoning)>", re.DOTALL | re.IGNORECASE)
_THOUGHT_BEGINS = re.compile(r"<(?:think|thinking|thought|reasoning)>.*\Z", re.DOTALL | re.IGNORECASE)


def without_thoughts(text: str) -> str:
    """Return a text without what a model thought aloud, also where one of the marks is missing."""
    return _THOUGHT_BEGINS.sub("", _THOUGHT_ENDS.sub("", _THOUGHTS.sub("", text)))


def thought_of(response: ModelResponse) -> str:
    """Return what a model says of why it calls what it calls: in its thoughts, or as `thought` beside a call; "" if nothing."""
    thinking = "".join(part.content for part in response.parts if isinstance(part, ThinkingPart))
    text = "".join(part.content for part in response.parts if isinstance(part, TextPart))
    marked = _THOUGHTS.search(text)
    if thinking or marked is not None:
        return (thinking or (marked[2] if marked else "")).strip()
    try:
        answer = json.loads(text)
    except (ValueError, RecursionError):
        return ""
    said = answer.get("thought") if isinstance(answer, dict) else None
    return said.strip() if isinstance(said, str) else ""
