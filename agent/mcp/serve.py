"""Serving: over stdin and stdout, or over streamable HTTP on the loopback interface and nowhere else."""

from __future__ import annotations

import socket
import sys
from typing import Any

import uvicorn
from mcp.server import Server
from mcp.server.stdio import stdio_server

from robosandbox.errors import InputError

HOST = "127.0.0.1"
PATH = "/mcp"


async def serve_stdio(server: Server[Any]) -> None:
    """Serve one client until it closes stdin."""
    async with stdio_server() as (read, write):
        await server.run(read, write, server.create_initialization_options())


async def serve_http(server: Server[Any], port: int) -> None:
    """Serve clients of this machine until interrupted; the address goes to stderr.

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
        config = uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=3)
        await uvicorn.Server(config).serve(sockets=[listener])
