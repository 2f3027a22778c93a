"""Level surfaces and the hollow of a solid of convex pieces, found on a grid of columns seen from above."""

from __future__ import annotations

import heapq
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robosandbox.shapes.room import Room
from robosandbox.spatial import Array, frozen_array
from robosandbox.values import frozen

# Columns of the grid along the longer side, a number, and the least width of one, metres: what a wall of 4 mm needs in a thing of
# 0.2 m, and what a table of 1 m can do with.
_COLUMNS = 96
_LEAST_CELL = 0.0015
# Cosine of a face's tilt up to which things stay on it, and metres within which two faces are one.
LEVEL = 0.995
_SAME_HEIGHT = 0.002
# Metres over a surface that have to be free for it to be one on which things stand.
_HEADROOM = 0.03
# Narrowest surface that something is put on, and hollow that something is put into, metres: a hole for a peg.
LEAST_WIDTH, _LEAST_HOLLOW = 0.02, 0.01
# Least depth of a hollow, metres: a rim on a flat plate is less than what a depth camera resolves.
_LEAST_DEPTH = 0.006
# Share of what is covered that has to be free to one side for that side to be open.
_OPEN = 0.7
# Shares of the outline that a circle or rectangle has to fill to stand for it.
_FILLS = 0.82


@frozen(eq=False)
class LevelSurface:
    """A level face on which things can stand, in the frame of the solid.

    Attributes:
        height: Metres.
        headroom: Free height over it, metres; infinite under the open sky.
        points: Middles of its cells, shape (n, 2), metres.
        inside: How far each lies from the edge, shape (n,), metres.
        cell: Width of a cell, metres.
        ways_out: Level unit vectors, shape (k, 2), in which nothing of the solid stands between what is covered and the outside;
            none under the open sky.
    """

    height: float
    headroom: float
    points: Array
    inside: Array
    cell: float
    ways_out: Array

    @property
    def area(self) -> float:
        """Square metres."""
        return len(self.points) * self.cell**2

    @property
    def middle(self) -> Array:
        """The point farthest from its edge, nearest to its centroid where several are, shape (2,)."""
        best = np.flatnonzero(self.inside > self.inside.max() - self.cell)
        away = np.linalg.norm(self.points[best] - self.points.mean(axis=0), axis=1)
        middle: Array = self.points[best[int(away.argmin())]]
        return middle

    @property
    def half_width(self) -> float:
        """Radius of the largest circle in it, metres."""
        return float(self.inside.max())

    def margin(self, point: Array) -> float:
        """Return how far inside a point (2,) lies, metres; negative outside."""
        distances = np.linalg.norm(self.points - point, axis=1)
        nearest = int(distances.argmin())
        off = float(distances[nearest])
        return float(self.inside[nearest]) if off <= self.cell else -off


@frozen
class ConvexPiece:
    """A convex piece as inequalities: `normals @ x <= offsets`.

    Attributes:
        points: Its corners, shape (k, 3), metres.
        normals: Outward unit normals, shape (f, 3).
        offsets: Metres, shape (f,).
    """

    points: Array
    normals: Array
    offsets: Array

    @classmethod
    def of(cls, points: Array) -> ConvexPiece:
        """Return the convex hull of points (k, 3)."""
        from scipy.spatial import ConvexHull

        hull = ConvexHull(points, qhull_options="Qt QJ" if np.ptp(points, axis=0).min() < 1e-9 else None)
        return cls(points, hull.equations[:, :3], -hull.equations[:, 3])

    def column(self, xy: Array) -> tuple[Array, Array]:
        """Return the lowest and highest point over each point (n, 2), metres (n,), (n,); no number beside the piece."""
        nz = self.normals[:, 2]
        level = self.offsets[:, None] - self.normals[:, :2] @ xy.T
        upper, lower, sides = nz > 1e-6, nz < -1e-6, np.abs(nz) <= 1e-6
        high = (level[upper] / nz[upper, None]).min(axis=0)
        low = (level[lower] / nz[lower, None]).max(axis=0)
        out = (high < low) | (level[sides] < 0.0).any(axis=0)
        return np.where(out, np.nan, low), np.where(out, np.nan, high)


class HeightGrid:
    """Columns of a solid seen from above.

    Args:
        pieces: What it is made of.

    Attributes:
        pieces: Likewise.
    """

    def __init__(self, pieces: list[ConvexPiece]) -> None:
        points = np.vstack([piece.points for piece in pieces])
        low, high = points.min(axis=0)[:2], points.max(axis=0)[:2]
        self.cell: float = max(float((high - low).max()) / _COLUMNS, _LEAST_CELL)
        # Two columns of nothing all around.
        self._shape: tuple[int, int] = tuple(int(np.ceil(s / self.cell)) + 4 for s in high - low)  # type: ignore[assignment]
        origin = (low + high) / 2.0 - (np.array(self._shape) - 1) / 2.0 * self.cell
        grid = np.stack(np.meshgrid(*map(np.arange, self._shape), indexing="ij"), axis=-1)
        self.points: Array = origin + grid * self.cell
        flat = self.points.reshape(-1, 2)
        spans = [piece.column(flat) for piece in pieces]
        self._low: Array = np.array([low for low, _ in spans])
        self._high: Array = np.array([high for _, high in spans])
        self.pieces: list[ConvexPiece] = pieces

    @cached_property
    def underside(self) -> tuple[Array, Array]:
        """Middles of the columns, shape (n, 2), and the lowest point over each, shape (n,), metres."""
        heights = np.fmin.reduce(self._low, axis=0)
        there = np.isfinite(heights)
        return frozen_array(self.points.reshape(-1, 2)[there]), frozen_array(heights[there])

    @cached_property
    def _upside(self) -> Array:
        """The highest point over each column, metres, in the shape of the grid; no number beside it."""
        return np.asarray(np.fmax.reduce(self._high, axis=0).reshape(self._shape))

    def highest_in(self, outline: Array) -> float:
        """Return the highest point within the convex outline of points (k, 2), metres; below all of it where there is nothing."""
        from scipy.spatial import ConvexHull

        sides = ConvexHull(outline).equations
        low, high = outline.min(axis=0), outline.max(axis=0)
        first, last = np.clip(
            ((np.array([low, high]) - self.points[0, 0]) / self.cell).round().astype(int), 0, np.array(self._shape) - 1
        )
        part = np.s_[first[0] : last[0] + 1, first[1] : last[1] + 1]
        within = (self.points[part] @ sides[:, :2].T + sides[:, 2] <= 0.0).all(axis=-1)
        return float(np.fmax.reduce(self._upside[part][within], initial=-np.inf))

    def rest(self, points: Array, heights: Array) -> float:
        """Return how high something comes to rest on it that is let down, metres; below all of it where it falls past.

        Args:
            points: Middles of columns of what is let down, shape (n, 2), metres, where it is.
            heights: Of its underside over each, shape (n,), metres.
        """
        high = self._upside
        cells = np.rint((points - self.points[0, 0]) / self.cell).astype(int)
        over = ((cells >= 0) & (cells < self._shape)).all(axis=1)
        met = high[cells[over, 0], cells[over, 1]] - heights[over]
        return float(np.fmax.reduce(met, initial=-np.inf))

    def surfaces(self) -> tuple[LevelSurface, ...]:
        """Return the level faces wide enough to stand on, the highest first."""
        heights = [
            float(piece.offsets[k] / piece.normals[k, 2])
            for piece in self.pieces
            for k in np.flatnonzero(piece.normals[:, 2] > LEVEL)
        ]
        found: list[LevelSurface] = []
        done: list[float] = []
        with np.errstate(invalid="ignore"):
            for height in sorted(heights, reverse=True):
                if any(abs(height - other) < _SAME_HEIGHT for other in done):
                    continue
                done.append(height)
                here = (np.abs(self._high - height) < _SAME_HEIGHT).any(axis=0)
                above = np.where(self._high > height + _SAME_HEIGHT, self._low, np.inf).min(axis=0, initial=np.inf)
                above = np.where(np.isnan(above), np.inf, above)
                free = (here & (above - height > _HEADROOM)).reshape(self._shape)
                # Seams between pieces are no edges.
                marked, count = _islands(_closed(free), np.ones((3, 3)))
                room = above.reshape(self._shape) - height
                for number in range(1, count + 1):
                    mask = marked == number
                    inside = _depths(mask) * self.cell - self.cell / 2.0
                    if inside.max() < LEAST_WIDTH / 2.0:
                        continue
                    headroom = float(np.median(room[mask & free])) if (mask & free).any() else np.inf
                    found.append(
                        LevelSurface(
                            height,
                            headroom,
                            frozen_array(self.points[mask]),
                            frozen_array(inside[mask]),
                            self.cell,
                            self._ways_out(mask, height, headroom),
                        )
                    )
        return tuple(found)

    def _ways_out(self, mask: NDArray[np.bool_], height: float, headroom: float) -> Array:
        """Return in which directions along the grid most of what is covered is open to the side, shape (k, 2)."""
        if not np.isfinite(headroom):
            return frozen_array(np.zeros((0, 2)))
        low, high = height + _SAME_HEIGHT, height + headroom - _SAME_HEIGHT
        stands = ((self._high > low) & (self._low < high)).any(axis=0).reshape(self._shape)
        found = []
        for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1)):
            walls = np.flip(stands, axis) if sign > 0 else stands
            beyond = np.logical_or.accumulate(walls, axis=axis)
            beyond = np.flip(beyond, axis) if sign > 0 else beyond
            if (~beyond)[mask].mean() >= _OPEN:
                found.append((sign, 0) if axis == 0 else (0, sign))
        return frozen_array(np.array(found, dtype=float).reshape(-1, 2))

    def hollows(self) -> tuple[Room, ...]:
        """Return the hollows that are open to above, the largest first; none where water would run off everywhere."""
        from scipy.ndimage import grey_closing

        with np.errstate(invalid="ignore"):
            top = np.nanmax(np.where(np.isnan(self._high), -np.inf, self._high), axis=0).reshape(self._shape)
        ground = np.isfinite(top)
        bottom = float(top[ground].min()) if ground.any() else 0.0
        top = np.where(ground, top, bottom - 1.0)
        # Nothing falls through gaps between the boards of a floor that are narrower than what it would stand on.
        window = 2 * round(LEAST_WIDTH / self.cell / 2.0) + 1
        closed = grey_closing(top, size=(window, window))
        gap = ~ground & (closed > bottom - 0.5)
        top, ground = np.where(gap, closed, top), ground | gap
        level = _filled(grey_closing(top, size=(3, 3)))
        basin, count = _islands((level - top > _LEAST_DEPTH) & ground)
        found: list[Room] = []
        for number in range(1, count + 1):
            mask = basin == number
            inside = _depths(mask) * self.cell - self.cell / 2.0
            if inside.max() < _LEAST_HOLLOW / 2.0:
                continue
            found.append(self._room(mask, inside, top, float(np.median(level[mask]))))
        return tuple(sorted(found, key=lambda room: -float(room.half.prod()) * (room.rim - room.floor)))

    def bores(self) -> tuple[Room, ...]:
        """Return the holes through which one sees from above, the largest first; floor and rim are the solid's bottom and top."""
        empty: NDArray[np.bool_] = np.asarray(~np.isfinite(self._high).any(axis=0)).reshape(self._shape)
        marked, count = _islands(empty)
        low, high = float(np.nanmin(self._low)), float(np.nanmax(self._high))
        found: list[Room] = []
        for number in range(1, count + 1):
            mask = marked == number
            inside = _depths(mask) * self.cell - self.cell / 2.0
            # What reaches the border is the outside.
            if mask[0, 0] or inside.max() < _LEAST_HOLLOW / 2.0:
                continue
            found.append(replace(self._room(mask, inside, np.full(self._shape, low), high), floor=low, rim=high))
        return tuple(sorted(found, key=lambda room: -float(room.half.prod())))

    def _room(self, mask: NDArray[np.bool_], inside: Array, top: Array, rim: float) -> Room:
        """Return a hollow as a round or square room."""
        xy = self.points[mask]
        low, high = xy.min(axis=0) - self.cell / 2.0, xy.max(axis=0) + self.cell / 2.0
        radius = float(inside.max())
        core = np.flatnonzero(inside[mask] > radius - self.cell)
        centre = xy[core].mean(axis=0)
        floor = float(np.median(top[mask & (inside > radius / 2.0)]))
        area = len(xy) * self.cell**2
        half = (high - low) / 2.0
        if area < _FILLS * 4.0 * half.prod() or (half.min() > 0.9 * half.max() and area < 0.9 * 4.0 * half.prod()):
            return Room(middle=centre, half=np.full(2, radius), floor=floor, rim=rim, is_round=True)
        return Room(middle=(low + high) / 2.0, half=half, floor=floor, rim=rim)


def _closed(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    from scipy.ndimage import binary_closing

    closed = np.asarray(binary_closing(mask, np.ones((3, 3))), dtype=np.bool_)
    return np.logical_or(closed, mask)


def _islands(mask: NDArray[np.bool_], neighbours: Array | None = None) -> tuple[NDArray[np.int_], int]:
    """Return the number of the connected region of each cell, 0 outside, and how many regions there are."""
    from scipy.ndimage import label

    found: Any = label(mask, neighbours)
    marked: NDArray[np.int_] = np.asarray(found[0], dtype=np.int_)
    return marked, int(found[1])


def _depths(mask: NDArray[np.bool_]) -> Array:
    """Return how many cells each cell is from the nearest outside."""
    from scipy.ndimage import distance_transform_edt

    found: Any = distance_transform_edt(mask)
    return np.asarray(found, dtype=np.float64)


def _filled(heights: Array) -> Array:
    """Return up to which height water stands on each cell, shape as given.

    Priority flood (Barnes, Lehman and Mulla, 2014, algorithm 2): cells are reached from the border inwards, the lowest first; what
    lies no higher than the cell it is reached from waits in no queue.
    """
    columns = heights.shape[1]
    border = np.ones(heights.shape, dtype=bool)
    border[1:-1, 1:-1] = False
    level: list[float] = heights.ravel().tolist()
    queue = [(level[cell], cell) for cell in np.flatnonzero(border).tolist()]
    # Cells are numbered row by row; a row more stands for what is beyond the last, and what is beyond the other sides is border.
    reached = bytearray(border.tobytes()) + bytearray(b"\x01" * columns)
    heapq.heapify(queue)
    while queue:
        height, cell = heapq.heappop(queue)
        flooded = [cell]
        for cell in flooded:
            for near in (cell - columns, cell + columns, cell - 1, cell + 1):
                if reached[near]:
                    continue
                reached[near] = 1
                if level[near] > height:
                    heapq.heappush(queue, (level[near], near))
                else:
                    level[near] = height
                    flooded.append(near)
    return np.array(level).reshape(heights.shape)
