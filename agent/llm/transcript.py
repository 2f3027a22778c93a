"""An exchange with a model as text, for people to read and for the record of an episode."""

from __future__ import annotations

import json
from collections.abc import Sequence

from pydantic_ai.messages import (
    BinaryContent,
    ModelMessage,
    ModelRequest,
    ModelResponse,
    RetryPromptPart,
    TextPart,
    ThinkingPart,
    ToolCallPart,
    ToolReturnPart,
    UserPromptPart,
)


def asked(messages: Sequence[ModelMessage]) -> str:
    """Return what is new in a conversation: its last request, without the instructions that every request repeats."""
    newest = next(message for message in reversed(messages) if isinstance(message, ModelRequest))
    texts = []
    for part in newest.parts:
        if isinstance(part, UserPromptPart):
            content = [part.content] if isinstance(part.content, str) else part.content
            texts += [
                item if isinstance(item, str) else f"({item.media_type})" if isinstance(item, BinaryContent) else ""
                for item in content
            ]
        elif isinstance(part, ToolReturnPart | RetryPromptPart):
            texts.append(part.content if isinstance(part.content, str) else json.dumps(part.content, default=str))
    return "\n\n".join(text for text in texts if text)


def answered(response: ModelResponse) -> str:
    """Return an answer: its text as it is, calls as JSON, thoughts between marks."""
    texts = []
    for part in response.parts:
        if isinstance(part, TextPart):
            texts.append(part.content)
        elif isinstance(part, ThinkingPart):
            texts.append(f"<think>{part.content}</think>")
        elif isinstance(part, ToolCallPart):
            texts.append(json.dumps({"name": part.tool_name, "arguments": part.args}))
    return "\n".join(text for text in texts if text)
