"""Open-top containers from convex pieces: a floor and walls of real thickness."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from robosandbox.sim.objects.geoms import add_geom
from robosandbox.types import CONTAINER_WALL, Array, SceneObject

_RING_PIECES = 20


@dataclass(frozen=True, slots=True)
class Piece:
    """A convex piece of a container, in the frame whose origin is the middle of the container's bottom face.

    Attributes:
        type: A box or a cylinder.
        size: As MuJoCo takes it for the type, metres.
        centre: Metres, shape (3,).
        yaw: About local z, radians.
        volume: Cubic metres.
    """

    type: mujoco.mjtGeom
    size: Array
    centre: Array
    yaw: float
    volume: float


def add_container(body: mujoco.MjsBody, item: SceneObject) -> None:
    """Add the geoms of a bin, bowl or cup; the mass is shared out by volume."""
    pieces = bin_pieces(item.size) if item.kind == "bin" else ring_pieces(item.size)
    whole = sum(piece.volume for piece in pieces)
    for piece in pieces:
        quat = [math.cos(piece.yaw / 2.0), 0.0, 0.0, math.sin(piece.yaw / 2.0)]
        mass = item.mass * piece.volume / whole
        add_geom(body, item, mass, type=piece.type, size=piece.size, pos=piece.centre, quat=quat)


def bin_pieces(size: tuple[float, ...]) -> list[Piece]:
    """Return the floor and four walls of a bin with these inner half-extents and height."""
    half_x, half_y, height = size
    wall = CONTAINER_WALL / 2.0
    outer_x, middle = half_x + 2.0 * wall, height / 2.0
    return [
        _box((outer_x, half_y + 2.0 * wall, wall), (0.0, 0.0, wall)),
        _box((wall, half_y, middle - wall), (half_x + wall, 0.0, middle + wall)),
        _box((wall, half_y, middle - wall), (-half_x - wall, 0.0, middle + wall)),
        _box((outer_x, wall, middle - wall), (0.0, half_y + wall, middle + wall)),
        _box((outer_x, wall, middle - wall), (0.0, -half_y - wall, middle + wall)),
    ]


def ring_pieces(size: tuple[float, ...]) -> list[Piece]:
    """Return the round floor of a bowl or cup and the flat pieces that its wall is made of.

    The inner faces lie at the inner radius, the outer ones a wall further out; at the seams the wall is up to 1.3 %
    of the radius thicker outside, and nowhere inside.
    """
    radius, height = size
    wall = CONTAINER_WALL / 2.0
    outer = radius + 2.0 * wall
    floor = Piece(
        mujoco.mjtGeom.mjGEOM_CYLINDER,
        np.array([outer, wall, 0.0]),
        np.array([0.0, 0.0, wall]),
        0.0,
        math.pi * outer**2 * 2.0 * wall,
    )
    half = (wall, outer * math.tan(math.pi / _RING_PIECES), height / 2.0 - wall)
    ring = []
    for k in range(_RING_PIECES):
        angle = 2.0 * math.pi * k / _RING_PIECES
        middle = radius + wall
        ring.append(_box(half, (middle * math.cos(angle), middle * math.sin(angle), height / 2.0 + wall), angle))
    return [floor, *ring]


def _box(half: tuple[float, float, float], centre: tuple[float, float, float], yaw: float = 0.0) -> Piece:
    return Piece(mujoco.mjtGeom.mjGEOM_BOX, np.array(half), np.array(centre), yaw, 8.0 * math.prod(half))
