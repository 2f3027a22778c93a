"""A whole answer of OpenAI's chat completions or responses as the events in which the service sends it piece by piece."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

_PIECE = 8  # Characters of a piece. Chosen: about two tokens, so that words and names break.


def chat_events(completion: Mapping[str, Any]) -> bytes:
    """Return a chat completion as server-sent events."""
    head = {key: completion[key] for key in ("id", "created", "model")} | {"object": "chat.completion.chunk"}
    choice = completion["choices"][0]
    deltas = [{"role": "assistant", "content": ""}, *_deltas(choice["message"])]
    chunks = [{**head, "choices": [{"index": 0, "delta": delta, "finish_reason": None}]} for delta in deltas]
    chunks.append({**head, "choices": [{"index": 0, "delta": {}, "finish_reason": choice["finish_reason"]}]})
    chunks.append({**head, "choices": [], "usage": completion["usage"]})
    return "".join(f"data: {json.dumps(chunk)}\n\n" for chunk in chunks).encode() + b"data: [DONE]\n\n"


def _deltas(message: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    yield from ({"content": piece} for piece in _pieces(message.get("content") or ""))
    for index, call in enumerate(message.get("tool_calls", ())):
        function = call["function"]
        begin = {"index": index, "id": call["id"], "type": "function"}
        yield {"tool_calls": [{**begin, "function": {"name": function["name"], "arguments": ""}}]}
        for piece in _pieces(function["arguments"]):
            yield {"tool_calls": [{"index": index, "function": {"arguments": piece}}]}


def response_events(response: Mapping[str, Any]) -> bytes:
    """Return a response as server-sent events."""
    begun = {**response, "status": "in_progress", "output": []}
    events: list[dict[str, Any]] = [{"type": "response.created", "response": begun}]
    for index, item in enumerate(response["output"]):
        at: dict[str, Any] = {"output_index": index, "item_id": item["id"]}
        empty = {**item, "status": "in_progress", **({"arguments": ""} if "arguments" in item else {"content": []})}
        events.append({"type": "response.output_item.added", "output_index": index, "item": empty})
        events += _arguments(item, at) if "arguments" in item else _text(item, at)
        events.append({"type": "response.output_item.done", "output_index": index, "item": item})
    events.append({"type": "response.completed", "response": response})
    numbered = [{**event, "sequence_number": number} for number, event in enumerate(events)]
    return "".join(f"event: {event['type']}\ndata: {json.dumps(event)}\n\n" for event in numbered).encode()


def _arguments(item: Mapping[str, Any], at: Mapping[str, Any]) -> list[dict[str, Any]]:
    deltas = [
        {"type": "response.function_call_arguments.delta", **at, "delta": piece} for piece in _pieces(item["arguments"])
    ]
    done = {"type": "response.function_call_arguments.done", **at, "name": item["name"], "arguments": item["arguments"]}
    return [*deltas, done]


def _text(item: Mapping[str, Any], at: Mapping[str, Any]) -> list[dict[str, Any]]:
    part = item["content"][0]
    at = {**at, "content_index": 0}
    deltas = [
        {"type": "response.output_text.delta", **at, "delta": piece, "logprobs": []} for piece in _pieces(part["text"])
    ]
    return [
        {"type": "response.content_part.added", **at, "part": {**part, "text": ""}},
        *deltas,
        {"type": "response.output_text.done", **at, "text": part["text"], "logprobs": []},
        {"type": "response.content_part.done", **at, "part": part},
    ]


def _pieces(text: str) -> Iterator[str]:
    return (text[begin : begin + _PIECE] for begin in range(0, len(text), _PIECE))
