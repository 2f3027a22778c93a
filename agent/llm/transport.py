"""The wire to a model: answers of bounded size, plain bytes only."""

from __future__ import annotations

import urllib.request

import httpx2


class AnswerTooLargeError(Exception):
    """An answer has more bytes than any plan needs."""


class BoundedTransport(httpx2.AsyncBaseTransport):
    """Reads each answer whole, up to a limit.

    Args:
        inner: What sends.
        max_bytes: The most that an answer may have.
    """

    def __init__(self, inner: httpx2.AsyncBaseTransport, max_bytes: int) -> None:
        self._inner = inner
        self._max_bytes = max_bytes

    async def handle_async_request(self, request: httpx2.Request) -> httpx2.Response:
        """Send a request and return the complete answer.

        Raises:
            AnswerTooLargeError: It is longer than the limit, or packed so that its length is not known.
        """
        # A packed answer could unfold to any size.
        request.headers["accept-encoding"] = "identity"
        response = await self._inner.handle_async_request(request)
        try:
            packing = response.headers.get("content-encoding", "identity")
            if packing != "identity":
                raise AnswerTooLargeError(f"the answer is packed ({packing[:20]}) though it was asked for plain")
            body = bytearray()
            async for chunk in response.aiter_raw():
                body += chunk
                if len(body) > self._max_bytes:
                    raise AnswerTooLargeError(f"the answer has more than {self._max_bytes:,} bytes")
        finally:
            await response.aclose()
        headers = [(name, value) for name, value in response.headers.items() if name != "transfer-encoding"]
        return httpx2.Response(response.status_code, headers=headers, content=bytes(body))

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
