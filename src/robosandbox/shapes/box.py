"""Boxes: cubes, blocks, planks."""

from __future__ import annotations

from robosandbox.shapes.hull import BoxHull
from robosandbox.shapes.shape import Primitive, Size

_CUBIC = 1.15  # Ratio of the longest edge to the shortest up to which a box is a cube. Chosen.


class Box(Primitive):
    """A box; its pose is its middle."""

    kind = "box"
    size_fields = ("half_x", "half_y", "half_z")
    nouns = ("block", "cube", "box")
    options = frozenset({"tag"})
    looks_like = frozenset({"mesh", "drawer", "bin"})

    def hull(self, size: Size) -> BoxHull:
        """Return the box itself."""
        x, y, z = size
        return BoxHull((x, y, z))

    def tag_face(self, size: Size) -> tuple[float, float]:
        """Return the edge of the largest square on its upper face, and that face's height."""
        return 2.0 * min(size[0], size[1]), size[2]

    def noun(self, size: Size) -> str:
        """Return whether it is a cube."""
        return "cube" if max(size) <= _CUBIC * min(size) else "block"
