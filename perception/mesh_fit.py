"""Meshes laid on what is seen: of every way of lying the places are moved to the seen points by their distances from the surface.

Iterated closest points with point-to-plane distances: Chen and Medioni, Object modelling by registration of multiple range
images, 1992. Where a camera sees through what would be the mesh, it is not there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, KDTree

from robosandbox.perception.frames import SegmentedFrame
from robosandbox.shapes.mesh_file import mesh_bounds, mesh_triangles
from robosandbox.types import Array, Pose, matrix_from_rotation_vector
from robosandbox.values import frozen

# Points of the mesh's surface, and of what was seen, that are compared. Chosen: 4 mm apart on a thing of 10 cm.
_POINTS, _SEEN = 4000, 200
# Headings, radians, from which a way of lying is begun. Chosen: half of a step is less than what the moving makes up for.
_HEADINGS = np.radians(np.arange(0.0, 360.0, 15.0))
# Faces on which it may rest, the largest first; ways of lying that are moved to what was seen. Chosen.
_FACES, _BEST = 24, 80
# Poses near which it may lie that are moved to what was seen: the best of those that are told.
_LIKELY = 5
# Steps of moving. Chosen: the last ones change it by less than 0.1 mm.
_STEPS = 12
# Metres from which a distance counts no more. Chosen as half of a finger.
_FAR = 0.012
# Metres to the nearest of the mesh's points up to which the surface is taken to be flat between them. Chosen: their distance.
_BETWEEN = 0.005
# Metres by which a camera must see beyond a point of the mesh, so that it is not there. Chosen: thrice the depth's noise.
_THROUGH = 0.01
# Mean distance of what was seen, metres, with what was seen through, up to which the mesh is what is there. Chosen.
_EXPLAINS = 0.0025


@frozen
class MeshFit:
    """Fit of a mesh: the pose of the middle of its box, and the mean distance of what was seen from it, metres."""

    pose: Pose
    cost: float

    @property
    def explains(self) -> bool:
        """True where the mesh is what was seen."""
        return self.cost < _EXPLAINS


@dataclass(frozen=True, eq=False)
class KnownMesh:
    """The surface of a mesh; of a file around the middle of its box.

    Attributes:
        points: On its surface, shape (n, 3).
        normals: There, up to their sign, shape (n, 3).
        corners: Of its convex hull, shape (k, 3).
    """

    points: Array
    normals: Array
    corners: Array

    @cached_property
    def tree(self) -> KDTree:
        """For the nearest of its points."""
        return KDTree(self.points)

    @cached_property
    def half(self) -> Array:
        """Half-extents of its box, shape (3,)."""
        return np.asarray(np.ptp(self.corners, axis=0) / 2.0)

    @cached_property
    def rests(self) -> list[Array]:
        """Rotations (3, 3) that lay it on faces of its hull on which it may stay, the largest face first."""
        hull = ConvexHull(self.corners)
        normals, areas = [], []
        left = list(range(len(hull.equations)))
        while left:
            plane = hull.equations[left[0]]
            same = [k for k in left if plane[:3] @ hull.equations[k][:3] > 0.999]
            left = [k for k in left if k not in same]
            axes = np.linalg.svd(plane[None, :3])[2][1:]
            outline = ConvexHull(self.corners[np.unique(hull.simplices[same])] @ axes.T)
            normals.append(plane[:3])
            areas.append(outline.volume)
        order = np.argsort(areas)[::-1][:_FACES]
        return [_turn(normals[k], np.array([0.0, 0.0, -1.0])) for k in order]


@lru_cache(maxsize=16)
def known_mesh(path: Path, scale: float) -> KnownMesh:
    """Return the surface of a mesh file, `scale` metres per unit."""
    low, high = mesh_bounds(path, scale, of=path.name)
    mesh = mesh_triangles(path)
    return surface_of((scale * mesh.vertices - (low + high) / 2.0)[mesh.faces])


def surface_of(triangles: Array) -> KnownMesh:
    """Return the surface of triangles, shape (n, 3, 3), metres, around the origin of their frame."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(across, axis=1)
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(areas), size=_POINTS, p=areas / areas.sum())
    u, v = rng.random((2, _POINTS, 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = triangles[chosen].transpose(1, 0, 2)
    points = triangles.reshape(-1, 3)
    return KnownMesh(
        a + u * (b - a) + v * (c - a), across[chosen] / areas[chosen, None], points[ConvexHull(points).vertices]
    )


def fit_mesh(
    mesh: KnownMesh, seen: Array, frames: Sequence[SegmentedFrame], table: float, near: Sequence[Pose] = ()
) -> MeshFit:
    """Return how a mesh lies that explains what was seen best.

    Args:
        mesh: Which.
        seen: Points of its surface in the world, shape (n, 3).
        frames: The views.
        table: Height of what it stands on, metres.
        near: How it may lie, as it lay before, which is tried first, and taken where one of them explains what was seen.
    """
    some = seen[:: max(1, len(seen) // _SEEN)]
    if near and (found := fit_near(mesh, seen, frames, near)).explains:
        return found
    starts = list(_starts(mesh, some, table))
    rough = np.array([_distance(mesh, some, *start) for start in starts])
    moved = (_laid(mesh, some, frames, *starts[k]) for k in np.argsort(rough, kind="stable")[:_BEST])
    return min(moved, key=lambda one: one.cost)


def fit_near(mesh: KnownMesh, seen: Array, frames: Sequence[SegmentedFrame], near: Sequence[Pose]) -> MeshFit:
    """Return how a mesh lies that lay nearly as one of some poses says; arguments as for `fit_mesh`."""
    some = seen[:: max(1, len(seen) // _SEEN)]
    rough = np.array([_distance(mesh, some, pose.rotation, pose.position) for pose in near])
    likely = [near[k] for k in np.argsort(rough, kind="stable")[:_LIKELY]]
    return min((_laid(mesh, some, frames, pose.rotation, pose.position) for pose in likely), key=lambda one: one.cost)


def fit_level(mesh: KnownMesh, seen: Array, frames: Sequence[SegmentedFrame], near: Pose) -> MeshFit:
    """Return how a mesh lies that lay nearly so, turned about the vertical alone; arguments as for `fit_mesh`."""
    some = seen[:: max(1, len(seen) // _SEEN)]
    return _laid(mesh, some, frames, near.rotation, near.position, level=True)


def _laid(
    mesh: KnownMesh,
    seen: Array,
    frames: Sequence[SegmentedFrame],
    rotation: Array,
    place: Array,
    *,
    level: bool = False,
) -> MeshFit:
    rotation, place = _moved(mesh, seen, rotation, place, level=level)
    return MeshFit(Pose.from_matrix(place, rotation), _cost(mesh, seen, frames, rotation, place))


def _starts(mesh: KnownMesh, seen: Array, table: float) -> Iterator[tuple[Array, Array]]:
    low, high = np.percentile(seen, [2.0, 98.0], axis=0)
    for rest in mesh.rests:
        for heading in _HEADINGS:
            rotation = matrix_from_rotation_vector(np.array([0.0, 0.0, heading])) @ rest
            corners = mesh.corners @ rotation.T
            middle = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
            place = (low + high) / 2.0 - middle
            place[2] = table - corners[:, 2].min()
            yield rotation, place


def _distance(mesh: KnownMesh, seen: Array, rotation: Array, place: Array) -> float:
    local = (seen - place) @ rotation
    apart, index = map(np.asarray, mesh.tree.query(local, distance_upper_bound=_FAR))
    near = apart < _BETWEEN
    found = index[near]
    apart[near] = np.abs(((local[near] - mesh.points[found]) * mesh.normals[found]).sum(axis=1))
    return float(np.minimum(apart, _FAR).mean())


def _moved(mesh: KnownMesh, seen: Array, rotation: Array, place: Array, *, level: bool = False) -> tuple[Array, Array]:
    """Return rotation and place moved such that what was seen lies on the surface; `level` turns about the vertical alone."""
    tilts = 1e6 if level else 1e-4
    reach = 4.0 * _FAR
    for _ in range(_STEPS):
        local = (seen - place) @ rotation
        apart, index = map(np.asarray, mesh.tree.query(local, distance_upper_bound=reach))
        near = np.isfinite(apart)
        if near.sum() < 6:
            break
        reach = max(_FAR, 0.7 * reach)
        normals = mesh.normals[index[near]] @ rotation.T
        gaps = ((local[near] - mesh.points[index[near]]) * mesh.normals[index[near]]).sum(axis=1)
        arms = seen[near] - place
        rows = np.column_stack([np.cross(arms, normals), normals])
        damping = np.diag([tilts, tilts, 1e-5, 0.1, 0.1, 0.1])
        change = np.linalg.solve(rows.T @ rows + damping, rows.T @ gaps)
        # The mesh moves towards what was seen.
        rotation = matrix_from_rotation_vector(change[:3]) @ rotation
        place = place + change[3:]
    return rotation, place


def _cost(mesh: KnownMesh, seen: Array, frames: Sequence[SegmentedFrame], rotation: Array, place: Array) -> float:
    """Return the mean distance of what was seen, and of the mesh where a camera sees through it, metres."""
    points = mesh.points[::8] @ rotation.T + place
    through = np.zeros(len(points))
    for frame in frames:
        through = np.maximum(through, np.nan_to_num(np.clip(frame.beyond(points) - _THROUGH, 0.0, _FAR)))
    return _distance(mesh, seen, rotation, place) + float(through.mean())


def _turn(one: Array, other: Array) -> Array:
    """Return the rotation (3, 3) that takes one unit vector to another."""
    axis, cosine = np.cross(one, other), float(one @ other)
    if cosine < -0.999999:
        across = np.linalg.svd(one[None])[2][1]
        return np.asarray(2.0 * np.outer(across, across) - np.eye(3))
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + cosine))
