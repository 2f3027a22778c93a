"""A world that is opened on a thread of its own while the server already answers."""

from __future__ import annotations

import asyncio
import logging
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack

from robosandbox.apps.mcp import tools
from robosandbox.apps.mcp.robot import McpRobot
from robosandbox.errors import InternalError, RoboSandboxError

_log = logging.getLogger(__name__)
OpenRobot = Callable[[], AbstractContextManager[McpRobot]]


class Opening:
    """A robot that is there when its world has been opened.

    Args:
        open_robot: Opens the world and returns the robot in it; whatever it does takes place on another thread.
    """

    def __init__(self, open_robot: OpenRobot) -> None:
        self._open_robot = open_robot
        self._open = ExitStack()
        self._work: asyncio.Future[McpRobot] | None = None

    def begin(self) -> asyncio.Future[McpRobot]:
        """Begin to open the world; call it in a running loop."""
        self._work = asyncio.ensure_future(asyncio.to_thread(self._enter))
        return self._work

    async def ready(self) -> McpRobot:
        """Return the robot as soon as it is there.

        Raises:
            RoboSandboxError: The world could not be opened; each call raises it anew.
        """
        if self._work is None:
            self._work = self.begin()
        return await asyncio.shield(self._work)

    async def close(self) -> None:
        """Wait for what is being opened, and close it."""
        if self._work is not None:
            await asyncio.wait([self._work])
            if not self._work.cancelled() and self._work.exception() is None:
                (await self._work).close()
        self._open.close()

    def _enter(self) -> McpRobot:
        try:
            robot = self._open.enter_context(self._open_robot())
            # A skill that has the name of a tool of the server's own is told now, not when a client lists the tools.
            tools.catalogue(robot.calls)
        except RoboSandboxError as error:
            print(f"robo-sandbox: {error}", file=sys.stderr, flush=True)
            raise
        except Exception as fault:
            raise InternalError.log("opening the world", fault, _log) from fault
        return robot
