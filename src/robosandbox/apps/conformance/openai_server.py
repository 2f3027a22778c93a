"""A local HTTP server that speaks OpenAI's chat completions and responses and answers from a script: no mock.

```python
with ScriptedServer(plan(("pick", {"object": "red_cube"}))) as server:
    open_session(planner="openai", planner_options={"base_url": server.url, "model": "scripted"})
```
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Self

from robosandbox.apps.conformance.openai_stream import chat_events, response_events
from robosandbox.values import frozen


@frozen(kw_only=True)
class HttpAnswer:
    """One HTTP answer.

    Attributes:
        status: HTTP status.
        body: What is sent.
        headers: Besides the content's type and length.
        send: How many bytes of the body are sent; None is all.
        then: After them: done, drop the connection, or stall until the server closes.
    """

    status: int = 200
    body: bytes = b""
    headers: Mapping[str, str] = field(default_factory=dict)
    send: int | None = None
    then: str = "done"


Script = HttpAnswer | Callable[[dict[str, Any]], HttpAnswer]


def tool_calls(*calls: tuple[str, str], finish: str = "tool_calls", tokens: int = 100) -> HttpAnswer:
    """Return an answer with these tool calls: name and arguments as the text that the model wrote."""
    return _completion(
        {
            "role": "assistant",
            "content": None,
            "tool_calls": [
                {"id": f"call_{i}", "type": "function", "function": {"name": name, "arguments": arguments}}
                for i, (name, arguments) in enumerate(calls)
            ],
        },
        finish,
        tokens,
    )


def plan(*steps: tuple[str, Mapping[str, Any]]) -> HttpAnswer:
    """Return an answer that plans these skill calls."""
    return tool_calls(("plan", json.dumps({"steps": [{"skill": name, "arguments": args} for name, args in steps]})))


def refuse(code: str, message: str, candidates: Sequence[str] = ()) -> HttpAnswer:
    """Return an answer that refuses."""
    return tool_calls(("refuse", json.dumps({"code": code, "message": message, "candidates": list(candidates)})))


def says(text: str) -> HttpAnswer:
    """Return an answer in plain words."""
    return _completion({"role": "assistant", "content": text}, "stop", 100)


def fails(status: int, message: str, **headers: str) -> HttpAnswer:
    """Return an error of the service; `retry_after="2"` sends that header."""
    body = json.dumps({"error": {"message": message, "type": "error", "param": None, "code": None}})
    return HttpAnswer(status=status, body=body.encode(), headers={k.replace("_", "-"): v for k, v in headers.items()})


def _completion(message: Mapping[str, Any], finish: str, tokens: int) -> HttpAnswer:
    body = {
        "id": "chatcmpl-1",
        "object": "chat.completion",
        "created": 1,
        "model": "scripted",
        "choices": [{"index": 0, "message": message, "finish_reason": finish}],
        "usage": {"prompt_tokens": tokens, "completion_tokens": tokens, "total_tokens": 2 * tokens},
    }
    return HttpAnswer(body=json.dumps(body).encode())


def _as_response(answer: HttpAnswer) -> HttpAnswer:
    """Return a chat completion as the newer protocol writes it; an error is the same in both."""
    if answer.status != 200:
        return answer
    completion = json.loads(answer.body)
    message, usage = completion["choices"][0]["message"], completion["usage"]
    output: list[dict[str, Any]] = [
        {
            "type": "function_call",
            "id": f"fc_{index}",
            "call_id": call["id"],
            "status": "completed",
            "name": call["function"]["name"],
            "arguments": call["function"]["arguments"],
        }
        for index, call in enumerate(message.get("tool_calls", ()))
    ]
    if message["content"] is not None:
        text = {"type": "output_text", "text": message["content"], "annotations": []}
        output.append({"type": "message", "id": "m", "role": "assistant", "status": "completed", "content": [text]})
    body = {
        "id": "resp_1",
        "object": "response",
        "created_at": 1,
        "model": "scripted",
        "status": "completed",
        "output": output,
        "parallel_tool_calls": True,
        "tool_choice": "auto",
        "tools": [],
        "usage": {
            "input_tokens": usage["prompt_tokens"],
            "output_tokens": usage["completion_tokens"],
            "total_tokens": usage["total_tokens"],
            "input_tokens_details": {"cached_tokens": 0},
            "output_tokens_details": {"reasoning_tokens": 0},
        },
    }
    return replace(answer, body=json.dumps(body).encode())


def _as_events(answer: HttpAnswer) -> HttpAnswer:
    """Return an answer as it is sent piece by piece; one that is no answer of the protocol is sent as it is."""
    try:
        whole = json.loads(answer.body)
        events = chat_events(whole) if "choices" in whole else response_events(whole)
    except (ValueError, KeyError, TypeError):
        return answer
    return replace(answer, body=events)


class ScriptedServer:
    """Answers chat completions from a script, one answer per request, on a free port of 127.0.0.1.

    Args:
        script: Answers, or functions from a request's body to one.
        rest: Answers what is asked after the last of them; left out, the server says 500, to be tried again at once.
        streams: Whether what is asked for piece by piece is answered so.

    Attributes:
        requests: The bodies received, in order.
        headers: The headers of each.
    """

    def __init__(self, *script: Script, rest: Script | None = None, streams: bool = True) -> None:
        self._script = list(script)
        self._rest = rest
        self.streams = streams
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self.requests: list[dict[str, Any]] = []
        self.headers: list[dict[str, str]] = []
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(self))
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)

    @property
    def url(self) -> str:
        """URL for `--base-url`."""
        return f"http://127.0.0.1:{self._server.server_address[1]}/v1"

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def _answer(self, body: dict[str, Any], headers: dict[str, str]) -> HttpAnswer:
        with self._lock:
            self.requests.append(body)
            self.headers.append(headers)
            item = self._script.pop(0) if self._script else self._rest
        if item is None:
            return fails(500, "the script has ended", retry_after="0")
        return item if isinstance(item, HttpAnswer) else item(body)


def _handler(script: ScriptedServer) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_POST(self) -> None:
            body = json.loads(self.rfile.read(int(self.headers["content-length"])))
            answer = script._answer(body, {name.lower(): value for name, value in self.headers.items()})
            if self.path.endswith("/responses"):
                answer = _as_response(answer)
            kind = "application/json"
            if body.get("stream") and script.streams and answer.status == 200:
                answer, kind = _as_events(answer), "text/event-stream"
            self.send_response(answer.status)
            self.send_header("content-type", kind)
            self.send_header("content-length", str(len(answer.body)))
            for name, value in answer.headers.items():
                self.send_header(name, value)
            self.end_headers()
            try:
                self.wfile.write(answer.body[: answer.send])
                self.wfile.flush()
            except OSError:
                # The client has seen enough and hung up.
                self.close_connection = True
                return
            if answer.then == "stall":
                script._closing.wait()
            if answer.then != "done":
                self.close_connection = True

        def log_message(self, format: str, *args: Any) -> None:
            del format, args

    return Handler
