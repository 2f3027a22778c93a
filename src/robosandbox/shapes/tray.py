"""Trays: shallow open boxes, carried by their rim."""

from __future__ import annotations

import numpy as np

from robosandbox.shapes.container import SquareContainer
from robosandbox.shapes.shape import Size, Solid
from robosandbox.spatial import Array

# Ratio of height to the smaller inner half-extent up to which an open box counts as a tray. Chosen: bins have 0.5 and more.
_SHALLOW = 0.4


class Tray(SquareContainer):
    """A shallow open box; its pose is the middle of its bottom face. What is too wide for it stands on its rim."""

    kind = "tray"
    nouns = ("tray",)
    pours = False
    flat_top = True
    looks_like = frozenset({"bin", "box", "cylinder"})

    def is_likely(self, size: Size) -> bool:
        """Tell whether it is shallow."""
        return size[2] <= _SHALLOW * min(size[:2])

    def rest_height(self, target: Solid, width: float, place: Array | None = None) -> float:
        """Return the height of its floor in the world for what fits into it, else of its rim."""
        del place
        room = self.room(target.size)
        return target.pose.xyz[2] + (room.floor if width < float(np.min(room.half)) else room.rim)
