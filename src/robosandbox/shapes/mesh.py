"""Objects from OBJ and STL files."""

from __future__ import annotations

from robosandbox.shapes.body import Body
from robosandbox.shapes.hull import BoxHull
from robosandbox.shapes.mesh_file import mesh_pieces
from robosandbox.shapes.shape import Shape, Size, Written


class Mesh(Shape):
    """Mesh from a file; its pose is the middle of its box, and as seen its size are the half-extents of that box."""

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
        """Return its one body: the convex hull of its file, or the convex pieces that the file is cut into.

        Raises:
            InputError: The file is none, or holds no mesh of a useful size.
        """
        decomposed = item.collision != "hull"
        return (Body(pieces=mesh_pieces(item.mesh, item.scale, item.mass, decomposed=decomposed, of=item.id)),)
