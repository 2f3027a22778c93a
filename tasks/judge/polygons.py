"""Convex polygons seen from above: outlines, how deep a point lies in one, how far two are apart, what surrounds a point."""

from __future__ import annotations

import math

import numpy as np

from robosandbox.types import Array

# Radians by which two neighbours may miss one another and still close a wall; chosen: 1 mm seen from 50 mm away.
_SEAM = 0.02


def outline(points: Array) -> Array:
    """Return the corners of the convex hull of points (n, 2), counter-clockwise, shape (k, 2).

    Andrew, Another efficient algorithm for convex hulls in two dimensions, 1979.
    """
    ordered = sorted({(float(x), float(y)) for x, y in points})
    if len(ordered) < 3:
        return np.array(ordered)
    return np.array([*_chain(ordered), *_chain(ordered[::-1])])


def _chain(ordered: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return one side of the hull of points in order along x, without its last corner."""
    chain: list[tuple[float, float]] = []
    for point in ordered:
        while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0.0:
            chain.pop()
        chain.append(point)
    return chain[:-1]


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def depth(polygon: Array, point: Array) -> float:
    """Return how deep a point (2,) lies in a convex polygon (k, 2), in its unit; negative outside, by the farthest edge.

    A polygon of fewer than three corners has no inside: the answer is minus the distance to it.
    """
    if len(polygon) < 3:
        return -_to_edges(polygon, point)
    edges = np.roll(polygon, -1, axis=0) - polygon
    inward = np.column_stack([-edges[:, 1], edges[:, 0]]) / np.linalg.norm(edges, axis=1)[:, None]
    return float(((point - polygon) * inward).sum(axis=1).min())


def separation(first: Array, second: Array) -> float:
    """Return the distance between two convex polygons (k, 2), in their unit; where they overlap, minus how deep.

    How deep is the least way along an edge's normal that parts them (separating axes; Gottschalk, 1996).
    """
    overlap = max(_gap_along_edges(first, second), _gap_along_edges(second, first))
    if overlap <= 0.0:
        return overlap
    return min(
        min(_to_edges(first, corner) for corner in second),
        min(_to_edges(second, corner) for corner in first),
    )


def _gap_along_edges(polygon: Array, other: Array) -> float:
    edges = np.roll(polygon, -1, axis=0) - polygon
    lengths = np.linalg.norm(edges, axis=1)
    edges, corners = edges[lengths > 0.0], polygon[lengths > 0.0]
    outward = np.column_stack([edges[:, 1], -edges[:, 0]]) / lengths[lengths > 0.0, None]
    beyond = (other[None] - corners[:, None]) @ outward[:, :, None]
    return float(beyond[..., 0].min(axis=1).max())


def _to_edges(polygon: Array, point: Array) -> float:
    """Return the distance of a point (2,) from a polygon's edges."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    squared = np.maximum((edges**2).sum(axis=1), 1e-18)
    along = np.clip(((point - polygon) * edges).sum(axis=1) / squared, 0.0, 1.0)
    return float(np.linalg.norm(polygon + along[:, None] * edges - point, axis=1).min())


def surrounded(point: Array, polygons: list[Array]) -> bool:
    """Tell whether convex polygons, none of which the point (2,) lies in, hide the horizon all around it."""
    spans = [_span(point, polygon) for polygon in polygons]
    # What is seen across the heading of half a turn hides both ends of the horizon.
    reach = -math.pi
    for begin, end in sorted((begin + turn, end + turn) for begin, end in spans for turn in (-math.tau, 0.0)):
        if begin > reach + _SEAM:
            return False
        reach = max(reach, end)
        if reach >= math.pi - _SEAM:
            return True
    return False


def _span(point: Array, polygon: Array) -> tuple[float, float]:
    """Return the headings between which a polygon is seen, radians; the first from -pi to pi, the second after it."""
    seen = polygon - point
    middle = seen.mean(axis=0)
    heading = math.atan2(middle[1], middle[0])
    # Each corner's heading from the middle's: a convex polygon is seen within half a turn.
    across = middle[0] * seen[:, 1] - middle[1] * seen[:, 0]
    off = np.arctan2(across, seen @ middle)
    begin = math.remainder(heading + float(off.min()), math.tau)
    return begin, begin + float(off.max() - off.min())
