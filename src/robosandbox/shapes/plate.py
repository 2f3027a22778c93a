"""Plates: shallow round containers that stack."""

from __future__ import annotations

from robosandbox.shapes.container import RoundContainer
from robosandbox.shapes.shape import Size, Solid
from robosandbox.spatial import Array

# Ratio of height to inner radius up to which a round container counts as a plate. Chosen: dinner plates have 0.15 to 0.25,
# bowls 0.6 up.
_SHALLOW = 0.4


class Plate(RoundContainer):
    """A shallow round dish; its pose is the middle of its bottom face. What is too wide for it stands on its rim."""

    kind = "plate"
    nouns = ("plate", "saucer")
    pours = False
    flat_top = True
    looks_like = frozenset({"bowl", "cylinder"})

    def is_likely(self, size: Size) -> bool:
        """Tell whether it is shallow."""
        return size[1] <= _SHALLOW * size[0]

    def rest_height(self, target: Solid, width: float, place: Array | None = None) -> float:
        """Return the height of its floor in the world for what fits into it, else of its rim."""
        del place
        room = self.room(target.size)
        return target.pose.xyz[2] + (room.floor if width < room.half[0] else room.rim)
