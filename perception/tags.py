"""AprilTags on things (Olson, 2011; family 36h11) that face up: found and read in each view as if seen from straight above.

A tag on a small thing has little more than a pixel for each cell, too little for a decoder that takes each cell for black
or white. Here each cell keeps its grey, and the number is the one whose pattern correlates with them best.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.perception.frame import Image, Mask, PointCloudFrame, TablePrior, as_picture
from robosandbox.perception.quantiles import median
from robosandbox.perception.thing import Thing
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.tags import TAG_CELLS, TAG_COUNT, TAG_FAMILY
from robosandbox.types import Array
from robosandbox.values import frozen

_LEAST_HEIGHT = 0.008  # Height over the table, metres, from which a tag's face is looked for. Chosen.
_LEAST_PIXELS = 40  # Number of pixels of a face in which a tag may be read. Chosen.
_ROOM = 3  # Pixels around a face that are looked at as well. Chosen.
_PIXELS_PER_CELL = 5.0  # Pixels of the straightened face for each cell of a tag. Chosen.
_MOST_PIXELS = 900  # Pixels a side of a straightened face at the most. Chosen so that reading stays fast.
_TOPS = 90.0  # Percentile of heights in a piece that is its top, percent: what is above may be noise. Chosen.
# Shares of the way from dark to light at which squares are looked for: blurred, they part from what is beside them at some.
# Chosen.
_LEVELS = (0.45, 0.35, 0.55, 0.25, 0.65)
_EXTREMES = (2.0, 98.0)  # Percentiles of brightness that are black and white, percent. Chosen.
_SAME_SIZE = 0.22  # Ratio by which a border's sides may differ from a described tag's, less 1. Chosen.
_LEVEL_WITHIN = 2.0 * TOLERANCES.depth  # Metres by which a face's points may be off its height, at their median.
# Levels of 255 between black and white at the least. Chosen: ten times the colour noise of `realsense`.
_LEAST_CONTRAST = 25.0
_ON_IT = 4.0 * TOLERANCES.depth  # Metres from a face's plane within which a tag lies on it.
_FRAME_CONTRAST = 0.4  # Share of the contrast that a tag's white frame has over its black border. Chosen.
# Shifts of the grid in cells, as fractions, that are tried. Chosen: corners are found to a part of a cell.
_SHIFTS = (0.0, -0.4, 0.4)
_SCALES = (1.0, 0.94, 1.06)  # Factors of the grid's size that are tried. Chosen likewise.
_SURE = 0.75  # Share of a tag's cells, weighted by contrast, that must agree. Chosen.
_SURER_THAN_NEXT = 0.1  # Share by which the best number must agree better than the next. Chosen.
# Standard deviation of the blur of a pixel as wide as a cell, in cells.
_BLUR = 0.35


@frozen(eq=False)
class Tag:
    """A tag that a view shows.

    Attributes:
        number: In its family; None where it is too blurred to tell.
        corners: Of its black square in the world, (4, 3), metres, all at one height, clockwise from its upper left.
        camera: Which showed it.
        pixels: Its shortest edge in that camera's picture.
    """

    number: int | None
    corners: Array
    camera: str
    pixels: float

    @property
    def centre(self) -> Array:
        """Its middle in the world, (3,), metres."""
        return np.asarray(self.corners.mean(axis=0))

    @property
    def edge(self) -> float:
        """Its edge, metres."""
        return float(np.linalg.norm(self.corners[1] - self.corners[0]))

    def scaled(self, factor: float) -> Array:
        """Return the corners (4, 3) of a square so many times as wide around the same middle, metres."""
        return np.asarray(self.centre + factor * (self.corners - self.centre))


def find_tags(frame: PointCloudFrame, table: TablePrior, robot: Mask, sizes: Iterable[float]) -> list[Tag]:
    """Return the tags that a view shows on what stands on the table.

    Args:
        frame: The picture.
        table: Over which they are.
        robot: Where the robot covers the picture.
        sizes: Edges that tags may have, metres.
    """
    edges = _distinct(sizes)
    found: list[Tag] = []
    for box, height in _raised(frame, table, robot):
        above = _FromAbove(frame, box, height, edges[0])
        for edge in edges:
            for number, pixels in above.squares(edge):
                tag = _placed(number, pixels, frame)
                if tag is not None:
                    found.append(tag)
    return found


def merged(tags: Iterable[Tag]) -> list[Tag]:
    """Return one tag for each number and place, the one seen largest; where one was read the others there are left out."""
    best: list[Tag] = []
    for tag in sorted(tags, key=lambda each: (each.number is None, -each.pixels)):
        if not any(
            (tag.number is not None and tag.number == other.number)
            or float(np.linalg.norm(tag.centre - other.centre)) < 0.5 * other.edge
            for other in best
        ):
            best.append(tag)
    return best


def labelled(things: Iterable[Thing], tags: Iterable[Tag]) -> list[Thing]:
    """Return the things, each with the number of the tag that was read on it."""
    found = list(things)
    for tag in tags:
        off = [float(thing.fit.distances(tag.centre[None])[0]) for thing in found]
        if tag.number is not None and off and abs(min(off, key=abs)) < _ON_IT:
            place = min(range(len(off)), key=lambda index: abs(off[index]))
            found[place] = replace(found[place], tag=tag.number)
    return found


def _distinct(sizes: Iterable[float]) -> list[float]:
    """Return the sizes without those that a smaller one stands in for."""
    kept: list[float] = []
    for size in sorted(sizes):
        if not kept or size > (1.0 + 0.5 * _SAME_SIZE) * kept[-1]:
            kept.append(size)
    return kept


def _raised(
    frame: PointCloudFrame, table: TablePrior, robot: Mask
) -> Iterator[tuple[tuple[int, int, int, int], float]]:
    """Yield the parts of a picture, left, top, right, bottom, that show something on the table, and how high it is."""
    height: Image = frame.xyz[2]
    (x0, x1), (y0, y1) = table.area
    over = cv2.inRange(height, table.height + max(_LEAST_HEIGHT, 3.0 * frame.noise), 1e3)
    over &= cv2.inRange(frame.xyz[0], x0, x1)
    over &= cv2.inRange(frame.xyz[1], y0, y1)
    free: Mask = (over > 0) & frame.valid & ~robot
    wide = cv2.dilate(free.view(np.uint8), np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(wide, connectivity=8)
    rows, columns = free.shape
    for part in range(1, count):
        x, y, w, h, area = (int(value) for value in stats[part])
        own = free[y : y + h, x : x + w] & (labels[y : y + h, x : x + w] == part)
        if area < _LEAST_PIXELS or not own.any():
            continue
        top = float(np.percentile(height[y : y + h, x : x + w][own], _TOPS))
        yield (max(x - _ROOM, 0), max(y - _ROOM, 0), min(x + w + _ROOM, columns), min(y + h + _ROOM, rows)), top


class _FromAbove:
    """A part of a picture drawn as it would be seen from straight above, true to scale at one height.

    Args:
        frame: The picture.
        box: Left, top, right, bottom, pixels.
        height: In the world, metres.
        edge: Of the smallest tag, metres.
    """

    def __init__(self, frame: PointCloudFrame, box: tuple[int, int, int, int], height: float, edge: float) -> None:
        left, top, right, bottom = box
        offset = np.array([0.0, 0.0, height]) - frame.position
        plan_to_pixel = frame.matrix @ frame.rotation.T @ np.column_stack([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], offset])
        ends = np.array([[left, top], [right, top], [right, bottom], [left, bottom]], dtype=float)
        plan = _through(np.asarray(np.linalg.inv(plan_to_pixel), dtype=np.float64), ends)
        low, high = plan.min(axis=0), plan.max(axis=0)
        self._step = max(edge / TAG_CELLS / _PIXELS_PER_CELL, float((high - low).max()) / _MOST_PIXELS)
        # The straightened face is seen from above, x up: its right is -y.
        self._to_pixel = plan_to_pixel @ np.array(
            [[0.0, -self._step, high[0]], [-self._step, 0.0, high[1]], [0.0, 0.0, 1.0]]
        )
        size = int((high[1] - low[1]) / self._step) + 1, int((high[0] - low[0]) / self._step) + 1
        corner = np.array([[1.0, 0.0, left], [0.0, 1.0, top], [0.0, 0.0, 1.0]])
        grey = cv2.cvtColor(np.ascontiguousarray(frame.rgb[top:bottom, left:right]), cv2.COLOR_RGB2GRAY)
        self._drawn = as_picture(
            cv2.warpPerspective(
                grey,
                np.linalg.inv(corner) @ self._to_pixel,
                size,
                flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP,
                borderMode=cv2.BORDER_REPLICATE,
            )
        )

    def squares(self, edge: float) -> Iterator[tuple[int | None, Array]]:
        """Yield the number and the corner pixels (4, 2) in the picture of each tag with this edge, metres."""
        wide = edge / self._step
        read: list[Array] = []
        unread: list[Array] = []
        for square in self._dark_squares(wide):
            if _is_among(square, read, wide):
                continue
            number, corners = _read(self._drawn, square)
            if number is not None:
                read.append(square)
                yield number, _through(self._to_pixel, corners)
            elif _is_framed(self._drawn, square) and not _is_among(square, unread, wide):
                unread.append(square)
        for square in unread:
            if not _is_among(square, read, wide):
                yield None, _through(self._to_pixel, square)

    def _dark_squares(self, wide: float) -> list[Array]:
        """Return the corners (4, 2), clockwise, of dark squares about so many pixels wide; each but once."""
        low, high = np.percentile(self._drawn, _EXTREMES)
        found: list[Array] = []
        if high - low < _LEAST_CONTRAST:
            return found
        for level in _LEVELS:
            dark = (self._drawn < low + level * (high - low)).view(np.uint8)
            outlines, _ = cv2.findContours(dark, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
            for outline in outlines:
                if len(outline) < 2.4 * wide:
                    continue
                centre, size, angle = cv2.minAreaRect(outline.reshape(-1, 2).astype(np.float32))
                if max(abs(side + 0.5 - wide) for side in size) > _SAME_SIZE * wide:
                    continue
                square = _square(np.array(centre), wide / 2.0, np.radians(angle))
                if not any(_is_same(square, other, wide) for other in found):
                    found.append(square)
        return found


def _square(centre: Array, half: float, angle: float) -> Array:
    right = half * np.array([np.cos(angle), np.sin(angle)])
    down = np.array([-right[1], right[0]])
    return np.array([centre - right - down, centre + right - down, centre + right + down, centre - right + down])


def _is_among(square: Array, others: Iterable[Array], wide: float) -> bool:
    middle = square.mean(axis=0)
    return any(float(np.linalg.norm(middle - other.mean(axis=0))) < 0.5 * wide for other in others)


def _is_same(square: Array, other: Array, wide: float) -> bool:
    """Tell whether two squares cover the same within a third of a cell, whichever corner they begin with."""
    apart = min(float(np.abs(square - np.roll(other, turn, axis=0)).max()) for turn in range(4))
    return apart < wide / TAG_CELLS / 3.0


def _read(drawn: NDArray[np.uint8], square: Array) -> tuple[int | None, Array]:
    """Return the number of the tag in a square (4, 2) of a picture, None for none, and its corners from its upper left."""
    seen = _sampled(drawn, square, _inner_places())
    seen -= seen.mean(axis=1, keepdims=True)
    spread = np.linalg.norm(seen, axis=1, keepdims=True)
    alike = (seen / np.maximum(spread, 1e-6)) @ _patterns().T
    by_turn = alike.max(axis=0).reshape(TAG_COUNT, 4)
    best = by_turn.max(axis=1)
    number = int(best.argmax())
    next_best = float(np.partition(best, -2)[-2])
    contrast = float(spread.max()) / np.sqrt(seen.shape[1])
    if best[number] < _SURE or best[number] - next_best < _SURER_THAN_NEXT or 2.0 * contrast < _LEAST_CONTRAST:
        return None, square
    return number, np.roll(square, int(by_turn[number].argmax()), axis=0)


def _is_framed(drawn: NDArray[np.uint8], square: Array) -> bool:
    """Tell whether a square is dark along its edge and light around that, as tags are."""
    frame, border = (
        _sampled(drawn, square, _ring(reach)).mean() for reach in (TAG_CELLS / 2 - 0.5, TAG_CELLS / 2 + 0.5)
    )
    low, high = np.percentile(drawn, _EXTREMES)
    return bool(border - frame > max(_FRAME_CONTRAST * (high - low), _LEAST_CONTRAST))


def _sampled(drawn: NDArray[np.uint8], square: Array, places: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the greys (k, n) at places (k, n, 2) in cells from a square's middle."""
    middle = square.mean(axis=0)
    axes = np.array([square[1] - square[0], square[3] - square[0]]) / TAG_CELLS
    at = (places.astype(np.float64) @ axes + middle).astype(np.float32)
    return np.asarray(
        cv2.remap(drawn, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), dtype=np.float32
    )


@lru_cache(maxsize=1)
def _inner_places() -> NDArray[np.float32]:
    """Return where the inner cells' middles are (k, 36, 2), shifted and scaled in k ways, cells from the tag's middle."""
    middles = np.arange(1, TAG_CELLS - 1) + 0.5 - TAG_CELLS / 2
    grid = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
    ways = [scale * grid + [x, y] for scale in _SCALES for x in _SHIFTS for y in _SHIFTS]
    return np.array(ways, dtype=np.float32)


@lru_cache(maxsize=4)
def _ring(reach: float) -> NDArray[np.float32]:
    """Return places (1, n, 2) all along the edge of a square that reaches so many cells from the tag's middle."""
    along = np.linspace(-reach, reach, 2 * TAG_CELLS)
    ends = np.full(len(along), reach)
    sides = [(along, -ends), (along, ends), (-ends, along), (ends, along)]
    return np.concatenate([np.column_stack(side) for side in sides])[None].astype(np.float32)


@lru_cache(maxsize=1)
def _patterns() -> NDArray[np.float32]:
    """Return what the inner cells of each tag look like in each of four turns, (4 n, 36), mean 0 and length 1."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, TAG_FAMILY))
    fine = 5
    found = []
    for number in range(TAG_COUNT):
        cells = np.pad(cv2.aruco.generateImageMarker(dictionary, number, TAG_CELLS), 1, constant_values=255)
        large = np.kron(cells, np.ones((fine, fine))).astype(np.float32)
        inner = cv2.GaussianBlur(large, (0, 0), _BLUR * fine)[fine // 2 :: fine, fine // 2 :: fine][2:-2, 2:-2]
        found += [np.rot90(inner, turn).reshape(-1) for turn in range(4)]
    patterns = np.array(found, dtype=np.float32)
    patterns -= patterns.mean(axis=1, keepdims=True)
    return np.asarray(patterns / np.linalg.norm(patterns, axis=1, keepdims=True))


def _through(matrix: Array, points: Array) -> Array:
    """Return points (n, 2) taken through a homography (3, 3)."""
    taken = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    return np.asarray(taken[:, :2] / taken[:, 2:])


def _placed(number: int | None, pixels: Array, frame: PointCloudFrame) -> Tag | None:
    """Return the tag with these corner pixels (4, 2) at the height that depth shows; None where what it shows is not level."""
    low = np.maximum(np.floor(pixels.min(axis=0)).astype(int), 0)
    size = np.ceil(pixels.max(axis=0)).astype(int) + 1 - low
    rows, columns = np.nonzero(filled(pixels - low, (max(int(size[1]), 1), max(int(size[0]), 1))))
    rows, columns = rows + low[1], columns + low[0]
    inside = (rows < frame.depth.shape[0]) & (columns < frame.depth.shape[1])
    rows, columns = rows[inside], columns[inside]
    known = frame.valid[rows, columns]
    if np.count_nonzero(known) < 0.5 * max(len(rows), 1):
        return None
    heights = frame.xyz[2, rows[known], columns[known]].astype(np.float64)
    height = float(median(heights))
    if float(median(np.abs(heights - height))) > max(_LEVEL_WITHIN, 3.0 * frame.noise):
        return None
    rays = np.column_stack([(pixels - frame.matrix[:2, 2]) / np.diag(frame.matrix)[:2], np.ones(4)]) @ frame.rotation.T
    lengths = (height - frame.position[2]) / rays[:, 2]
    edges = np.linalg.norm(pixels - np.roll(pixels, 1, axis=0), axis=1)
    return Tag(number, frame.position + rays * lengths[:, None], frame.camera, float(edges.min()))


def filled(pixels: Array, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Return a picture (height, width) that is 1 in a convex polygon (n, 2) and 0 elsewhere."""
    mask = np.zeros(shape[:2], dtype=np.uint8)
    cv2.fillConvexPoly(mask, np.rint(pixels * 16.0).astype(np.int32), 1, shift=4)
    return mask
