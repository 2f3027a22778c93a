"""L-shaped blocks: two boxes at a right angle."""

from __future__ import annotations

import numpy as np

from robosandbox.shapes.body import Body, Piece, share_mass
from robosandbox.shapes.hull import BoxHull
from robosandbox.shapes.shape import Shape, Size, Solid, Written
from robosandbox.spatial import Array, Pose, Vec3


class BlockL(Shape):
    """An L that lies flat: an arm along local x and one along local y, which meet at the corner of least x and y.

    Its pose is the middle of the box around it.
    """

    kind = "block_l"
    size_fields = ("half_x", "half_y", "half_z", "arm_width")
    nouns = ("l block", "corner block")
    looks_like = frozenset({"box", "mesh"})

    def check(self, size: Size) -> None:
        """Check that the arms leave a corner free.

        Raises:
            ValueError: They fill the box around the L.
        """
        half_x, half_y, _, width = size
        if width >= 2.0 * min(half_x, half_y):
            raise ValueError(
                f"size: arm_width {width:g} leaves nothing of an L in a box of {2.0 * half_x:g} x {2.0 * half_y:g} m; "
                f"less than {2.0 * min(half_x, half_y):g}"
            )

    def hull(self, size: Size) -> BoxHull:
        """Return the box around it."""
        return BoxHull((size[0], size[1], size[2]))

    def bodies(self, item: Written) -> tuple[Body, ...]:
        """Return its one body of two boxes."""
        pieces = [Piece(hull=hull, centre=centre) for hull, centre in _arms(item.size)]
        return (Body(pieces=share_mass(pieces, item.mass)),)

    def support(self, solid: Solid, directions: Array) -> Array:
        """Return how far the farther arm reaches along unit vectors (n, 3) from the world's origin, metres, shape (n,)."""
        reach = [
            directions @ pose.position + hull.support(directions @ pose.rotation)
            for hull, pose in self.convex_parts(solid)
        ]
        return np.asarray(np.max(reach, axis=0), dtype=np.float64)

    def convex_parts(self, solid: Solid) -> list[tuple[BoxHull, Pose]]:
        """Return both arms."""
        return [(hull, solid.pose @ Pose(xyz=centre)) for hull, centre in _arms(solid.size)]


def _arms(size: Size) -> list[tuple[BoxHull, Vec3]]:
    """Return the arm along x over the whole length, and the rest of the one along y, with their middles, metres."""
    half_x, half_y, half_z, width = size
    return [
        (BoxHull((half_x, width / 2.0, half_z)), (0.0, width / 2.0 - half_y, 0.0)),
        (BoxHull((width / 2.0, half_y - width / 2.0, half_z)), (width / 2.0 - half_x, width / 2.0, 0.0)),
    ]
