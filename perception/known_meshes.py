"""Things whose mesh the task gives, found whole in what is seen of their colour before anything else is recognized.

A mesh lies on one of its faces. Of every way of lying the places are moved to the seen points by their distances from the surface
(iterated closest points with point-to-plane distances: Chen and Medioni, Object modelling by registration of multiple range
images, 1992). Where a camera sees through what would be the mesh, it is not there.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import dist
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, KDTree

from robosandbox.errors import InputError
from robosandbox.perception.factory import Setup
from robosandbox.perception.fit import Fit
from robosandbox.perception.frames import FrameSet, SegmentedFrame
from robosandbox.perception.groups import Group
from robosandbox.perception.recognize import measurements
from robosandbox.perception.segments import Segment
from robosandbox.perception.thing import Thing
from robosandbox.perception.track import Track
from robosandbox.shapes.mesh_file import mesh_bounds, mesh_triangles
from robosandbox.types import Array, Pose, matrix_from_rotation_vector
from robosandbox.values import frozen

# Distance of shares of red and green up to which a piece may be of a described colour; chosen as twice that of two views.
DESCRIBED_CHROMA = 0.12
# Number of seen points that tell how a mesh lies. Chosen.
_LEAST_POINTS = 60
# Confidence, a probability, of a mesh that explains what is seen. Chosen.
_CONFIDENCE = 0.95
# Standard deviations of its place, metres, and heading, radians. Chosen as the errors that benchmarks/meshes.py has.
_SIGMA = np.array([0.001, 0.001, 0.001, 0.01])
# Points of the mesh's surface, and of what was seen, that are compared. Chosen: 4 mm apart on a thing of 10 cm.
_POINTS, _SEEN = 4000, 200
# Headings, radians, from which a way of lying is begun. Chosen: half of a step is less than what the moving makes up for.
_HEADINGS = np.radians(np.arange(0.0, 360.0, 15.0))
# Faces on which it may rest, the largest first; ways of lying that are moved to what was seen. Chosen.
_FACES, _BEST = 24, 80
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


class KnownMeshes:
    """Finds the meshes that a task gives.

    Args:
        setup: What is known before the first look.
    """

    def __init__(self, setup: Setup) -> None:
        self._table = setup.scene.table_height
        self._told: dict[str, tuple[KnownMesh, Array]] = {}
        for item in setup.declared:
            known = setup.known.get(item.id)
            if known is None or known.mesh is None:
                continue
            try:
                self._told[item.id] = known_mesh(known.mesh, known.scale), np.array(item.rgb)
            except InputError:
                # The scene's own reader tells what is wrong with it.
                continue

    def find(
        self, segments: Sequence[Segment], frames: FrameSet, tracks: Mapping[str, Track], held: Collection[str]
    ) -> tuple[list[Thing], list[Segment]]:
        """Return the meshes that explain what is seen of their colour, and the pieces that are left.

        Args:
            segments: Of all views.
            frames: The views.
            tracks: What is remembered, by id.
            held: Ids of what is in grippers: it is where the hands are.
        """
        left, found = list(segments), []
        for name, (mesh, rgb) in self._told.items():
            own = _pieces(left, rgb, float(np.linalg.norm(mesh.half)))
            if name in held or sum(len(piece.points) for piece in own) < _LEAST_POINTS:
                continue
            track = tracks.get(name)
            near = track.thing.pose if track is not None and not track.thing.shape.size_fields else None
            fit = fit_mesh(
                mesh, np.vstack([piece.points for piece in own]), list(frames.by_camera.values()), self._table, near
            )
            if fit.explains:
                found.append(_thing(mesh, fit, rgb, Group(tuple(own)), frames))
                left = [piece for piece in left if piece not in own]
        return found, left


def _pieces(segments: Sequence[Segment], rgb: Array, radius: float) -> list[Segment]:
    """Return the pieces of a colour that are no farther from the largest one's middle than the mesh is large."""
    share = rgb[:2] / max(float(rgb.sum()), 1e-6)
    own = [piece for piece in segments if dist(piece.chroma, share) < DESCRIBED_CHROMA]
    if not own:
        return []
    middle = np.median(max(own, key=lambda piece: len(piece.points)).points, axis=0)
    return [piece for piece in own if float(np.linalg.norm(np.median(piece.points, axis=0) - middle)) < 1.5 * radius]


def _thing(mesh: KnownMesh, fit: MeshFit, rgb: Array, members: Group, frames: FrameSet) -> Thing:
    rotation, place = fit.pose.rotation, fit.pose.position
    seen = measurements(members, frames)
    box = Fit("box", place, mesh.half, 0.0, 0.0, np.zeros((7, 7)), seen.count, lean=rotation)
    return Thing(
        kind="mesh",
        size=tuple(map(float, mesh.half)),
        pose=fit.pose,
        rgb=rgb,
        confidence=_CONFIDENCE,
        sigma=_SIGMA,
        group=members,
        fit=box,
        seen=seen,
        resting=None,
    )


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
    """The surface of a mesh file around the middle of its box.

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
    triangles = (scale * mesh.vertices - (low + high) / 2.0)[mesh.faces]
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
    mesh: KnownMesh, seen: Array, frames: Sequence[SegmentedFrame], table: float, near: Pose | None = None
) -> MeshFit:
    """Return how a mesh lies that explains what was seen best.

    Args:
        mesh: Which.
        seen: Points of its surface in the world, shape (n, 3).
        frames: The views.
        table: Height of what it stands on, metres.
        near: How it lay before, which is tried first.
    """
    some = seen[:: max(1, len(seen) // _SEEN)]
    if near is not None:
        found = _moved(mesh, some, near.rotation, near.position)
        cost = _cost(mesh, some, frames, *found)
        if cost < _EXPLAINS:
            return MeshFit(Pose.from_matrix(found[1], found[0]), cost)
    starts = list(_starts(mesh, some, table))
    rough = np.array([_distance(mesh, some, *start) for start in starts])
    best = None
    for k in np.argsort(rough, kind="stable")[:_BEST]:
        found = _moved(mesh, some, *starts[k])
        cost = _cost(mesh, some, frames, *found)
        if best is None or cost < best[0]:
            best = cost, found
    assert best is not None
    return MeshFit(Pose.from_matrix(best[1][1], best[1][0]), best[0])


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


def _moved(mesh: KnownMesh, seen: Array, rotation: Array, place: Array) -> tuple[Array, Array]:
    """Return rotation and place moved such that what was seen lies on the surface."""
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
        damping = np.diag([1e-4, 1e-4, 1e-5, 0.1, 0.1, 0.1])
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
