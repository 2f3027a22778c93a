"""Base of all layers: a title to switch it by, the world that it is drawn over, a place in the scene."""

from __future__ import annotations

import mujoco
import viser

from robosandbox.apps.viewer.news import News
from robosandbox.apps.viewer.scene import BodyScene
from robosandbox.apps.viewer.source import Blueprint, Frame


class Layer:
    """Something drawn over the world.

    A subclass sets the class attributes and overrides what it needs of `hear` and `draw`; what it adds to the scene it hands
    to `keep`, so that it is taken away when the layer is hidden or the world replaced.

    Args:
        server: Where it is drawn.

    Attributes:
        title: What the switch says.
        hint: What it says when pointed at.
        shown: Whether it is drawn now.
        needs_forces: Whether `draw` reads contacts and forces.
    """

    title = ""
    hint = ""
    shown: bool = True
    needs_forces = False

    def __init__(self, server: viser.ViserServer) -> None:
        self.server = server
        self.scene: viser.SceneApi = server.scene
        self._kept: dict[str, viser.SceneNodeHandle] = {}

    def adopt(self, blueprint: Blueprint, body_scene: BodyScene) -> None:
        """Draw over another world from now on."""
        self.clear()
        self.blueprint = blueprint
        self.body_scene = body_scene

    def switch(self, shown: bool) -> None:
        """Show or hide it."""
        self.shown = shown
        if not shown:
            self.clear()

    def hear(self, news: News) -> None:
        """Take news."""

    def draw(self, frame: Frame, data: mujoco.MjData) -> None:
        """Take a frame; `data` has the poses of all bodies, and contacts where the frame has a whole state."""

    def clear(self) -> None:
        """Take away what was drawn."""
        for name in tuple(self._kept):
            self.drop(name)

    def node(self, name: str) -> str:
        """Return the scene's name for something of this layer."""
        return f"/layers/{type(self).__name__}/{name}"

    def keep(self, name: str, handle: viser.SceneNodeHandle) -> None:
        """Take charge of something that was added under `node(name)`, in place of what was there."""
        self._kept[name] = handle

    def drop(self, name: str) -> None:
        """Take away what was added under a name, if anything was."""
        handle = self._kept.pop(name, None)
        if handle is not None:
            handle.remove()
