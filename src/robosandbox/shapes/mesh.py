"""Objects from OBJ and STL files."""

from __future__ import annotations

from robosandbox.shapes.body import Body
from robosandbox.shapes.hull import BoxHull
from robosandbox.shapes.shape import Shape, Size, Written


class Mesh(Shape):
    """What a file describes; its pose is the middle of its box, and as seen its size are the half-extents of that box."""

    kind = "mesh"
    size_fields = ()
    nouns = ("object",)
    options = frozenset({"mesh"})
    looks_like = frozenset({"box", "cylinder", "capsule", "sphere"})

    def hull(self, size: Size) -> BoxHull:
        """Return the box around it."""
        x, y, z = size
        return BoxHull((x, y, z))

    def bodies(self, item: Written) -> tuple[Body, ...]:
        """Return its one body, whose pieces are in its file."""
        del item
        return (Body(pieces=()),)
