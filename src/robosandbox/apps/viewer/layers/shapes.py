"""The shapes that contacts are computed with."""

from __future__ import annotations

from robosandbox.apps.viewer.layers.layer import Layer
from robosandbox.apps.viewer.scene import BodyScene
from robosandbox.apps.viewer.source import Blueprint


class CollisionShapes(Layer):
    """Draws what bodies collide with, over what they look like."""

    title = "Collision shapes"
    hint = "What contacts and planned paths are computed with"
    shown = False

    def adopt(self, blueprint: Blueprint, body_scene: BodyScene) -> None:
        """Draw over another world."""
        super().adopt(blueprint, body_scene)
        body_scene.show_collision(self.shown)

    def switch(self, shown: bool) -> None:
        """Show or hide them."""
        super().switch(shown)
        self.body_scene.show_collision(shown)
