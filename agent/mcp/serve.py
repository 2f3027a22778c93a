"""Serving: over stdin and stdout, or over streamable HTTP on the loopback interface and nowhere else."""

from __future__ import annotations

import asyncio
import signal
import socket
import sys
from collections.abc import Callable
from typing import Any

import uvicorn
from mcp.server import Server
from mcp.server.stdio import stdio_server

from robosandbox.agent.mcp.robot import Cell, Robot, TickHooks
from robosandbox.agent.mcp.server import build_server
from robosandbox.errors import InputError

HOST = "127.0.0.1"
PATH = "/mcp"


def serve(
    cell: Cell,
    state: Callable[[], dict[str, Any]],
    *,
    tick_hooks: TickHooks | None,
    timeout: float,
    port: int | None,
) -> None:
    """Serve a session until the client leaves or somebody interrupts.

    Args:
        cell: The session.
        state: Returns joints, TCP and gripper as JSON data.
        tick_hooks: Those of a world in this process; None for one in another.
        timeout: Simulated seconds that a call may take.
        port: Of 127.0.0.1; None is stdin and stdout.
    """
    robot = Robot(cell, state, tick_hooks=tick_hooks, timeout=timeout)
    try:
        server = build_server(robot)
        asyncio.run(serve_stdio(server) if port is None else serve_http(server, port))
    finally:
        robot.close()


async def serve_stdio(server: Server[Any]) -> None:
    """Serve one client until it closes stdin."""
    async with stdio_server() as (read, write):
        await server.run(read, write, server.create_initialization_options())


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
