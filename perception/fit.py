"""Boxes, cylinders and spheres fitted to silhouettes and surface points: all of it values of one support function.

A convex shape is known by h(m) = max over its points of m . x (Boyd and Vandenberghe, Convex Optimization, 2.5). The plane
through the camera and a tangent of the silhouette says h(m) = m . camera; a surface point p with outward normal u says
h(u) = u . p. For boxes, cylinders and spheres of known orientation h is linear in centre and sizes, so that each fit is
linear least squares, and the heading is searched for on a grid and then refined with the rest (Gauss and Newton).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from robosandbox.perception.outline import Rows
from robosandbox.types import Array

Shape = Literal["box", "cylinder", "lying", "sphere"]
SIZES: dict[Shape, int] = {"box": 3, "cylinder": 2, "lying": 2, "sphere": 1}
_TURNS: dict[Shape, float] = {"box": np.pi / 2.0, "cylinder": 0.0, "lying": np.pi, "sphere": 0.0}

_GRID = np.radians(6.0)
_ITERATIONS = 4
_SETTLED = 0.0001
_CLIP = 3.0
_LEAST_SIZE = 0.003
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Surface points of one view.

    Attributes:
        points: World, (n, 3).
        camera: Where it was seen from, (3,).
        weight: 1 / standard deviation of each point along its normal, 1/m.
    """

    points: Array
    camera: Array
    weight: float


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A fitted shape.

    Attributes:
        shape: Which; "lying" is a cylinder with a horizontal axis.
        centre: World, (3,).
        sizes: Half-extents, or radius and half height, or radius.
        yaw: Heading of the box's x axis, or of the lying axis, radians.
        cost: Mean of the squared, clipped residuals over their standard deviations; about 1 for a right shape.
        covariance: Of centre, sizes and yaw, in that order.
        rows: How many measurements it rests on.
    """

    shape: Shape
    centre: Array
    sizes: Array
    yaw: float
    cost: float
    covariance: Array
    rows: int

    @property
    def axes(self) -> Array:
        """The shape's own axes in the world as columns, (3, 3); a cylinder's axis is the last."""
        return axes_of(self.shape, self.yaw)

    @property
    def top(self) -> float:
        """Height of its highest point, metres."""
        return float(self.centre[2] + support_terms(self.shape, self.yaw, _UP[None])[0] @ self.sizes)

    @property
    def bottom(self) -> float:
        """Height of its lowest point, metres."""
        return float(self.centre[2] - support_terms(self.shape, self.yaw, _UP[None])[0] @ self.sizes)


def axes_of(shape: Shape, yaw: float) -> Array:
    """Return the axes (3, 3), as columns, of a shape at a heading."""
    c, s = np.cos(yaw), np.sin(yaw)
    if shape == "lying":
        # The axis comes last and lies along the heading.
        return np.array([[0.0, -s, c], [0.0, c, s], [-1.0, 0.0, 0.0]])
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def support_terms(shape: Shape, yaw: float | Array, normals: Array) -> Array:
    """Return d h(m) / d sizes for unit vectors m (n, 3): (n, k), or (g, n, k) for g headings."""
    yaw = np.asarray(yaw)[..., None]
    c, s = np.cos(yaw), np.sin(yaw)
    x, y, z = normals.T
    if shape == "sphere":
        return np.ones((*np.broadcast_shapes(c.shape, x.shape), 1))
    ahead, aside = np.abs(c * x + s * y), np.abs(c * y - s * x)
    if shape == "box":
        return np.stack([ahead, aside, np.broadcast_to(np.abs(z), ahead.shape)], axis=-1)
    axial = ahead if shape == "lying" else np.broadcast_to(np.abs(z), ahead.shape)
    return np.stack([np.sqrt(np.clip(1.0 - axial**2, 0.0, None)), axial], axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """What sizes are expected before anything is measured.

    Attributes:
        sizes: As in `Fit`, (k,).
        spread: Standard deviation, metres.
    """

    sizes: Array
    spread: float


def usual(shape: Shape) -> Prior:
    """Return how large things on a table are as a rule, very loosely."""
    return Prior(np.full(SIZES[shape], 0.025), 0.06)


def fit(
    shape: Shape, rows: Rows, surfaces: Sequence[Surface], resting: float | None, prior: Prior | None = None
) -> Fit | None:
    """Return the shape that fits best, or None where the measurements do not determine it.

    Args:
        shape: Which.
        rows: Tangent planes of all views.
        surfaces: Surface points of all views.
        resting: Height of what it stands on, metres; None for something in the air.
        prior: What is known of its size.
    """
    prior = prior or usual(shape)
    points = np.vstack([surface.points for surface in surfaces])
    if len(rows.values) + len(points) < 12:
        return None
    high, highest = (float(value) for value in np.percentile(points[:, 2], [92, 98]))
    known = [rows, Rows(_UP[None], np.array([high]), np.array([1.0 / 0.004]))]
    if resting is not None:
        known.append(Rows(-_UP[None], np.array([-resting]), np.array([1.0 / 0.0008])))
    base = Rows.stack(known)
    # Points say roughly where the shape is, even where no tangent does.
    base = Rows.stack([base, _extents(points, 0.008)])
    best = _grid(shape, base, prior)
    if best is None:
        return None
    # A covered top shows no surface, but the sides end there.
    known[1] = Rows(_UP[None], np.array([highest]), np.array([1.0 / 0.005]))
    return _refined(best, Rows.stack(known), surfaces, prior)


def cost_of(known: Fit, rows: Rows, surfaces: Sequence[Surface]) -> float:
    """Return how badly a known shape, where it was, explains measurements: their mean squared, clipped residual."""
    every = Rows.stack([rows, *(_on_surface(known, surface) for surface in surfaces)])
    terms = support_terms(known.shape, known.yaw, every.normals)
    rest = (every.values - every.normals @ known.centre - terms @ known.sizes) * every.weights
    return float((np.minimum(np.abs(rest), _CLIP) ** 2).mean()) if len(rest) else np.inf


def _extents(points: Array, sigma: float) -> Rows:
    angles = np.arange(8) * np.pi / 4.0
    normals = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(8)])
    values = np.percentile(points @ normals.T, 96, axis=0)
    return Rows(normals, values, np.full(8, 1.0 / sigma))


def _grid(shape: Shape, rows: Rows, prior: Prior) -> Fit | None:
    turn = _TURNS[shape]
    yaws = np.arange(0.0, turn, _GRID) if turn else np.zeros(1)
    terms = support_terms(shape, yaws, rows.normals)
    design = np.concatenate([np.broadcast_to(rows.normals, (len(yaws), *rows.normals.shape)), terms], axis=2)
    solution = _solve(design, rows.values, rows.weights, prior)
    rest = (np.einsum("gnk,gk->gn", design, solution) - rows.values) * rows.weights
    cost = np.minimum(np.abs(rest), _CLIP) ** 2
    best = int(cost.sum(axis=1).argmin())
    sizes = np.maximum(solution[best, 3:], _LEAST_SIZE)
    return Fit(
        shape,
        solution[best, :3],
        sizes,
        float(yaws[best]),
        float(cost[best].mean()),
        np.zeros((0, 0)),
        len(rows.values),
    )


def _solve(design: Array, values: Array, weights: Array, prior: Prior) -> Array:
    """Return weighted least squares solutions (g, k) of designs (g, n, k), sizes held to the prior."""
    weighted = design * weights[:, None]
    normal = np.einsum("gnk,gnl->gkl", weighted, weighted)
    right = np.einsum("gnk,n->gk", weighted, values * weights)
    for k, size in enumerate(prior.sizes, start=3):
        normal[:, k, k] += prior.spread**-2
        right[:, k] += size * prior.spread**-2
    normal[:, range(3), range(3)] += 1e-3
    return np.asarray(np.linalg.solve(normal, right[..., None])[..., 0])


def _refined(start: Fit, fixed: Rows, surfaces: Sequence[Surface], prior: Prior) -> Fit:
    """Return the shape refined with surface points, each on the face that it is nearest to."""
    found, turning = start, _TURNS[start.shape] > 0.0
    count = 3 + SIZES[start.shape]
    last = False
    for iteration in range(_ITERATIONS + 1):
        rows = Rows.stack([fixed, *(_on_surface(found, surface) for surface in surfaces)])
        terms = support_terms(found.shape, found.yaw, rows.normals)
        rest = rows.values - rows.normals @ found.centre - terms @ found.sizes
        scaled = np.abs(rest * rows.weights)
        # Huber's weights: what is far off says little.
        weights = rows.weights * np.sqrt(np.minimum(1.0, 1.5 / np.maximum(scaled, 1e-9)))
        design = np.hstack([rows.normals, terms])
        if turning:
            step = 1e-3
            ahead = support_terms(found.shape, found.yaw + step, rows.normals)
            behind = support_terms(found.shape, found.yaw - step, rows.normals)
            design = np.column_stack([design, (ahead - behind) @ found.sizes / (2.0 * step)])
        weighted = design * weights[:, None]
        normal = weighted.T @ weighted
        right = weighted.T @ (rest * weights)
        sized = range(3, count)
        normal[sized, sized] += prior.spread**-2
        right[sized] += (prior.sizes - found.sizes) * prior.spread**-2
        normal[range(3), range(3)] += 1e-3
        if turning:
            normal[-1, -1] += 1.0
        if last:
            cost = float((np.minimum(scaled, _CLIP) ** 2).mean())
            return replace(
                found, cost=cost, covariance=np.array(np.linalg.inv(normal), dtype=np.float64), rows=len(rows.values)
            )
        change = np.linalg.solve(normal, right)
        settled = float(np.abs(change[:3]).max()) < _SETTLED
        yaw = found.yaw + (float(np.clip(change[-1], -0.15, 0.15)) if turning else 0.0)
        found = replace(
            found,
            centre=found.centre + np.clip(change[:3], -0.03, 0.03),
            sizes=np.maximum(found.sizes + change[3:count], _LEAST_SIZE),
            yaw=yaw,
        )
        last = settled or iteration == _ITERATIONS - 1
    raise AssertionError("the last iteration returns")


def _on_surface(found: Fit, surface: Surface) -> Rows:
    """Return the rows of points, each with the outward normal of the face that it lies on."""
    normals = surface_normals(found, surface)
    values = np.einsum("ij,ij->i", normals, surface.points)
    return Rows(normals, values, np.full(len(values), surface.weight))


def surface_normals(found: Fit, surface: Surface) -> Array:
    """Return the outward normal (n, 3) of the shape's face that each point lies on, of those that the camera sees."""
    offset = surface.points - found.centre
    to_camera = surface.camera - surface.points
    if found.shape == "sphere":
        return np.asarray(offset / np.maximum(np.linalg.norm(offset, axis=1, keepdims=True), 1e-9))
    if found.shape == "box":
        axes = found.axes
        local = offset @ axes
        signs = np.where(to_camera @ axes >= 0.0, 1.0, -1.0)
        face = (signs * local - found.sizes).argmax(axis=1)
        return np.asarray(axes.T[face] * signs[np.arange(len(face)), face][:, None])
    axis = found.axes[:, 2]
    along = offset @ axis
    across = offset - along[:, None] * axis
    radius = np.linalg.norm(across, axis=1)
    sign = np.where(to_camera @ axis >= 0.0, 1.0, -1.0)
    flat = sign * along - found.sizes[1] > radius - found.sizes[0]
    return np.where(flat[:, None], sign[:, None] * axis, across / np.maximum(radius, 1e-9)[:, None])
