"""Triangle meshes: what they enclose, and the convex pieces that they can be cut into."""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from robosandbox.cache import cached, content_key
from robosandbox.spatial import Array
from robosandbox.values import frozen

# V-HACD's settings: pieces at most, voxels, and the share of its volume, percent, by which a piece may differ from its hull. With them
# the meshes of the arms in docs/arms.md keep their fingers' gaps open; chosen with `robot check` on those arms.
_MOST_PARTS = 12
# Number of voxels in which V-HACD looks at a mesh. Chosen: fewer than its default of 400,000, so that fingers are cut in
# seconds.
_VOXELS = 200_000
_VOLUME_ERROR_PERCENT = 0.5


@frozen
class TriangleMesh:
    """Triangles in metres, in the file's frame.

    Attributes:
        vertices: Shape (v, 3).
        faces: Vertex indices, shape (f, 3).
        rgba: The file's own mean colour; None when it says none.
    """

    vertices: Array
    faces: NDArray[np.int32]
    rgba: tuple[float, float, float, float] | None = None


@frozen
class _Parts:
    """Convex parts as the cache keeps them."""

    parts: tuple[TriangleMesh, ...]


def convex_parts(mesh: TriangleMesh, *, most: int = _MOST_PARTS) -> tuple[TriangleMesh, ...]:
    """Return convex pieces that together fill the mesh; computed once and kept in the user's cache.

    Approximate convex decomposition by voxels (V-HACD, K. Mamou), the same each time.
    """

    def key() -> str:
        figures = f"1 {most} {_VOXELS} {_VOLUME_ERROR_PERCENT}"
        return content_key([figures, mesh.vertices.round(7).tobytes(), np.ascontiguousarray(mesh.faces).tobytes()])

    return cached("convex-parts", _Parts, key, lambda: _Parts(_decompose(mesh, most))).parts


def _decompose(mesh: TriangleMesh, most: int) -> tuple[TriangleMesh, ...]:
    import vhacdx

    faces = np.column_stack([np.full(len(mesh.faces), 3), mesh.faces]).astype(np.uint32).ravel()
    pieces = vhacdx.compute_vhacd(
        mesh.vertices,
        faces,
        maxConvexHulls=most,
        resolution=_VOXELS,
        minimumVolumePercentErrorAllowed=_VOLUME_ERROR_PERCENT,
        asyncACD=False,
    )
    return tuple(
        TriangleMesh(np.asarray(vertices, dtype=np.float64), np.asarray(corners, dtype=np.int32).reshape(-1, 3))
        for vertices, corners in pieces
    )


def enclosed_volume(mesh: TriangleMesh) -> float | None:
    """Return the volume that a mesh encloses, cubic metres; None where its surface has holes."""
    _, merged = np.unique(mesh.vertices.round(9), axis=0, return_inverse=True)
    faces = merged.reshape(-1)[mesh.faces]
    edges = Counter((int(face[i]), int(face[i - 2])) for face in faces for i in range(3))
    if any(edges[(b, a)] != number for (a, b), number in edges.items()):
        return None
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return abs(float((a * np.cross(b, c)).sum())) / 6.0
