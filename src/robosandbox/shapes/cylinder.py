"""Cylinders: cans, discs, rods."""

from __future__ import annotations

import math

from robosandbox.shapes.hull import CylinderHull
from robosandbox.shapes.shape import Primitive, Size, Solid


class Cylinder(Primitive):
    """A cylinder along local z; its pose is its middle."""

    kind = "cylinder"
    size_fields = ("radius", "half_height")
    nouns = ("cylinder", "can")
    options = frozenset({"tag"})
    rolls = True
    looks_like = frozenset({"capsule", "mesh", "bowl", "bin", "cup"})

    def hull(self, size: Size) -> CylinderHull:
        """Return the cylinder itself."""
        return CylinderHull((size[0], size[1]))

    def tag_face(self, size: Size) -> tuple[float, float]:
        """Return the edge of the largest square in its upper disc, and that disc's height."""
        return math.sqrt(2.0) * size[0], size[1]

    def describe(self, solid: Solid) -> str:
        """Return diameter and height, millimetres."""
        return f"diameter {2e3 * solid.size[0]:.0f}, height {2e3 * solid.size[1]:.0f}"
