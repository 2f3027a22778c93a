"""HTTP connections that have to bring a whole request within seconds: half-open ones are closed."""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

# Seconds between two looks at a connection, the second of which closes it: as long as uvicorn keeps an idle one.
_LOOK_SECONDS = 5.0


class WholeRequests(H11Protocol):
    """A connection that is closed where a request is not whole 5 to 10 s after it began; the client is on this machine."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to look."""
        super().connection_made(transport)
        self._begun: Any = None
        self._look()

    def _look(self, late: bool = False) -> None:
        """Close the connection if the same request is not whole as at the look before, and look again later."""
        if self.transport.is_closing():
            return
        cycle = self.cycle
        # Without a cycle no head of a request has come; a kept-alive connection has one that is complete.
        partial = cycle is None or cycle.more_body or (cycle.response_complete and self.conn.trailing_data[0] != b"")
        if late and partial and cycle is self._begun:
            self.transport.close()
            return
        self._begun = cycle
        self.loop.call_later(_LOOK_SECONDS, self._look, partial)
