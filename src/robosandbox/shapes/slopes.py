"""Sloping faces of a solid of convex pieces on which a thing stays that leans on them: those with a ledge at their lower end."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from robosandbox.shapes.heights import LEAST_WIDTH, LEVEL, ConvexPiece
from robosandbox.spatial import Array, frozen_array
from robosandbox.values import frozen

# Cosine of the tilt up to which a thing leans on a face more than on the ledge below it: half a right angle.
_STEEPEST = 0.7
# Metres by which a ledge stands out from the face at the least: what is round does not roll over it.
_LEDGE = 0.004
# Share of the face's width that a ledge has to run along.
_ALONG = 0.5
# Metres within which corners lie in one plane: twice what rounding a plane to four places leaves of it.
_FLAT = 2e-4
_UP = np.array([0.0, 0.0, 1.0])


@frozen(eq=False)
class SlopingFace:
    """A face that slopes down to a ledge, in the frame of the solid.

    Attributes:
        axes: Unit vectors as columns, shape (3, 3): level across it, uphill in it, and out of it.
        offset: How far it lies along the last, metres.
        stop: How far uphill the ledge reaches, metres from the frame's origin.
        sides: Its edges as inequalities over the first two, `sides[:, :2] @ point + sides[:, 2] <= 0`, shape (m, 3).
        middle: Its middle along the first two, shape (2,), metres.
        half_width: Of its box across, metres.
    """

    axes: Array
    offset: float
    stop: float
    sides: Array
    middle: Array
    half_width: float

    def margin(self, point: Array) -> float:
        """Return how far within its edges a point (3,) is, seen along its normal, metres; negative outside."""
        flat = point @ self.axes[:, :2]
        return -float((self.sides[:, :2] @ flat + self.sides[:, 2]).max())

    @property
    def height(self) -> float:
        """Height of its middle, metres."""
        return float(self.axes[2] @ [*self.middle, self.offset])


def sloping_faces(pieces: list[ConvexPiece]) -> tuple[SlopingFace, ...]:
    """Return the sloping faces wide enough for things and with a ledge, the highest first."""
    found = [
        face for number, piece in enumerate(pieces) for face in _of_piece(piece, pieces[:number] + pieces[number + 1 :])
    ]
    return tuple(sorted(found, key=lambda face: -face.height))


def _of_piece(piece: ConvexPiece, others: list[ConvexPiece]) -> Iterator[SlopingFace]:
    from scipy.spatial import ConvexHull

    sloping = (piece.normals[:, 2] > _STEEPEST) & (piece.normals[:, 2] < LEVEL)
    # A flat side of a hull is several triangles.
    planes = np.unique(np.column_stack([piece.normals, piece.offsets])[sloping].round(4), axis=0)
    for normal, offset in zip(planes[:, :3], planes[:, 3], strict=True):
        uphill = (_UP - normal * normal[2]) / math.sqrt(1.0 - normal[2] ** 2)
        axes = np.column_stack([np.cross(normal, uphill), uphill, normal])
        face = (piece.points @ axes)[np.abs(piece.points @ normal - offset) < _FLAT, :2]
        if len(face) < 3 or np.ptp(face, axis=0).min() < LEAST_WIDTH:
            continue
        stops = [
            stop for other in others if (stop := _ledge(other.points @ axes - [0.0, 0.0, offset], face)) is not None
        ]
        if stops:
            yield SlopingFace(
                axes=frozen_array(axes),
                offset=float(offset),
                stop=max(stops),
                sides=frozen_array(ConvexHull(face).equations),
                middle=frozen_array((face.min(axis=0) + face.max(axis=0)) / 2.0),
                half_width=float(np.ptp(face[:, 0])) / 2.0,
            )


def _ledge(points: Array, face: Array) -> float | None:
    """Return how far uphill a piece (k, 3) reaches that stands out from the lower half of a face (n, 2); None for another."""
    (left, _, within), (right, up, out) = points.min(axis=0), points.max(axis=0)
    (first, lowest), (last, highest) = face.min(axis=0), face.max(axis=0)
    is_below = lowest - _LEDGE < up < (lowest + highest) / 2.0
    if not is_below or within > _LEDGE or out < _LEDGE:
        return None
    common = min(right, last) - max(left, first)
    return float(up) if common > _ALONG * (last - first) else None
