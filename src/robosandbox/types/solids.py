"""Convex pieces of a scene's object at a pose, for the truth or referee of a driver whose engine cannot be asked."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from robosandbox.shapes.body import Piece, Slide
from robosandbox.shapes.hull import BoxHull, CapsuleHull, CylinderHull, Hull, SphereHull
from robosandbox.shapes.polyhedron import PolyhedronHull
from robosandbox.spatial import Array, Pose, frozen_array, matrix_from_quat_xyzw
from robosandbox.types.objects import SceneObject
from robosandbox.types.truth import Convex

# Corners of the polygon that stands for a circle; chosen: at most 0.12 % of the radius within it.
_AROUND = 64
_TURN = np.arange(_AROUND) * math.tau / _AROUND
CIRCLE = np.column_stack([np.cos(_TURN), np.sin(_TURN), np.zeros(_AROUND)])
CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_UP = np.array([0.0, 0.0, 1.0])


def solids_as_written(item: SceneObject, pose: Pose, opening: float | None = None) -> tuple[Convex, ...]:
    """Return an object's pieces as its shape makes them.

    Args:
        item: As the scene has it; beads are none, their truth tells where each is.
        pose: Of its first body, in the world.
        opening: How far its sliding body is open, metres.
    """
    if item.shape.is_granular:
        return ()
    made = []
    for part, body in enumerate(item.shape.bodies(item)):
        slid = np.array(body.joint.axis) * (opening or 0.0) if isinstance(body.joint, Slide) else np.zeros(3)
        made += [_placed(piece, pose, slid, part) for piece in body.pieces]
    return tuple(made)


def _placed(piece: Piece, pose: Pose, slid: Array, part: int) -> Convex:
    points, radius = _form(piece.hull)
    turned = points @ matrix_from_quat_xyzw(piece.quat_xyzw).T + np.array(piece.centre) + slid
    return Convex(points=frozen_array(turned @ pose.rotation.T + pose.position), radius=radius, part=part)


def _form(hull: Hull) -> tuple[Array, float]:
    """Return points (k, 3) and the radius around them that make a hull, metres."""
    match hull:
        case BoxHull(size=half):
            return CORNERS * half, 0.0
        case SphereHull(size=(radius,)):
            return np.zeros((1, 3)), radius
        case CylinderHull(size=(radius, height)):
            return _ends(radius * CIRCLE, height), 0.0
        case CapsuleHull(size=(radius, height)):
            return _ends(np.zeros((1, 3)), height), radius
        case PolyhedronHull():
            return hull.corners, 0.0


def _ends(points: Sequence[float] | Array, height: float) -> Array:
    return np.vstack([points - height * _UP, points + height * _UP])
