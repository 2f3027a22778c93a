"""OBJ files of several groups: MuJoCo reads the faces of the first one alone, and many files are made of convex ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from robosandbox.shapes.triangles import TriangleMesh
from robosandbox.spatial import Array

# Number of groups up to which they are taken as they are. Chosen: pieces of a thing cost physics, and 32 are what
# V-HACD makes of a mesh by itself.
_MOST = 32
# Metres of its longest edge by which a group's corner may lie inside its hull, as a share of that, and the least thickness of a
# group that is solid. Chosen as the accuracy that such files are written with.
_CONVEX, _SOLID = 0.005, 0.001


def obj_groups(path: Path) -> tuple[TriangleMesh, ...]:
    """Return the groups of an OBJ file that have faces, in its units; none where it is no OBJ, or has but one."""
    if path.suffix.lower() != ".obj":
        return ()
    vertices: list[list[float]] = []
    groups: list[list[tuple[int, int, int]]] = [[]]
    try:
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            word, *values = line.split() or [""]
            if word == "v":
                vertices.append([float(value) for value in values[:3]])
            elif word in ("o", "g"):
                groups.append([])
            elif word == "f":
                corners = [_index(value, len(vertices)) for value in values]
                groups[-1] += [(corners[0], corners[k], corners[k + 1]) for k in range(1, len(corners) - 1)]
    except ValueError:
        # MuJoCo's own reader says what is wrong with it.
        return ()
    found = [np.array(faces, dtype=np.int32) for faces in groups if faces]
    if len(found) < 2 or max(faces.max() for faces in found) >= len(vertices):
        return ()
    points = np.array(vertices, dtype=np.float64)
    return tuple(_compact(points, faces) for faces in found)


def joined(groups: tuple[TriangleMesh, ...]) -> TriangleMesh:
    """Return groups as one mesh."""
    begins = np.cumsum([0, *(len(group.vertices) for group in groups[:-1])])
    faces = np.concatenate([group.faces + begin for group, begin in zip(groups, begins, strict=True)])
    return TriangleMesh(np.concatenate([group.vertices for group in groups]), faces.astype(np.int32))


def convex_groups(groups: tuple[TriangleMesh, ...]) -> tuple[TriangleMesh, ...]:
    """Return the groups that are solid if each of them is convex, which makes them the mesh's pieces; else none."""
    solid = [group for group in groups if _spread(group.vertices) > _SOLID]
    if not 2 <= len(solid) <= _MOST or not all(_is_convex(group.vertices) for group in solid):
        return ()
    return tuple(solid)


def _index(corner: str, count: int) -> int:
    """Return the vertex that a face's corner names: counted from 1, or backwards from the last one."""
    number = int(corner.partition("/")[0])
    return number - 1 if number > 0 else count + number


def _compact(points: Array, faces: np.typing.NDArray[np.int32]) -> TriangleMesh:
    """Return the mesh of the points that faces name, no others."""
    used, where = np.unique(faces, return_inverse=True)
    return TriangleMesh(points[used], where.reshape(-1, 3).astype(np.int32))


def _spread(points: Array) -> float:
    """Return the least of a cloud's principal spreads as a share of the largest."""
    if len(points) < 4:
        return 0.0
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return float(spread[-1] / spread[0])


def _is_convex(points: Array) -> bool:
    """Tell whether all points lie on their convex hull."""
    from scipy.spatial import ConvexHull

    planes = ConvexHull(points).equations
    depth = -(points @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    return bool(depth.max() < _CONVEX * np.ptp(points, axis=0).max())
