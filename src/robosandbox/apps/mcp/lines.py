"""Lines of stdin as the protocol's messages, read so that a signal can end the server, and answered where they are none."""

from __future__ import annotations

import asyncio
import json
import os
import threading
from typing import Self

import mcp_types as types
from mcp.shared.message import SessionMessage

_BYTES = 65536  # Bytes that are read at a time, as a pipe holds.
_SHOWN = 60  # Characters of a wrong line that are told.


class Lines:
    """Yields the lines of a descriptor, which from here on reads as empty for everybody else.

    They are read on a thread that nobody waits for: one of the event loop's would hold up Ctrl-C until the next line.

    Args:
        descriptor: Of stdin.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = os.dup(descriptor)
        empty = os.open(os.devnull, os.O_RDONLY)
        os.dup2(empty, descriptor)
        os.close(empty)
        self._lines: asyncio.Queue[str | None] = asyncio.Queue()
        self._loop = asyncio.get_running_loop()
        threading.Thread(target=self._read, name="stdin", daemon=True).start()

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> str:
        line = await self._lines.get()
        if line is None:
            raise StopAsyncIteration
        return line

    def _read(self) -> None:
        rest = b""
        while data := os.read(self._descriptor, _BYTES):
            *lines, rest = (rest + data).split(b"\n")
            for line in lines:
                self._put(line.decode("utf-8", errors="replace"))
        if rest:
            self._put(rest.decode("utf-8", errors="replace"))
        self._put(None)

    def _put(self, line: str | None) -> None:
        if (line is None or line.strip()) and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._lines.put_nowait, line)


def read_message(line: str) -> SessionMessage:
    """Return a line's message, or the error that answers a line which is none; with the line's id where it has one."""
    try:
        return SessionMessage(types.jsonrpc_message_adapter.validate_json(line, by_name=False))
    except ValueError:
        pass
    number: str | int | None = None
    try:
        data = json.loads(line)
    except (ValueError, RecursionError) as error:
        code, problem = types.PARSE_ERROR, f"is no JSON: {error}"
    else:
        code, problem = types.INVALID_REQUEST, "is no JSON-RPC 2.0 message, or holds half a character"
        match data:
            case {"id": bool()}:
                pass
            case {"id": int(found)}:
                number = found
            case {"id": str(found)} if found.isprintable():
                # Half a character cannot be sent back either.
                number = found
    told = types.ErrorData(code=code, message=f"{line[:_SHOWN]!a} {problem}")
    return SessionMessage(types.JSONRPCError(jsonrpc="2.0", id=number, error=told))
