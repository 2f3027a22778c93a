"""Capsules: cylinders with round ends."""

from __future__ import annotations

from robosandbox.shapes.hull import CapsuleHull
from robosandbox.shapes.shape import Primitive, Size, Solid


class Capsule(Primitive):
    """A cylinder along local z with half a ball on either end; its pose is its middle."""

    kind = "capsule"
    size_fields = ("radius", "half_height")
    nouns = ("capsule",)
    rolls = True
    looks_like = frozenset({"cylinder", "sphere", "mesh"})

    def hull(self, size: Size) -> CapsuleHull:
        """Return the capsule itself."""
        return CapsuleHull((size[0], size[1]))

    def describe(self, solid: Solid) -> str:
        """Return diameter and length, millimetres."""
        radius, half = solid.size
        return f"diameter {2e3 * radius:.0f}, length {2e3 * (radius + half):.0f}"
