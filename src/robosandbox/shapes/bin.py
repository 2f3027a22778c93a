"""Bins: open boxes."""

from __future__ import annotations

from robosandbox.shapes.container import SquareContainer


class Bin(SquareContainer):
    """An open box; its pose is the middle of its bottom face."""

    kind = "bin"
    nouns = ("bin",)
    stays_put = True
    looks_like = frozenset({"bowl", "cylinder", "drawer", "box"})
