"""Outline of an arm: points on its links that move with its joints, without a model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robosandbox.spatial import Array


@dataclass(frozen=True, kw_only=True)
class Outline:
    """Points about which the balls of their radii have an arm's links, and its gripper opened, within their hull.

    Positions are products of exponentials (Brockett, "Robotic manipulators and the product of exponentials formula", 1984).

    Attributes:
        axes: Axis of each joint in the world, all joints at 0, unit vectors, shape (n, 3).
        anchors: A point on each axis, likewise, metres, shape (n, 3).
        slides: Whether each joint slides along its axis, shape (n,); others turn about it.
        points: In the world, likewise, metres, shape (k, 3).
        radii: Metres, shape (k,).
        joints_before: By how many of the joints, from the base, each point is moved, shape (k,).
        link_of: Place of each point's link in `links`, shape (k,).
        links: Names of the links.
    """

    axes: Array
    anchors: Array
    slides: NDArray[np.bool_]
    points: Array
    radii: Array
    joints_before: NDArray[np.intp]
    link_of: NDArray[np.intp]
    links: tuple[str, ...]

    def places(self, q: Array) -> Array:
        """Return where the points are in the world at a configuration (n,), metres, shape (k, 3)."""
        moves = self._moves(q)
        found = np.empty((len(moves) + 1, 4, 4))
        found[0] = np.eye(4)
        for joint, move in enumerate(moves):
            np.matmul(found[joint], move, out=found[joint + 1])
        by = found[self.joints_before]
        places: Array = (by[:, :3, :3] @ self.points[:, :, None])[:, :, 0] + by[:, :3, 3]
        return places

    def _moves(self, q: Array) -> Array:
        """Return how each joint by itself moves what is behind it, shape (n, 4, 4)."""
        cross, square = self._crosses
        angle, way = np.where(self.slides, 0.0, q), np.where(self.slides, q, 0.0)
        turns = np.eye(3) + np.sin(angle)[:, None, None] * cross + (1.0 - np.cos(angle))[:, None, None] * square
        moves = np.zeros((len(q), 4, 4))
        moves[:, :3, :3], moves[:, 3, 3] = turns, 1.0
        moves[:, :3, 3] = self.anchors - (turns @ self.anchors[:, :, None])[:, :, 0] + way[:, None] * self.axes
        return moves

    @cached_property
    def _crosses(self) -> tuple[Array, Array]:
        """The matrices of the cross products with the axes, and their squares, each shape (n, 3, 3)."""
        x, y, z = self.axes.T
        nothing = np.zeros(len(x))
        cross = np.array([[nothing, -z, y], [z, nothing, -x], [-y, x, nothing]]).transpose(2, 0, 1)
        return cross, cross @ cross
