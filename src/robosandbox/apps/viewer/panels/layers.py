"""Switches for what is drawn over the world."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import viser

from robosandbox.apps.viewer.layers.layer import Layer


class LayersPanel:
    """One switch a layer.

    Args:
        server: Where.
        layers: What is switched.
        switch: Shows or hides one.
    """

    def __init__(
        self, server: viser.ViserServer, layers: Sequence[Layer], switch: Callable[[Layer, bool], None]
    ) -> None:
        self._switch = switch
        for layer in layers:
            self._add(server, layer)

    def _add(self, server: viser.ViserServer, layer: Layer) -> None:
        box = server.gui.add_checkbox(layer.title, layer.shown, hint=layer.hint)
        box.on_update(lambda _: self._switch(layer, box.value))
