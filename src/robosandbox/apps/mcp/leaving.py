"""Clients over HTTP that go away before they are answered: what they asked for is given up."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable
from typing import TypeVar

import anyio
import mcp_types as types
from mcp.shared.exceptions import MCPError
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from robosandbox.apps.mcp.own import Context

ValueT = TypeVar("ValueT")
# In a request's scope: an event that is set when its client has gone.
_GONE = "robosandbox.gone"


def telling_who_left(app: ASGIApp) -> ASGIApp:
    """Return the application with an event in each request's scope that tells when its client has gone."""

    async def told(scope: Scope, receive: Receive, send: Send) -> None:
        gone = scope[_GONE] = asyncio.Event()

        async def heard() -> Message:
            message = await receive()
            if message["type"] == "http.disconnect":
                gone.set()
            return message

        await app(scope, heard, send)

    return told


async def while_there(ctx: Context, work: Awaitable[ValueT]) -> ValueT:
    """Return what comes of work; it is cancelled when the client that waits for it over HTTP has gone.

    Raises:
        MCPError: It has, and nobody hears of it.
    """
    gone: asyncio.Event | None = ctx.request.scope.get(_GONE) if ctx.request is not None else None
    if gone is None:
        return await work
    async with anyio.create_task_group() as tasks:

        async def watch() -> None:
            await gone.wait()
            tasks.cancel_scope.cancel()

        tasks.start_soon(watch)
        result = await work
        tasks.cancel_scope.cancel()
        return result
    raise MCPError(types.INTERNAL_ERROR, "the client has gone")
