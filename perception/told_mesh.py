"""Things that a task describes by a mesh: where what is seen tells how one lies, it is taken to be that mesh."""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from robosandbox.errors import InputError
from robosandbox.motion.beliefs import DeclaredProperties
from robosandbox.shapes.hull import BoxHull
from robosandbox.shapes.mesh_file import mesh_bounds, mesh_pieces
from robosandbox.shapes.polyhedron import PolyhedronHull
from robosandbox.types import Array, DetectedObject, Pose

# Metres by which a half-extent that is seen may differ from the mesh's; chosen as twice the 95th percentile of the error of
# places in benchmarks/perception.py, 2.2 mm.
_SAME_EXTENT = 0.005
# Metres by which the mesh may reach differently in two ways of lying that what is seen cannot tell apart; chosen as that.
_ALIKE = 0.005
# Turns about the axis of what is seen as round, rad; chosen every 15 degrees up to the right angle, where they repeat.
_TURNS = np.radians(np.arange(0.0, 90.0, 15.0))
# Directions in which reaches are compared, unit vectors (k, 3); chosen evenly over the sphere (Fibonacci's lattice).
_HEIGHTS = 1.0 - (2.0 * np.arange(60) + 1.0) / 60
_DIRECTIONS = np.column_stack(
    [
        np.sqrt(1.0 - _HEIGHTS**2) * np.cos(np.arange(60) * np.pi * (3.0 - np.sqrt(5.0))),
        np.sqrt(1.0 - _HEIGHTS**2) * np.sin(np.arange(60) * np.pi * (3.0 - np.sqrt(5.0))),
        _HEIGHTS,
    ]
)


def as_told(item: DetectedObject, known: DeclaredProperties | None) -> DetectedObject:
    """Return a seen thing as the mesh that its task describes, or as it is seen where that leaves open how the mesh lies.

    Args:
        item: As seen: a box, cylinder, capsule or sphere.
        known: What the task says of what has its id; None for what it does not describe.
    """
    if known is None or known.mesh is None or item.shape.holds_things or not item.shape.size_fields:
        return item
    try:
        points = _corners(known.mesh, known.scale)
        low, high = mesh_bounds(known.mesh, known.scale, of=item.id)
    except InputError:
        return item
    half = (high - low) / 2.0
    hull = item.shape.hull(item.size)
    seen = hull.half_extents
    fitting = [R for R in _rotations() if float(np.abs(np.abs(R) @ half - seen).max()) < _SAME_EXTENT]
    if not fitting:
        return item
    best = min(fitting, key=lambda R: float(np.abs(np.abs(R) @ half - seen).max()) - R[2, 2] * _SAME_EXTENT)
    turns = [np.eye(3)] if isinstance(hull, BoxHull) else [_about_z(angle) for angle in _TURNS]
    reach = (_DIRECTIONS @ best @ points.T).max(axis=1)
    for R, turn in itertools.product(fitting, turns):
        if float(np.abs((_DIRECTIONS @ turn @ R @ points.T).max(axis=1) - reach).max()) > _ALIKE:
            return item
    pose = Pose.from_matrix(item.pose.position, item.pose.rotation @ best)
    return replace(item, kind="mesh", size=tuple(map(float, half)), pose=pose)


@lru_cache(maxsize=64)
def _corners(path: Path, scale: float) -> Array:
    """Return the corners (k, 3) of a mesh's convex hull around the middle of its box, metres."""
    (piece,) = mesh_pieces(path, scale, 1.0, decomposed=False, of=path.name)
    assert isinstance(piece.hull, PolyhedronHull)
    corners: Array = piece.hull.corners + np.array(piece.centre)
    return corners


@lru_cache(maxsize=1)
def _rotations() -> tuple[Array, ...]:
    """Return the 24 rotations (3, 3) that take a box's axes to its axes."""
    signed = (
        np.eye(3)[list(order)] * np.array(signs)
        for order in itertools.permutations(range(3))
        for signs in itertools.product((1.0, -1.0), repeat=3)
    )
    return tuple(R for R in signed if np.linalg.det(R) > 0.0)


def _about_z(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
