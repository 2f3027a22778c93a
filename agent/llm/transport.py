"""The wire to a model: answers of bounded size, plain bytes only, whole or piece by piece."""

from __future__ import annotations

import json
import urllib.request
from collections.abc import AsyncIterator
from http import HTTPStatus

import httpx2


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
