"""Openings of the parts of a scene by depth: the value of each joint at which the cameras would see what they see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robosandbox.motion.scene_depths import SceneDepths
from robosandbox.perception.frame import Image
from robosandbox.perception.frames import SegmentedFrame
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.types import Array

# Values of a joint that are tried along its whole way.
_TRIED = 25
# Times that values around the best are tried, and by how much closer each time: of a way of 0.4 m the last ones are 0.3 mm apart.
_CLOSER, _FINER = 3, 4
# Pixels of a camera at which a part's way is looked, at most, and the fewest of all at which its values differ, and by which another value
# must explain more than the one believed, things that stand before it counted as they cost.
_PIXELS, _LEAST = 2500, 12
# Metres up to which a depth may be off and count by how much; what a coarse step of a large door is off by.
_CAP = 0.012
# Cost of a pixel that shows something nearer than it should, which may stand before it; seen through costs 1.
_BEFORE = 0.4
# Metres by which a pixel's depth changes along a part's way at the least, to tell of it.
_TELLS = 0.004


@dataclass(frozen=True, slots=True)
class _Pixels:
    """Pixels of a view in which a part's way lies.

    Attributes:
        view: Which.
        rows: Shape (n,).
        columns: Shape (n,).
        depth: As measured there, metres, shape (n,).
        rays: Of depth 1, world, shape (n, 3).
    """

    view: SegmentedFrame
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    depth: Image
    rays: Array


class PartValues:
    """Measures the joint of one part.

    Args:
        depths: The scene; its positions are changed while values are tried, and left at the one found.
        body: The part's body.
    """

    def __init__(self, depths: SceneDepths, body: int) -> None:
        self._depths = depths
        self._joint = depths.joint(body)
        self.low, self.high = self._joint.low, self._joint.high

    @property
    def value(self) -> float:
        """The joint's value as it is believed, metres or radians."""
        return float(self._depths.data.qpos[self._joint.address])

    @property
    def turns(self) -> bool:
        """True for a hinge."""
        return self._joint.is_hinge

    @property
    def address(self) -> int:
        """Its index in the model's positions."""
        return self._joint.address

    def put(self, value: float) -> None:
        """Take the joint to have a value, metres or radians."""
        self._depths.data.qpos[self._joint.address] = value
        self._depths.place()

    def lever(self) -> float:
        """Return how far its outermost point goes, metres, for each unit of the joint's value."""
        if not self._joint.is_hinge:
            return 1.0
        points = self._depths.corners(self._joint.moved) - self._depths.data.xanchor[self._joint.number]
        axis = self._depths.data.xaxis[self._joint.number]
        across = points - np.outer(points @ axis, axis)
        return float(np.linalg.norm(across, axis=1).max(initial=1e-3))

    def measure(self, views: Sequence[SegmentedFrame], likely: Sequence[float] = ()) -> bool:
        """Put the joint where the cameras show it; return whether they tell.

        Args:
            views: What they show.
            likely: Values that it may have besides the one believed, as by the hand that leads it.
        """
        believed = self.value
        tried = np.linspace(self.low, self.high, _TRIED)
        pixels = self._pixels(views, tried)
        if not pixels:
            self.put(believed)
            return False
        cast = np.array([self._seen(pixels, value) for value in tried])
        telling = np.nan_to_num(np.ptp(np.minimum(cast, 10.0), axis=0)) > _TELLS
        if np.count_nonzero(telling) < _LEAST:
            self.put(believed)
            return False
        measured = np.concatenate([one.depth for one in pixels])[telling]
        pixels = _only(pixels, telling)
        costs = _cost(measured, cast[:, telling])
        best, least = float(tried[costs.argmin()]), float(costs.min())
        now = [believed, *likely]
        those = [float(_cost(measured, self._seen(pixels, value)[None])[0]) for value in now]
        if min(those) < least + _BEFORE * _LEAST / len(measured):
            best, least = now[int(np.argmin(those))], min(those)
        step = (self.high - self.low) / (_TRIED - 1)
        for _ in range(_CLOSER):
            near = np.clip(best + step * np.linspace(-1.0, 1.0, 2 * _FINER + 1), self.low, self.high)
            costs = _cost(measured, np.array([self._seen(pixels, value) for value in near]))
            if costs.min() < least:
                best, least = float(near[costs.argmin()]), float(costs.min())
            step /= _FINER
        self.put(self._settled(best))
        return True

    def _settled(self, value: float) -> float:
        """Return a value, at a stop the stop's: what is as near as a look tells rests there."""
        lever = self.lever()
        for stop in (self.low, self.high):
            if abs(value - stop) * lever < TOLERANCES.position:
                return stop
        return value

    def _pixels(self, views: Sequence[SegmentedFrame], tried: Array) -> list[_Pixels]:
        """Return the pixels in which the part is at any of its values."""
        way = []
        for value in tried[::4]:
            self.put(float(value))
            way.append(self._depths.corners(self._joint.moved))
        points = np.concatenate(way)
        found = []
        for view in views:
            where, depth = view.frame.project(points)
            if (depth < 0.05).any():
                where = where[depth > 0.05]
            if not len(where):
                continue
            height, width = view.frame.depth.shape
            left, top = np.clip(where.min(axis=0), 0, [width, height]).astype(int)
            right, bottom = np.clip(where.max(axis=0) + 1, 0, [width, height]).astype(int)
            if right - left < 2 or bottom - top < 2:
                continue
            stride = max(1, int(np.ceil(np.sqrt((right - left) * (bottom - top) / _PIXELS))))
            rows, columns = (one.ravel() for one in np.mgrid[top:bottom:stride, left:right:stride])
            clear = view.frame.valid[rows, columns] & ~view.robot[rows, columns]
            rows, columns = rows[clear], columns[clear]
            if len(rows):
                found.append(
                    _Pixels(view, rows, columns, view.frame.depth[rows, columns], view.frame.rays(rows, columns))
                )
        return found

    def _seen(self, pixels: Sequence[_Pixels], value: float) -> Image:
        """Return the depths in pixels at a value of the joint."""
        self.put(value)
        return np.concatenate([self._depths.cast(one.view.frame.position, one.rays) for one in pixels])


def _only(pixels: Sequence[_Pixels], wanted: NDArray[np.bool_]) -> list[_Pixels]:
    found, begin = [], 0
    for one in pixels:
        own = wanted[begin : begin + len(one.rows)]
        begin += len(own)
        if own.any():
            found.append(_Pixels(one.view, one.rows[own], one.columns[own], one.depth[own], one.rays[own]))
    return found


def _cost(measured: Image, cast: Image) -> Array:
    """Return the mean cost of each of several casts (k, n) of what is measured (n,), 0..1."""
    off = measured[None] - np.minimum(cast, 10.0)
    costs = np.minimum((off / _CAP) ** 2, np.where(off > 0.0, 1.0, _BEFORE))
    return np.asarray(costs.mean(axis=1), dtype=float)
