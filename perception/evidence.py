"""Measurements of one thing from all views together: tangent planes and surface points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robosandbox.perception.frame import PointCloudFrame
from robosandbox.perception.silhouette import Rows
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.types import Array

# Share of a point's weight that its neighbours leave to it: sim/sensors.py shares noise in windows of 3 x 3. Chosen about
# 1/9.
_INDEPENDENT = 0.1
# Standard deviation, metres, of how far points reach to a side, which says roughly where a thing is. Chosen.
_ROUGH = 0.008
# Standard deviation of the height of what a thing stands on, metres. Chosen below a millimetre, because the table is fitted
# to thousands of pixels.
_STANDS = 0.0008
_UP = np.array([0.0, 0.0, 1.0])
_COMPASS = np.array([[np.cos(angle), np.sin(angle), 0.0] for angle in np.arange(8) * np.pi / 4.0])


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Surface points, each with where it was seen from.

    Attributes:
        points: World, (n, 3).
        camera: The same for all, (3,), or one for each, (n, 3).
        weight: 1 / standard deviation along the normal, 1/m; one number, or one for each, (n,).
    """

    points: Array
    camera: Array
    weight: float | Array

    @cached_property
    def to_camera(self) -> Array:
        """From each point to where it was seen from, (n, 3), metres."""
        return np.asarray(self.camera - self.points)

    @cached_property
    def weights(self) -> Array:
        """The weight of each point, (n,)."""
        return np.full(len(self.points), self.weight) if np.ndim(self.weight) == 0 else np.asarray(self.weight)

    @cached_property
    def rows(self) -> Array:
        """The points, (3, n)."""
        return np.ascontiguousarray(self.points.T)

    @cached_property
    def rows_to_camera(self) -> Array:
        """From each point to where it was seen from, (3, n), metres."""
        return np.ascontiguousarray(self.to_camera.T)

    @staticmethod
    def of_frame(points: Array, frame: PointCloudFrame) -> SurfacePoints:
        """Return points (n, 3) that a camera has measured: a tenth of a point's weight each, since neighbours err alike."""
        return SurfacePoints(points, frame.position, _INDEPENDENT / max(frame.noise, TOLERANCES.least_depth))

    @staticmethod
    def stack(parts: Sequence[SurfacePoints]) -> SurfacePoints:
        """Return all points as one surface."""
        return SurfacePoints(
            np.concatenate([part.points for part in parts]),
            np.concatenate([np.broadcast_to(part.camera, part.points.shape) for part in parts]),
            np.concatenate([part.weights for part in parts]),
        )


NO_SURFACE = SurfacePoints(np.zeros((0, 3)), np.zeros(3), np.zeros(0))
"""No point: a camera without depth measures none of a surface."""


@dataclass(frozen=True, eq=False)
class ShapeEvidence:
    """All that was measured of one thing.

    Attributes:
        rows: Tangent planes of all views.
        surface: Surface points of all views; none where nothing measures depth.
    """

    rows: Rows
    surface: SurfacePoints

    @property
    def count(self) -> int:
        """Number of measurements."""
        return len(self.rows.values) + len(self.surface.points)

    def turned(self, rotation: Array) -> ShapeEvidence:
        """Return the same in a frame whose axes are the columns of a rotation (3, 3)."""
        rows, surface = self.rows, self.surface
        return ShapeEvidence(
            Rows(rows.normals @ rotation, rows.values, rows.weights),
            SurfacePoints(surface.points @ rotation, surface.camera @ rotation, surface.weight),
        )

    @cached_property
    def tops(self) -> tuple[float, float]:
        """Heights of its highest points without outliers, and with fewer of them left out, metres."""
        heights = self.surface.points[:, 2]
        first, second = int(0.92 * (len(heights) - 1)), int(np.ceil(0.98 * (len(heights) - 1)))
        ordered = np.partition(heights, (first, second))
        return float(ordered[first]), float(ordered[second])

    @cached_property
    def rough(self) -> Rows:
        """Tangents, and how far the points reach to eight sides: they say where the shape is, even without a tangent."""
        place = round(0.96 * (len(self.surface.points) - 1))
        values = np.partition(self.surface.points @ _COMPASS.T, place, axis=0)[place]
        return Rows.stack([self.rows, Rows(_COMPASS, values, np.full(len(_COMPASS), 1.0 / _ROUGH))])

    def ended(self, rough: bool, resting: float | None) -> Rows:
        """Return the tangents, or `rough`, with what is known of the heights at which the thing ends.

        Args:
            rough: Which.
            resting: Height of what it stands on, metres; None for something in the air.
        """
        if (rough, resting) not in self._ended:
            if not len(self.surface.points):
                foot = [] if resting is None else [Rows(-_UP[None], np.array([-resting]), np.array([1.0 / _STANDS]))]
                self._ended[rough, resting] = Rows.stack([self.rows, *foot])
                return self._ended[rough, resting]
            # A covered top shows no surface, but the sides end there.
            rows, top, sigma = (self.rough, self.tops[0], 0.004) if rough else (self.rows, self.tops[1], 0.005)
            self._ended[rough, resting] = Rows.stack([rows, _levels(top, sigma, resting)])
        return self._ended[rough, resting]

    @cached_property
    def _ended(self) -> dict[tuple[bool, float | None], Rows]:
        return {}


def _levels(top: float, sigma: float, resting: float | None) -> Rows:
    """Return what is known of the heights at which a thing ends."""
    if resting is None:
        return Rows(_UP[None], np.array([top]), np.array([1.0 / sigma]))
    return Rows(np.vstack([_UP, -_UP]), np.array([top, -resting]), np.array([1.0 / sigma, 1.0 / _STANDS]))
