"""The viewer: one world, one server, any number of browsers."""

from __future__ import annotations

import threading

import mujoco
import viser

from robosandbox.viewer import operator
from robosandbox.viewer.cell import Blueprint, Cell, Frame
from robosandbox.viewer.feed import Feed
from robosandbox.viewer.operator import News, Operator
from robosandbox.viewer.panels.prompt import PromptPanel
from robosandbox.viewer.server import HOST, open_server
from robosandbox.viewer.stage import Stage


class Viewer:
    """Serves a cell to browsers on this machine.

    Args:
        cell: The world.
        port: 0 takes any free one.

    Attributes:
        control: Does what people click.
        server: What browsers talk to.
        feed: Sends frames.

    Raises:
        InputError: The port is taken.
    """

    def __init__(self, cell: Cell, port: int) -> None:
        self.cell = cell
        self._lock = threading.Lock()
        self.server = open_server(port)
        self.control = Operator(cell)
        self._blueprint = cell.blueprint
        self._data = mujoco.MjData(self._blueprint.model)
        self._stage = Stage(self.server, self._blueprint.model, self._blueprint.names)
        self.feed = Feed(self._draw, lambda: bool(self.server.get_clients()))
        self._panels = [PromptPanel(self.server, self.control)]
        _aim(self.server, self._blueprint)
        self.control.listeners += [self._hear, *(panel.hear for panel in self._panels)]
        self.server.on_client_connect(lambda _: self.feed.wake())

    @property
    def url(self) -> str:
        """Where browsers find it."""
        return f"http://{HOST}:{self.server.get_port()}"

    def start(self) -> None:
        """Begin to serve."""
        self.feed.start()
        self.cell.start(self.feed.put)

    def stop(self) -> None:
        """Stop the arm and the server."""
        self.cell.close()
        self.feed.stop()
        self.server.stop()

    def _hear(self, news: News) -> None:
        if not isinstance(news, operator.Loaded | operator.Went):
            return
        found = self.cell.blueprint
        if found.looks_like(self._blueprint):
            return
        with self._lock, self.server.atomic():
            self._blueprint = found
            self._data = mujoco.MjData(found.model)
            self._stage.remove()
            self._stage = Stage(self.server, found.model, found.names)

    def _draw(self, frame: Frame) -> None:
        with self._lock:
            self._show(frame)

    def _show(self, frame: Frame) -> None:
        model = self._blueprint.model
        if frame.model is not model:
            # Of the world before; a frame of this one is on its way.
            return
        if frame.state is not None:
            mujoco.mj_setState(model, self._data, frame.state, mujoco.mjtState.mjSTATE_INTEGRATION)
        else:
            self._data.qpos[:] = frame.qpos
        mujoco.mj_kinematics(model, self._data)
        with self.server.atomic():
            self._stage.show(self._data)


def _aim(server: viser.ViserServer, blueprint: Blueprint) -> None:
    """Have browsers begin in front of the robot, to its right, looking at the middle of the table."""
    server.initial_camera.position = (1.05, -0.95, 0.8)
    server.initial_camera.look_at = (-0.05, 0.0, 0.2)
    server.initial_camera.fov = 0.9
