"""Serving: over stdin and stdout, or over streamable HTTP on the loopback interface and nowhere else."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import sys
from typing import Any

import anyio
import mcp_types as types
import uvicorn
from mcp.server import Server
from mcp.server.stdio import stdio_server
from mcp.shared.message import SessionMessage

from robosandbox.apps.mcp.greeting import FirstLine
from robosandbox.apps.mcp.opening import Opening, OpenRobot
from robosandbox.apps.mcp.server import build_server
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
    async with stdio_server(stdout=stdout) as (read, write):
        if first is None:
            await server.run(read, write, options)
            return
        heard_send, heard = anyio.create_memory_object_stream[SessionMessage | Exception](0)
        said, said_receive = anyio.create_memory_object_stream[SessionMessage](0)

        async def hear() -> None:
            async with heard_send, read:
                await heard_send.send(_message(first.text))
                async for message in read:
                    await heard_send.send(message)

        async def say() -> None:
            waiting = first.answered is not None
            async with write, said_receive:
                async for message in said_receive:
                    if waiting and getattr(message.message, "id", None) == first.answered:
                        # The client has this answer already.
                        waiting = False
                    else:
                        await write.send(message)

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(hear)
            tasks.start_soon(say)
            await server.run(heard, said, options)


def _message(line: str) -> SessionMessage | Exception:
    try:
        return SessionMessage(types.jsonrpc_message_adapter.validate_json(line, by_name=False))
    except ValueError as error:
        return error


async def serve_http(server: Server[Any], port: int) -> None:
    """Serve clients of this machine until interrupted or ended by SIGTERM; the address goes to stderr.

    Args:
        server: The server.
        port: 0 takes a free one.

    Raises:
        InputError: The port cannot be had.
    """
    # The SDK refuses requests whose Host or Origin is another machine's: no web page can reach in.
    app = server.streamable_http_app(streamable_http_path=PATH, host=HOST)
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
        print(f"serving on http://{HOST}:{listener.getsockname()[1]}{PATH}", file=sys.stderr, flush=True)
        # uvicorn ends in order at SIGTERM, then raises it again for the handler before its own: by default a death by signal.
        signal.signal(signal.SIGTERM, lambda *_: None)
        config = uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=3)
        await uvicorn.Server(config).serve(sockets=[listener])
