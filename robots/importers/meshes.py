"""Triangle meshes from files: STL read here, OBJ, DAE and the rest through trimesh, imported when first needed."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.shapes.triangles import TriangleMesh
from robosandbox.types import Array

MESH_SUFFIXES = (".stl", ".obj", ".dae", ".ply", ".off", ".glb", ".gltf")
_MAX_FACES = 500_000  # Number of triangles of a mesh. Chosen so that a model compiles in seconds.
_SHELL = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL


def read_mesh(path: Path, element: str) -> TriangleMesh:
    """Read a mesh file.

    Args:
        path: STL, OBJ, DAE or another format that trimesh reads.
        element: What names it, for messages.

    Raises:
        InputError: It is no mesh, or has no triangles.
    """
    return _read(path, path.stat().st_mtime_ns, element)


@lru_cache(maxsize=256)
def _read(path: Path, stamp: int, element: str) -> TriangleMesh:
    del stamp  # part of the cache key
    suffix = path.suffix.lower()
    if suffix not in MESH_SUFFIXES:
        raise InputError(f"{element}: {path.name} is no mesh that can be read; use {', '.join(MESH_SUFFIXES)}")
    try:
        mesh = _read_binary_stl(path) if suffix == ".stl" else None
        mesh = mesh or _read_with_trimesh(path)
    except InputError:
        raise
    except Exception as error:  # a broken mesh file raises anything in its reader
        said = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(f"{element}: {path.name} cannot be read as a mesh: {said}") from None
    if len(mesh.faces) == 0 or not np.isfinite(mesh.vertices).all() or mesh.faces.max() >= len(mesh.vertices):
        raise InputError(f"{element}: {path.name} has no usable triangles")
    if len(mesh.faces) > _MAX_FACES:
        raise InputError(f"{element}: {path.name} has {len(mesh.faces):,} triangles; simplify it to {_MAX_FACES:,}")
    return mesh


def _read_binary_stl(path: Path) -> TriangleMesh | None:
    """Return the mesh of a binary STL; None for one in text."""
    content = path.read_bytes()
    if len(content) < 84:
        raise InputError(f"{path.name}: is too short for an STL")
    count = int.from_bytes(content[80:84], "little")
    if len(content) < 84 + 50 * count or (content[:5] == b"solid" and len(content) != 84 + 50 * count):
        return None
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    triangles = np.frombuffer(content, record, count, 84)["corners"].astype(np.float64)
    vertices, inverse = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return TriangleMesh(vertices, inverse.reshape(-1, 3).astype(np.int32))


def _read_with_trimesh(path: Path) -> TriangleMesh:
    import trimesh

    loaded: Any = trimesh.load(path, force="mesh", process=False)
    vertices = np.asarray(loaded.vertices, dtype=np.float64)
    # trimesh leaves a COLLADA file's unit to the reader: "0.01 * meters".
    unit = str(loaded.units or "").partition(" * meters")
    if unit[1]:
        vertices = vertices * float(unit[0])
    rgba = None
    if path.suffix.lower() != ".stl":
        try:
            colours = np.asarray(loaded.visual.to_color().face_colors, dtype=float) / 255.0
            if len(colours):
                red, green, blue, alpha = np.median(colours, axis=0)
                rgba = (float(red), float(green), float(blue), float(alpha))
        except Exception:  # colour is decoration; a file whose texture is missing still has its shape
            rgba = None
    return TriangleMesh(vertices, np.asarray(loaded.faces, dtype=np.int32), rgba)


def volumes(mesh: TriangleMesh) -> tuple[float, float]:
    """Return the enclosed volume and the convex hull's, cubic metres."""
    import trimesh

    body: Any = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    return abs(float(body.volume)), float(body.convex_hull.volume)


def add_mesh(spec: mujoco.MjSpec, name: str, vertices: Array, faces: Any, *, mirrored: bool = False) -> None:
    """Add a mesh from arrays; one that encloses nothing is taken as its hull."""
    corners = np.asarray(faces, dtype=np.int32)
    spec.add_mesh(
        name=name,
        uservert=np.asarray(vertices, dtype=np.float32).ravel(),
        userface=(corners[:, ::-1] if mirrored else corners).ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX if _is_solid(vertices) else _SHELL,
    )


def _is_solid(vertices: Array) -> bool:
    spread = np.linalg.svd(vertices - vertices.mean(axis=0), compute_uv=False)
    return len(vertices) >= 4 and bool(spread[-1] > 1e-4 * spread[0])
