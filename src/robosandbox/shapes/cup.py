"""Cups: round open containers that are high for their width."""

from __future__ import annotations

from robosandbox.shapes.container import RoundContainer
from robosandbox.shapes.shape import Size

TALL = 1.4  # Ratio of height to inner radius from which a round container counts as a cup. Chosen.


class Cup(RoundContainer):
    """A tall round open container; its pose is the middle of its bottom face."""

    kind = "cup"
    nouns = ("cup", "mug")
    looks_like = frozenset({"bowl", "cylinder"})

    def is_likely(self, size: Size) -> bool:
        """Tell whether it is high for its width."""
        return size[1] > TALL * size[0]
