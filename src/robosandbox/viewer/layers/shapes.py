"""The shapes that contacts are computed with."""

from __future__ import annotations

from robosandbox.viewer.cell import Blueprint
from robosandbox.viewer.layers.layer import Layer
from robosandbox.viewer.stage import Stage


class CollisionShapes(Layer):
    """Draws what bodies collide with, over what they look like."""

    title = "Collision shapes"
    hint = "What contacts and planned paths are computed with"
    shown = False

    def adopt(self, blueprint: Blueprint, stage: Stage) -> None:
        """Draw over another world."""
        super().adopt(blueprint, stage)
        stage.show_collision(self.shown)

    def switch(self, shown: bool) -> None:
        """Show or hide them."""
        super().switch(shown)
        self.stage.show_collision(shown)
