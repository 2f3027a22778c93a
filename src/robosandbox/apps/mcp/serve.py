"""Serving: over stdin and stdout, or over streamable HTTP on the loopback interface and nowhere else."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import sys
from collections.abc import AsyncIterator
from typing import Any

import anyio
import mcp_types as types
import uvicorn
from mcp.server import Server
from mcp.server.stdio import stdio_server
from mcp.server.transport_security import TransportSecuritySettings
from mcp.shared.message import SessionMessage

from robosandbox.apps.mcp.greeting import FirstLine
from robosandbox.apps.mcp.leaving import telling_who_left
from robosandbox.apps.mcp.lines import Lines, read_message
from robosandbox.apps.mcp.opening import Opening, OpenRobot
from robosandbox.apps.mcp.server import build_server
from robosandbox.apps.mcp.whole_requests import WholeRequests
from robosandbox.errors import InputError

HOST = "127.0.0.1"
PATH = "/mcp"


def serve(open_robot: OpenRobot, *, port: int | None, first: FirstLine | None = None) -> None:
    """Serve a robot until the client leaves or somebody interrupts.

    Args:
        open_robot: Opens the robot's world, on a thread of its own, while the server already answers.
        port: Of 127.0.0.1; None is stdin and stdout.
        first: What the client has sent over stdin already.
    """

    async def run() -> None:
        opening = Opening(open_robot)
        opening.begin()
        server = build_server(opening.ready)
        try:
            await (serve_stdio(server, first) if port is None else serve_http(server, port))
        finally:
            await opening.close()

    asyncio.run(run())


async def serve_stdio(server: Server[Any], first: FirstLine | None = None) -> None:
    """Serve one client until it closes stdin or goes away; what is under way is stopped then.

    Args:
        server: The server.
        first: What the client has sent already.
    """
    try:
        await _serve_stdio(server, first)
    except* (BrokenPipeError, anyio.BrokenResourceError, anyio.ClosedResourceError):
        # Nobody reads any more; what Python still holds for stdout at its end would find that out once again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), first.stdout if first else sys.stdout.fileno())


async def _serve_stdio(server: Server[Any], first: FirstLine | None) -> None:
    options = server.create_initialization_options()
    stdout = anyio.wrap_file(os.fdopen(first.stdout, "w", encoding="utf-8", closefd=False)) if first else None
    ended = anyio.Event()
    async with stdio_server(stdin=_nothing_until(ended), stdout=stdout) as (_, write):
        heard_send, heard = anyio.create_memory_object_stream[SessionMessage | Exception](0)
        said, said_receive = anyio.create_memory_object_stream[SessionMessage](0)

        async def hear() -> None:
            async with heard_send:
                if first is not None:
                    await take(first.text)
                async for line in Lines(sys.stdin.fileno()):
                    await take(line)

        async def take(line: str) -> None:
            message = read_message(line)
            if isinstance(message.message, types.JSONRPCError):
                await write.send(message)
            else:
                await heard_send.send(message)

        async def say() -> None:
            waiting = first is not None and first.answered is not None
            async with write, said_receive:
                async for message in said_receive:
                    if waiting and first is not None and getattr(message.message, "id", None) == first.answered:
                        # The client has this answer already.
                        waiting = False
                    else:
                        await write.send(message)

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(hear)
            tasks.start_soon(say)
            await server.run(heard, said, options)
        ended.set()


def _nothing_until(ended: anyio.Event) -> Any:
    """Return a stdin for the SDK without a line in it: a thread of its own that reads could not be interrupted."""

    async def lines() -> AsyncIterator[str]:
        await ended.wait()
        for line in tuple[str, ...]():
            yield line

    return lines()


async def serve_http(server: Server[Any], port: int) -> None:
    """Serve clients of this machine until interrupted or ended by SIGTERM; the address goes to stderr.

    Args:
        server: The server.
        port: 0 takes a free one.

    Raises:
        InputError: The port cannot be had.
    """
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
        # From here on a client that reads the address below can connect; it waits until the server is up.
        listener.listen()
    except (OSError, OverflowError) as error:
        listener.close()
        raise InputError(f"--http: port {port} cannot be had: {error}; give another, or 0 for a free one") from None
    with listener:
        port = listener.getsockname()[1]
        names = [f"{name}:{port}" for name in (HOST, "localhost")]
        # No web page can reach in: neither one of another machine, by whatever name it calls this one, nor one of another
        # port here, as notebooks and other people's servers show.
        own = TransportSecuritySettings(allowed_hosts=names, allowed_origins=[f"http://{name}" for name in names])
        app = server.streamable_http_app(streamable_http_path=PATH, host=HOST, transport_security=own)
        print(f"serving on http://{HOST}:{port}{PATH}", file=sys.stderr, flush=True)
        # uvicorn ends in order at SIGTERM, then raises it again for the handler before its own: by default a death by signal.
        signal.signal(signal.SIGTERM, lambda *_: None)
        config = uvicorn.Config(
            telling_who_left(app), http=WholeRequests, ws="none", log_level="warning", timeout_graceful_shutdown=3
        )
        await uvicorn.Server(config).serve(sockets=[listener])
