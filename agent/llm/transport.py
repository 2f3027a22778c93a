"""The wire to a model: answers of bounded size, whole or piece by piece, recorded to a cassette and replayed from it.

A cassette has a line of JSON per exchange: what was asked, and the answer or the failure. Headers, and with them keys, are left
out, and pictures are replaced by their media type.
"""

from __future__ import annotations

import json
import re
import urllib.request
from collections.abc import AsyncIterator, Sequence
from http import HTTPStatus
from pathlib import Path
from typing import Any

import httpx2

from robosandbox.errors import InputError

VERSION = 1
_KEPT_HEADERS = ("content-type", "retry-after", "retry-after-ms")
_PICTURE = re.compile(r"data:([\w/+.-]+);base64,[A-Za-z0-9+/=]+")
_COMPARED = (
    "model",
    "system",
    "instructions",
    "messages",
    "input",
    "tools",
    "response_format",
    "text",
    "output_config",
)
_FAILURES: dict[str, type[httpx2.TransportError]] = {
    cls.__name__: cls
    for cls in (
        httpx2.ConnectError,
        httpx2.ConnectTimeout,
        httpx2.ReadError,
        httpx2.ReadTimeout,
        httpx2.WriteError,
        httpx2.WriteTimeout,
        httpx2.RemoteProtocolError,
    )
}


class AnswerTooLargeError(Exception):
    """An answer has more bytes than any plan needs."""


class NotStreamedError(Exception):
    """An answer that was to come piece by piece comes whole."""


class _Bounded(httpx2.AsyncByteStream):
    """The pieces of an answer, up to a limit."""

    def __init__(self, response: httpx2.Response, max_bytes: int) -> None:
        self._response = response
        self._max_bytes = max_bytes

    async def __aiter__(self) -> AsyncIterator[bytes]:
        length = 0
        async for chunk in self._response.aiter_raw():
            length += len(chunk)
            if length > self._max_bytes:
                raise AnswerTooLargeError(f"the answer has more than {self._max_bytes:,} bytes")
            yield chunk

    async def aclose(self) -> None:
        await self._response.aclose()


class BoundedTransport(httpx2.AsyncBaseTransport):
    """Reads each answer up to a limit: whole, or piece by piece where a request asks for that.

    Args:
        inner: What sends.
        max_bytes: The most that an answer may have.
    """

    def __init__(self, inner: httpx2.AsyncBaseTransport, max_bytes: int) -> None:
        self._inner = inner
        self._max_bytes = max_bytes

    async def handle_async_request(self, request: httpx2.Request) -> httpx2.Response:
        """Send a request and return the answer.

        Raises:
            AnswerTooLargeError: It is longer than the limit, or packed so that its length is not known.
            NotStreamedError: It was to come piece by piece and does not.
        """
        # A packed answer could unfold to any size.
        request.headers["accept-encoding"] = "identity"
        response = await self._inner.handle_async_request(request)
        pieces = _Bounded(response, self._max_bytes)
        try:
            packing = response.headers.get("content-encoding", "identity")
            if packing != "identity":
                raise AnswerTooLargeError(f"the answer is packed ({packing[:20]}) though it was asked for plain")
            if response.status_code == HTTPStatus.OK and json.loads(request.content).get("stream"):
                kind = response.headers.get("content-type", "none")
                if not kind.startswith("text/event-stream"):
                    raise NotStreamedError(f"the answer's type is {kind[:60]}")
                return httpx2.Response(response.status_code, headers=response.headers, stream=pieces)
            body = b"".join([chunk async for chunk in pieces])
        except BaseException:
            await response.aclose()
            raise
        await response.aclose()
        headers = [(name, value) for name, value in response.headers.items() if name != "transfer-encoding"]
        return httpx2.Response(response.status_code, headers=headers, content=body)

    async def aclose(self) -> None:
        """Close connections."""
        await self._inner.aclose()


def live_transport(url: str, max_bytes: int) -> BoundedTransport:
    """Return a transport to a URL, through the proxy that the environment names for it."""
    parts = httpx2.URL(url)
    bypass = urllib.request.proxy_bypass(parts.host)
    proxies = urllib.request.getproxies()
    proxy = None if bypass else proxies.get(parts.scheme) or proxies.get("all")
    return BoundedTransport(httpx2.AsyncHTTPTransport(proxy=proxy), max_bytes)


class CassetteRecorder(httpx2.AsyncBaseTransport):
    """Appends each exchange to a file as it happens.

    Args:
        inner: What sends.
        path: The file; its folder must exist.
        secrets: Keys that must not appear in it even when an answer repeats them.
    """

    def __init__(self, inner: httpx2.AsyncBaseTransport, path: Path, secrets: Sequence[str]) -> None:
        self._inner = inner
        self._path = path
        self._secrets = tuple(secrets)

    async def handle_async_request(self, request: httpx2.Request) -> httpx2.Response:
        """Send a request and write down what came of it."""
        asked = _asked(request)
        try:
            response = await self._inner.handle_async_request(request)
            body = await response.aread()
        except httpx2.TransportError as error:
            known = next((name for name, cls in _FAILURES.items() if isinstance(error, cls)), "ReadError")
            self._append({"request": asked, "failure": {"kind": known, "message": str(error)}})
            raise
        except Exception as error:
            self._append({"request": asked, "failure": {"kind": type(error).__name__, "message": str(error)}})
            raise
        headers = {name: response.headers[name] for name in _KEPT_HEADERS if name in response.headers}
        answer = {"status": response.status_code, "headers": headers, "body": body.decode("utf-8", "replace")}
        self._append({"request": asked, "response": answer})
        return httpx2.Response(response.status_code, headers=response.headers, content=body)

    async def aclose(self) -> None:
        """Close connections."""
        await self._inner.aclose()

    def _append(self, exchange: dict[str, Any]) -> None:
        line = json.dumps({"version": VERSION, **exchange}, ensure_ascii=False)
        for secret in self._secrets:
            line = line.replace(secret, "***")
        try:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        except OSError as error:
            raise InputError(f"--cassette: {self._path} cannot be written: {error.strerror}") from None


class Player(httpx2.AsyncBaseTransport):
    """Answers from a file, in order, and only what was asked when it was recorded.

    Args:
        path: The file.

    Raises:
        InputError: It is no cassette.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._exchanges = _read(path)
        self._next = 0

    async def handle_async_request(self, request: httpx2.Request) -> httpx2.Response:
        """Return the next answer.

        Raises:
            InputError: Something else is asked than was recorded.
        """
        number = self._next + 1
        if self._next >= len(self._exchanges):
            raise self._differs(f"holds {len(self._exchanges)} exchanges and a {number}th is asked for")
        exchange = self._exchanges[self._next]
        self._next += 1
        was, now = exchange["request"]["body"], _asked(request)["body"]
        for key in _COMPARED:
            if was.get(key) != now.get(key):
                raise self._differs(f"exchange {number} was recorded with other {key}")
        failure = exchange.get("failure")
        if failure is not None:
            raise _FAILURES.get(failure["kind"], httpx2.ReadError)(failure["message"], request=request)
        answer = exchange["response"]
        return httpx2.Response(answer["status"], headers=answer["headers"], content=answer["body"].encode())

    def _differs(self, how: str) -> InputError:
        return InputError(
            f"--cassette: {self._path} {how}: prompt, scene, skills or program have changed; "
            "delete the file to record it anew"
        )


def _asked(request: httpx2.Request) -> dict[str, Any]:
    body = json.loads(request.content)
    return {"method": request.method, "path": request.url.path, "body": _without_pictures(body)}


def _without_pictures(value: Any) -> Any:
    match value:
        case dict():
            if value.get("type") == "base64" and isinstance(value.get("data"), str):
                return {**value, "data": "(a picture)"}
            return {key: _without_pictures(item) for key, item in value.items()}
        case list():
            return [_without_pictures(item) for item in value]
        case str():
            return _PICTURE.sub(r"data:\1 (a picture)", value)
        case _:
            return value


def _read(path: Path) -> list[dict[str, Any]]:
    exchanges = []
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"--cassette: {path} cannot be read: {error}") from None
    for number, line in enumerate(lines, start=1):
        exchange = _exchange(line)
        if exchange is None:
            raise InputError(
                f"--cassette: {path} line {number} is no recorded exchange; delete the file to record anew"
            )
        exchanges.append(exchange)
    return exchanges


def _exchange(line: str) -> dict[str, Any] | None:
    try:
        exchange: dict[str, Any] = json.loads(line)
        known = exchange["version"] == VERSION and isinstance(exchange["request"]["body"], dict)
        failed = isinstance(exchange.get("failure"), dict)
        answered = failed or {"status", "headers", "body"} <= exchange["response"].keys()
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
    return exchange if known and answered else None
