"""Bowls: round open containers that are wider than high."""

from __future__ import annotations

from robosandbox.shapes.container import RoundContainer


class Bowl(RoundContainer):
    """A round open container; its pose is the middle of its bottom face."""

    kind = "bowl"
    nouns = ("bowl",)
    stays_put = True
    looks_like = frozenset({"cylinder", "bin", "cup"})
