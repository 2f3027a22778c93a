"""Grasps of a suction cup: flat faces that it fits on, from above and from the side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import assert_never

import numpy as np

from robosandbox.grasp.hand import UP, unit
from robosandbox.shapes.box import Box
from robosandbox.shapes.hull import BoxHull, CapsuleHull, CylinderHull, SphereHull
from robosandbox.shapes.polyhedron import PolyhedronHull
from robosandbox.types import Array, DetectedObject, Grasp, Pose
from robosandbox.values import frozen
from robosandbox.world.relations import centre

_EDGE = 0.001  # Metres that a lip stays inside a face's edge. Chosen: perception's error of a size is 0.8 mm (docs/measured.md).
_PRESS = 0.0005  # Metres that a lip is pressed into a face, so that it lies on all of it. Chosen as half of what a soft lip gives.
# Cosine of a face's direction to the vertical from which it is on top, and below which it faces down. Chosen: 18 degrees, so
# that a thing on a slope is taken from above; and level.
_TOP, _UNDER = 0.95, -0.1
_TURNS = 8  # Number of turns of the hand about the cup's axis. Chosen: a cup is round, and arms are not.
_SAME = (
    1e-3  # Difference of unit normals, and metres of their offsets, up to which two triangles are of one face. Chosen.
)
_BEYOND = 0.002  # Metres before a face at which nothing else of the object may be. Chosen as two voxels of a cut mesh.


@frozen
class Face:
    """A flat face in the world: middle (3,), outward unit normal (3,), and the radius of a circle about the middle inside it."""

    middle: Array
    normal: Array
    radius: float


def suction_tiers(target: DetectedObject, cup: float, base: Array, pieces: Sequence[Array]) -> Iterator[list[Grasp]]:
    """Yield grasps by a cup of this diameter, metres: on top, then from the sides, those that face the robot first.

    Args:
        target: What to hold.
        cup: Metres.
        base: Where the robot stands, shape (3,).
        pieces: For a mesh: points that span each of its convex pieces, in its frame, each (k, 3).
    """
    wide = [face for face in faces(target, pieces) if face.radius >= cup / 2.0 + _EDGE]
    level = [face for face in wide if face.normal[2] < _TOP]
    for tier in ([face for face in wide if face.normal[2] >= _TOP], level):
        if tier:
            yield [grasp for face in tier for grasp in _on(target, face, base)]


def widest_face(target: DetectedObject, pieces: Sequence[Array] = ()) -> float:
    """Return the diameter of the largest circle on a flat face that a cup could come to, metres; 0 where there is none."""
    return max((2.0 * face.radius for face in faces(target, pieces)), default=0.0)


def least_face(cup: float) -> float:
    """Return the diameter of the smallest flat face that a cup holds, metres."""
    return cup + 2.0 * _EDGE


def faces(target: DetectedObject, pieces: Sequence[Array] = ()) -> list[Face]:
    """Return an object's flat faces that do not face down, nor open into it."""
    solids = _pieces(target, pieces)
    mouth = target.pose.rotation[:, 2] if target.shape.room(target.size) is not None else None
    found = []
    for index, planes in enumerate(solids):
        for face in planes.faces:
            if face.normal[2] < _UNDER or (mouth is not None and face.normal @ mouth > _TOP):
                continue
            others = [other for k, other in enumerate(solids) if k != index]
            if not any(other.covers(face) for other in others):
                found.append(face)
    return found


def _on(target: DetectedObject, face: Face, base: Array) -> Iterator[Grasp]:
    """Yield grasps on a face, the hand turned about its normal: on top the nearer the middle of all the better."""
    offset = centre(target) - face.middle
    aside = float(np.linalg.norm(offset - face.normal * (face.normal @ offset)))
    towards = unit((base - face.middle) * [1.0, 1.0, 0.0]) @ face.normal
    quality = 2.0 - 10.0 * aside if face.normal[2] >= _TOP else 1.0 + 0.3 * float(towards)
    first = unit(np.cross(face.normal, UP if abs(face.normal[2]) < _TOP else np.array([1.0, 0.0, 0.0])))
    second = np.cross(face.normal, first)
    for turn in np.arange(_TURNS) * 2.0 * np.pi / _TURNS:
        closing = np.cos(turn) * first + np.sin(turn) * second
        side = np.asarray(np.cross(face.normal, closing), dtype=np.float64)
        rotation = np.column_stack([side, closing, -face.normal])
        pose = Pose.from_matrix(face.middle - _PRESS * face.normal, rotation)
        yield Grasp(object=target.id, tcp_pose=pose, width=0.0, quality=quality, how="suction")


@frozen
class _Piece:
    """A convex part: its flat faces, and all its outward planes (f, 4) in the world."""

    faces: list[Face]
    planes: Array

    def covers(self, face: Face) -> bool:
        """Tell whether it is right before the middle of another part's face."""
        point = face.middle + _BEYOND * face.normal
        return bool(len(self.planes)) and bool((self.planes[:, :3] @ point + self.planes[:, 3] <= 0.0).all())


def _pieces(target: DetectedObject, pieces: Sequence[Array]) -> list[_Piece]:
    if pieces:
        return [_of_corners(target.pose, points) for points in pieces]
    parts = target.shape.convex_parts(target)
    if parts:
        return [_whole(replace(target, kind=Box.kind, size=hull.size, pose=pose)) for hull, pose in parts]
    return [_whole(target)]


def _whole(target: DetectedObject) -> _Piece:
    """Return what kind and size say of an object."""
    hull = target.shape.hull(target.size)
    rotation, middle = target.pose.rotation, centre(target)
    match hull:
        case BoxHull():
            half = hull.half_extents
            found = [
                Face(middle + sign * half[k] * rotation[:, k], sign * rotation[:, k], float(np.delete(half, k).min()))
                for k in range(3)
                for sign in (1.0, -1.0)
            ]
            return _Piece(found, np.array([[*face.normal, -float(face.normal @ face.middle)] for face in found]))
        case CylinderHull():
            radius, reach = float(hull.half_extents[0]), float(hull.half_extents[2])
            axis = rotation[:, 2]
            return _Piece([Face(middle + s * reach * axis, s * axis, radius) for s in (1.0, -1.0)], np.zeros((0, 4)))
        case SphereHull() | CapsuleHull():
            return _Piece([], np.zeros((0, 4)))
        case PolyhedronHull():
            return _of_corners(Pose.from_matrix(middle, rotation), hull.corners)
        case _:
            assert_never(hull)


def _of_corners(pose: Pose, corners: Array) -> _Piece:
    """Return the faces of the hull of points (k, 3) in a frame: triangles of one plane together."""
    from scipy.spatial import ConvexHull, QhullError

    points = pose.position + corners @ pose.rotation.T
    try:
        hull = ConvexHull(points)
    except QhullError:
        return _Piece([], np.zeros((0, 4)))
    left, found = list(range(len(hull.equations))), []
    while left:
        plane = hull.equations[left[0]]
        together = [k for k in left if np.abs(hull.equations[k] - plane).max() < _SAME]
        left = [k for k in left if k not in together]
        found.append(_face(points[np.unique(hull.simplices[together])], plane[:3]))
    return _Piece([face for face in found if face.radius > 0.0], hull.equations)


def _face(points: Array, normal: Array) -> Face:
    """Return the face that coplanar points (k, 3) span, with the circle about the middle of its outline inside it."""
    from scipy.spatial import ConvexHull, QhullError

    aside = np.asarray(np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())]), dtype=np.float64)
    first = unit(aside)
    axes = np.stack([first, np.cross(normal, first)])
    flat = points @ axes.T
    middle = (flat.max(axis=0) + flat.min(axis=0)) / 2.0
    try:
        outline = ConvexHull(flat).equations
    except QhullError:
        return Face(points.mean(axis=0), normal, 0.0)
    radius = float(-(outline[:, :2] @ middle + outline[:, 2]).max())
    return Face(middle @ axes + normal * float(points[0] @ normal), normal, radius)
