"""OBJ and STL files as pieces that collide and weigh."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from robosandbox.errors import InputError
from robosandbox.ranges import LEAST_LENGTH, MOST_LENGTH
from robosandbox.shapes.body import Piece, share_mass
from robosandbox.shapes.obj_groups import convex_groups, joined, obj_groups
from robosandbox.shapes.polyhedron import PolyhedronHull
from robosandbox.shapes.triangles import TriangleMesh, convex_parts, enclosed_volume
from robosandbox.spatial import Array, Vec3


def mesh_pieces(path: Path | None, scale: float, mass: float, *, decomposed: bool, of: str) -> tuple[Piece, ...]:
    """Return a mesh file's convex pieces, the middle of its box at the origin.

    Args:
        path: The file.
        scale: Metres per unit of the file.
        mass: Of all pieces together, kg.
        decomposed: Whether it is cut; its convex hull is the one piece where not.
        of: Id of the object, for messages.

    Raises:
        InputError: There is no such file, it holds no mesh, or the mesh is too small or too large.
    """
    low, high = mesh_bounds(path, scale, of=of)
    found = _forms(*_named(path, of), decomposed)
    return share_mass([_piece(points * scale, (low + high) / 2.0) for points in found], mass)


def mesh_bounds(path: Path | None, scale: float, *, of: str) -> tuple[Array, Array]:
    """Return the corners (3,), (3,) of a mesh's box in its file's frame, metres.

    Raises:
        InputError: As `mesh_pieces` does.
    """
    mesh = _read(*_named(path, of), of)
    low, high = scale * mesh.vertices.min(axis=0), scale * mesh.vertices.max(axis=0)
    longest = float((high - low).max())
    if not LEAST_LENGTH <= longest <= MOST_LENGTH:
        raise InputError(
            f"objects[{of}].scale: {scale:g} makes it {longest:g} m long, outside {LEAST_LENGTH:g} to "
            f"{MOST_LENGTH:g} m; give metres per unit of the file"
        )
    return low, high


def mesh_volume(path: Path | None, scale: float, *, of: str) -> float:
    """Return what a mesh encloses, or its convex hull where its surface has holes, cubic metres.

    Raises:
        InputError: As `mesh_pieces` does.
    """
    mesh_bounds(path, scale, of=of)
    mesh = _read(*_named(path, of), of)
    inside = enclosed_volume(mesh)
    return scale**3 * (PolyhedronHull(_tuples(_corners(mesh.vertices))).volume if inside is None else inside)


def mesh_triangles(path: Path) -> TriangleMesh:
    """Return a file's triangles in its own units.

    Raises:
        InputError: There is no such file, or it holds no mesh.
    """
    return _read(*_named(path, path.name), path.name)


def grouped_mesh(path: Path) -> TriangleMesh | None:
    """Return the triangles of a file of several groups, in its units; None where MuJoCo reads all of it."""
    groups = obj_groups(path)
    return joined(groups) if groups else None


def _named(path: Path | None, of: str) -> tuple[Path, int]:
    """Return the file's full path and its time of change, by which what was read is kept."""
    if path is None or not path.is_file():
        raise InputError(f"objects[{of}].mesh: {str(path)!r} is not a file")
    full = path.resolve()
    return full, full.stat().st_mtime_ns


@lru_cache(maxsize=64)
def _read(path: Path, stamp: int, of: str) -> TriangleMesh:
    """Return a file's triangles in its own units: of several groups all, of one as MuJoCo reads it."""
    import mujoco

    from robosandbox.shapes.mujoco_log import route_warnings

    del stamp  # part of the cache's key
    if groups := obj_groups(path):
        return joined(groups)
    route_warnings()
    spec = mujoco.MjSpec()
    spec.add_mesh(name="mesh", file=str(path))
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh")
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"objects[{of}].mesh: {str(path)!r}: {' '.join(str(error).split())}") from None
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[0])
    vertices = model.mesh_vert[: model.mesh_vertnum[0]].astype(float) @ rotation.reshape(3, 3).T + model.geom_pos[0]
    return TriangleMesh(vertices, model.mesh_face[: model.mesh_facenum[0]].astype(np.int32))


@lru_cache(maxsize=64)
def _forms(path: Path, stamp: int, decomposed: bool) -> tuple[Array, ...]:
    """Return the corners of each convex piece in the file's units, so that one decomposition serves all scales."""
    mesh = _read(path, stamp, path.name)
    parts = (convex_groups(obj_groups(path)) or convex_parts(mesh)) if decomposed else (mesh,)
    return tuple(_corners(part.vertices) for part in parts)


def _corners(points: Array) -> Array:
    from scipy.spatial import ConvexHull

    corners: Array = points[ConvexHull(points).vertices]
    return corners


def _piece(points: Array, origin: Array) -> Piece:
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    x, y, z = map(float, middle - origin)
    return Piece(hull=PolyhedronHull(_tuples(points - middle)), centre=(x, y, z))


def _tuples(points: Array) -> tuple[Vec3, ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in points)
