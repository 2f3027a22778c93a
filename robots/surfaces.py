"""Points spread over the surfaces of geoms."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np

from robosandbox.types import Array

_GEOM = mujoco.mjtGeom


def points_on(model: mujoco.MjModel, geom: int, spacing: float = 0.002, most: int = 30_000) -> Array:
    """Return points on a geom's surface in its own frame, about `spacing` metres apart, shape (k, 3)."""
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    match kind:
        case _GEOM.mjGEOM_MESH.value:
            return _on_mesh(model, int(model.geom_dataid[geom]), spacing, most)
        case _GEOM.mjGEOM_BOX.value:
            return _on_box(size, spacing)
        case _GEOM.mjGEOM_SPHERE.value:
            return np.asarray(_sphere() * size[0])
        case _GEOM.mjGEOM_ELLIPSOID.value:
            return np.asarray(_sphere() * size)
        case _GEOM.mjGEOM_CAPSULE.value:
            return _tube(size[0], size[1], spacing, round_ends=True)
        case _GEOM.mjGEOM_CYLINDER.value:
            return _tube(size[0], size[1], spacing, round_ends=False)
        case _:
            return np.zeros((0, 3))


def world_points(model: mujoco.MjModel, data: mujoco.MjData, geoms: Iterable[int], spacing: float = 0.002) -> Array:
    """Return points on geoms in the world, shape (k, 3)."""
    found = [data.geom_xpos[g] + points_on(model, g, spacing) @ data.geom_xmat[g].reshape(3, 3).T for g in geoms]
    return np.concatenate(found) if found else np.zeros((0, 3))


def _on_mesh(model: mujoco.MjModel, mesh: int, spacing: float, most: int) -> Array:
    start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    vertices: Array = model.mesh_vert[start : start + count].astype(float)
    first, number = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    corners = vertices[model.mesh_face[first : first + number]]
    across, along = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.linalg.norm(np.cross(across, along), axis=1) / 2.0
    total = float(area.sum())
    if total <= 0.0:
        return vertices
    amount = int(np.clip(total / spacing**2, 200, most))
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(area), amount, p=area / total)
    u, v = rng.random((2, amount))
    fold = u + v > 1.0
    u, v = np.where(fold, 1.0 - u, u), np.where(fold, 1.0 - v, v)
    inner = corners[chosen, 0] + u[:, None] * across[chosen] + v[:, None] * along[chosen]
    return np.concatenate([vertices, inner])


def _on_box(half: Array, spacing: float) -> Array:
    faces = []
    for axis in range(3):
        first, second = (i for i in range(3) if i != axis)
        u = _steps(half[first], spacing)
        v = _steps(half[second], spacing)
        grid = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
        for sign in (-1.0, 1.0):
            face = np.empty((len(grid), 3))
            face[:, first], face[:, second], face[:, axis] = grid[:, 0], grid[:, 1], sign * half[axis]
            faces.append(face)
    return np.concatenate(faces)


def _steps(half: float, spacing: float) -> Array:
    return np.linspace(-half, half, int(np.clip(2.0 * half / spacing, 2, 60)) + 1)


def _sphere() -> Array:
    k = np.arange(600) + 0.5
    polar, turn = np.arccos(1.0 - 2.0 * k / 600), np.pi * (1.0 + 5.0**0.5) * k
    return np.column_stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)])


def _tube(radius: float, half: float, spacing: float, *, round_ends: bool) -> Array:
    angles = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    ring = np.column_stack([np.cos(angles), np.sin(angles)]) * radius
    side = np.concatenate([np.column_stack([ring, np.full(len(ring), z)]) for z in _steps(half, spacing)])
    ends = []
    for sign in (-1.0, 1.0):
        if round_ends:
            cap = _sphere() * radius
            ends.append(cap[cap[:, 2] * sign >= 0.0] + [0.0, 0.0, sign * half])
        else:
            for share in np.linspace(0.0, 1.0, 8):
                ends.append(np.column_stack([ring * share, np.full(len(ring), sign * half)]))
    return np.concatenate([side, *ends])
