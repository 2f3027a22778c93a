"""A viser server for this machine alone: loopback, pages of this machine's own, no sharing."""

from __future__ import annotations

import asyncio
import contextlib
import io
import socket
from collections.abc import Awaitable, Callable, Iterator
from http import HTTPStatus
from typing import Any

import numpy as np
import viser
import viser.transforms
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from robosandbox.apps.viewer.access import refusal
from robosandbox.apps.viewer.orders import PATH, TakeOrder
from robosandbox.apps.viewer.theme import BRAND
from robosandbox.errors import InputError

HOST = "127.0.0.1"
_Handler = Callable[[ServerConnection], Awaitable[None]]
_Process = Callable[[ServerConnection, Request], Response | None]
# Direction of the light, metres at a third of its distance. Chosen: from behind the eye.
_SUN = np.array([0.45, -0.55, 0.9])


class LocalServer(viser.ViserServer):
    """A viser server that cannot be shared beyond this machine."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Return None: a robot is not steered by way of a relay."""
        del verbose
        return None

    def stop(self) -> None:
        """Stop, without viser's word about it on stdout."""
        with contextlib.redirect_stdout(io.StringIO()):
            super().stop()


def open_server(port: int, take_order: TakeOrder) -> LocalServer:
    """Return a server on 127.0.0.1.

    Args:
        port: 0 takes any free one.
        take_order: Called with each order from a page, in a thread of its own; returns what is wrong with it, or nothing.

    Raises:
        InputError: The port is taken.
    """
    _check_free(port)
    # Viser announces itself on stdout; the command says where the viewer is.
    with _own_pages_only(take_order), contextlib.redirect_stdout(io.StringIO()):
        server = LocalServer(host=HOST, port=port, label="RoboSandbox", verbose=False)
    server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=BRAND)
    server.gui.main_panel.dock_right()
    server.gui.main_panel.set_width(400)
    _light(server)
    return server


def _light(server: viser.ViserServer) -> None:
    """Light the scene as a workshop: soft from all sides, one sun with a shadow."""
    scene = server.scene
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map("studio", background=False, environment_intensity=0.3)
    scene.set_background_image(_backdrop())
    scene.add_light_hemisphere("/light/sky", sky_color=(255, 255, 255), ground_color=(150, 145, 140), intensity=0.55)
    scene.add_light_directional(
        "/light/sun", color=(255, 250, 242), intensity=1.3, cast_shadow=True, position=tuple(3.0 * _SUN)
    )


def _backdrop() -> Any:
    """Return a soft vertical gradient, (height, width, 3) uint8."""
    top, bottom = np.array([214, 224, 234.0]), np.array([246, 247, 248.0])
    share = np.linspace(0.0, 1.0, 64)[:, None, None]
    return np.broadcast_to((1.0 - share) * top + share * bottom, (64, 4, 3)).astype(np.uint8)


def _check_free(port: int) -> None:
    """Refuse a taken port; viser would silently take the next one."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError as error:
            raise InputError(f"--port: {port} cannot be had on {HOST}: {error.strerror}; 0 takes a free one") from None


@contextlib.contextmanager
def _own_pages_only(take_order: TakeOrder) -> Iterator[None]:
    """Have servers that start meanwhile answer their own pages only, and take orders (viser itself answers everybody)."""
    serve = websockets.asyncio.server.serve

    def guarded(handler: _Handler, *args: Any, process_request: _Process, **kwargs: Any) -> Any:
        async def handle(connection: ServerConnection) -> None:
            if connection.request is not None and connection.request.path == PATH:
                await connection.send(await asyncio.to_thread(take_order, await connection.recv()))
            else:
                await handler(connection)

        def admit(connection: ServerConnection, request: Request) -> Response | None:
            why = refusal(request.headers)
            if why is not None:
                return connection.respond(HTTPStatus.FORBIDDEN, why)
            response = process_request(connection, request)
            if response is not None:
                # A page of another site may not lay the viewer under its own buttons.
                response.headers["Content-Security-Policy"] = "frame-ancestors 'none'"
            return response

        return serve(handle, *args, process_request=admit, **kwargs)

    websockets.asyncio.server.serve = guarded  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]
