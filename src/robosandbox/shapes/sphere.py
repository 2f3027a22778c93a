"""Balls."""

from __future__ import annotations

from robosandbox.shapes.hull import SphereHull
from robosandbox.shapes.shape import Primitive, Size, Solid


class Sphere(Primitive):
    """A ball; its pose is its middle."""

    kind = "sphere"
    size_fields = ("radius",)
    nouns = ("ball", "sphere")
    flat_top = False
    rolls = True
    turns_on_the_spot = True
    looks_like = frozenset({"capsule", "mesh"})

    def hull(self, size: Size) -> SphereHull:
        """Return the ball itself."""
        return SphereHull((size[0],))

    def describe(self, solid: Solid) -> str:
        """Return its diameter, millimetres."""
        return f"diameter {2e3 * solid.size[0]:.0f}"
