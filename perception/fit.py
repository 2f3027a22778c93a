"""Boxes, cylinders and spheres fitted to silhouettes and surface points: all of it values of one support function.

A convex shape is known by h(m) = max over its points of m . x (Boyd and Vandenberghe, Convex Optimization, 2.5). The plane
through the camera and a tangent of the silhouette says h(m) = m . camera; a surface point p with outward normal u says
h(u) = u . p. For boxes, cylinders and spheres of known orientation h is linear in centre and sizes, so that each fit is
linear least squares, and the heading is searched for on a grid and then refined with the rest (Gauss and Newton).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from robosandbox.perception.evidence import ShapeEvidence, SurfacePoints
from robosandbox.perception.plane_fit import plane_tilt
from robosandbox.perception.quantiles import percentiles
from robosandbox.perception.silhouette import Rows
from robosandbox.perception.support import SIZES, TURNS, Form, axes_of, faces_of, support_terms, turn_terms
from robosandbox.types import Array
from robosandbox.values import frozen

# Step of the headings that are tried, an angle of 6 degrees. Chosen so that the next steps converge from it.
_GRID = np.radians(6.0)
_HEADINGS = {shape: np.arange(0.0, turn, _GRID) if turn else np.zeros(1) for shape, turn in TURNS.items()}
_ITERATIONS = 4  # Number of Gauss-Newton steps. Chosen: the change is below `_SETTLED` by then.
_SETTLED = 0.0001  # Metres of change below which a fit has settled. Chosen far below the errors.
_CLIP = 3.0  # Number of standard deviations beyond which a residual costs no more. Chosen.
_HUBER = 1.5  # Number of standard deviations beyond which a residual weighs less (Huber 1964). Chosen.
_LOOSE = 1e-3  # Weight of knowing nothing of the centre, 1/m^2, so that the equations can be solved. Chosen.
_MOST_SHIFT = 0.03  # Metres that one step may move a fit. Chosen.
_MOST_TURN = 0.15  # Radians that one step may turn it. Chosen.
_LEAST_SIZE = 0.003  # Half-extent, metres, of any fit. Chosen.
_LEAST_EVIDENCE = 12  # Number of measurements that a fit needs, because it has up to seven unknowns. Chosen.
_LEAST_OF_KNOWN = 2 * 4  # The same where sizes are known: twice the unknowns of a place and a heading.
# After so many steps a shape whose cost is this far over another's is given up.
_TRIES = 2
# Cost over the best so far from which a fit is given up (units: mean squared residual over standard deviation). Chosen.
_HOPELESS = 0.25
# Beside a shape of such a cost one that starts so much above where that one started is not tried.
_GOOD = 0.5
_FAR = 1.0
# Cost from which a box is tried from other starts (units: mean squared residual over standard deviation). Chosen.
_POOR = 0.6
_RESTART = np.pi / 8.0
_UP = np.array([0.0, 0.0, 1.0])
_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


@frozen(eq=False)
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
        lean: The rotation (3, 3) by which it leans over from standing upright; None where it does not.
    """

    shape: Form
    centre: Array
    sizes: Array
    yaw: float
    cost: float
    covariance: Array
    rows: int
    lean: Array | None = None

    @property
    def axes(self) -> Array:
        """The shape's own axes in the world as columns, (3, 3); a cylinder's axis is the last."""
        upright = axes_of(self.shape, self.yaw)
        return upright if self.lean is None else np.asarray(self.lean @ upright)

    def terms(self, normals: Array) -> Array:
        """Return d h(m) / d sizes (n, k) for unit vectors m (n, 3)."""
        return support_terms(self.shape, self.yaw, normals if self.lean is None else normals @ self.lean)

    def corners(self, room: float = 0.0) -> Array:
        """Return points of the world (n, 3) whose hull holds it, with so much room around it, metres."""
        return np.asarray(self.centre + (_CORNERS * (self.half + room)) @ self.axes.T)

    def outside(self, place: Array) -> float:
        """Return how far a point (3,) is from the box around the shape, along its own axes, metres; below 0 within."""
        return float((np.abs((place - self.centre) @ self.axes) - self.half).max())

    def distances(self, points: Array) -> Array:
        """Return about how far points (n, 3) are from its surface, (n,), metres; below 0 within."""
        local = (points - self.centre) @ self.axes
        if self.shape == "box":
            return np.asarray((np.abs(local) - self.sizes).max(axis=1))
        if self.shape == "sphere":
            return np.asarray(np.linalg.norm(local, axis=1) - self.sizes[0])
        across = np.hypot(local[:, 0], local[:, 1]) - self.sizes[0]
        return np.asarray(np.maximum(across, np.abs(local[:, 2]) - self.sizes[1]))

    @property
    def half(self) -> Array:
        """Half-extents (3,) of the box around it, along its own axes, metres."""
        if self.shape == "box":
            return self.sizes
        radius = float(self.sizes[0])
        return np.array([radius, radius, float(self.sizes[-1]) if len(self.sizes) > 1 else radius])

    def normals_on(self, surface: SurfacePoints) -> Array:
        """Return the outward normal (n, 3) of the face that each point lies on, of those that the camera sees."""
        normals, face, _ = faces_of(self.shape, self.centre, self.sizes, self.axes, surface)
        return normals if face is None else normals[face]

    @property
    def top(self) -> float:
        """Height of its highest point, metres."""
        return float(self.centre[2] + self.terms(_UP[None])[0] @ self.sizes)

    @property
    def bottom(self) -> float:
        """Height of its lowest point, metres."""
        return float(self.centre[2] - self.terms(_UP[None])[0] @ self.sizes)


@frozen(eq=False)
class Prior:
    """Sizes expected before anything is measured.

    Attributes:
        sizes: As in `Fit`, (k,).
        spread: Standard deviation, metres.
    """

    sizes: Array
    spread: float


def usual_prior(shape: Form) -> Prior:
    """Return how large things on a table are as a rule, very loosely."""
    return Prior(np.full(SIZES[shape], 0.025), 0.06)


def fit(shape: Form, seen: ShapeEvidence, resting: float | None, prior: Prior | None = None) -> Fit | None:
    """Return the shape that fits best, or None where the measurements do not determine it.

    Args:
        shape: Which.
        seen: The measurements.
        resting: Height of what it stands on, metres; None for something in the air.
        prior: What is known of its size.
    """
    return _refined_or_none(_start(shape, seen, resting, prior), seen, resting, prior, np.inf)


def fit_near(known: Fit, seen: ShapeEvidence, resting: float | None, prior: Prior) -> Fit | None:
    """Return the cheaper one of `fit` for a known shape and of that shape moved from where it was."""
    starts = (_start(known.shape, seen, resting, prior), known if seen.count >= _LEAST_EVIDENCE else None)
    fits = [_refined_or_none(start, seen, resting, prior, np.inf) for start in starts]
    return min((each for each in fits if each is not None), key=lambda each: each.cost, default=None)


def best_fit(shapes: Sequence[Form], seen: ShapeEvidence, resting: float | None, charge: float) -> Fit | None:
    """Return the cheapest of several shapes, None where the measurements determine none.

    Args:
        shapes: Which may be.
        seen: The measurements.
        resting: As for `fit`.
        charge: Added to the cost for each parameter.
    """
    starts = [start for shape in shapes if (start := _start(shape, seen, resting, None)) is not None]
    best = _best_from(sorted(starts, key=lambda each: each.cost), seen, resting, charge, None)
    if starts and "box" in shapes and len(seen.surface.points) and (best is None or best.cost > _POOR):
        # Half hidden, a box shows tangents of a part; where its visible faces lie tells more.
        best = _best_from(_box_starts(seen, resting), seen, resting, charge, best)
    return best


def _best_from(
    starts: Iterable[Fit], seen: ShapeEvidence, resting: float | None, charge: float, best: Fit | None
) -> Fit | None:
    least = np.inf if best is None else best.cost + charge * len(best.covariance)
    started = np.inf
    for start in starts:
        if least < _GOOD and start.cost > started + _FAR:
            continue
        found = _refined_or_none(start, seen, resting, None, least)
        if found is not None and found.cost + charge * len(found.covariance) < least:
            best, least, started = found, found.cost + charge * len(found.covariance), start.cost
    return best


def _box_starts(seen: ShapeEvidence, resting: float | None) -> Iterator[Fit]:
    """Yield the boxes around the points at several headings."""
    points = seen.surface.points
    low, high = percentiles(points[:, 2], [2.0, 98.0])
    low = low if resting is None else resting
    for yaw in np.arange(0.0, np.pi / 2.0, _RESTART):
        axes = axes_of("box", float(yaw))
        near, far = percentiles(points @ axes[:, :2], [2.0, 98.0])
        middle = axes @ np.array([*(near + far) / 2.0, (low + high) / 2.0])
        sizes = np.maximum(np.array([*(far - near), high - low]) / 2.0, _LEAST_SIZE)
        yield Fit("box", middle, sizes, float(yaw), np.inf, np.zeros((0, 0)), len(points))


def fit_leaning(seen: ShapeEvidence) -> Fit | None:
    """Return the box that leans with its largest face in the plane of most points; None where no such plane is seen.

    Its plane is found by `lean_of`.
    """
    lean = plane_tilt(seen.surface.points)
    if lean is None:
        return None
    there = seen.turned(lean)
    found = _refined_or_none(_start("box", there, None, None), there, None, None, np.inf)
    return None if found is None else replace(found, centre=lean @ found.centre, lean=lean)


def _start(shape: Form, seen: ShapeEvidence, resting: float | None, prior: Prior | None) -> Fit | None:
    """Return the shape as the silhouettes and the points' extents have it."""
    if seen.count < (_LEAST_EVIDENCE if prior is None else _LEAST_OF_KNOWN):
        return None
    return _grid(shape, seen.ended(True, resting), prior or usual_prior(shape))


def _refined_or_none(
    start: Fit | None, seen: ShapeEvidence, resting: float | None, prior: Prior | None, least: float
) -> Fit | None:
    if start is None:
        return None
    return _refined(start, seen.ended(False, resting), seen.surface, prior or usual_prior(start.shape), least)


def cost_of(known: Fit, seen: ShapeEvidence) -> float:
    """Return how badly a known shape, where it was, explains measurements: their mean squared, clipped residual."""
    surface, normals = seen.surface, known.normals_on(seen.surface)
    on_faces = Rows(normals, np.einsum("ij,ij->i", normals, surface.points), surface.weights)
    every = Rows.stack([seen.rows, on_faces])
    rest = (every.values - every.normals @ known.centre - known.terms(every.normals) @ known.sizes) * every.weights
    return float((np.minimum(np.abs(rest), _CLIP) ** 2).mean()) if len(rest) else np.inf


def _grid(shape: Form, rows: Rows, prior: Prior) -> Fit | None:
    yaws = _HEADINGS[shape]
    design = np.empty((len(yaws), len(rows.values), 3 + SIZES[shape]))
    design[..., :3] = rows.normals
    design[..., 3:] = support_terms(shape, yaws, rows.normals)
    solution = _solve(design, rows.values, rows.weights, prior)
    rest = ((design @ solution[..., None])[..., 0] - rows.values) * rows.weights
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
    normal = weighted.transpose(0, 2, 1) @ weighted + np.diag(_stiffness(prior))
    right = (values * weights) @ weighted
    right[:, 3:] += prior.sizes * prior.spread**-2
    return np.asarray(np.linalg.solve(normal, right[..., None])[..., 0], dtype=np.float64)


def _stiffness(prior: Prior, turn: float | None = None) -> Array:
    """Return how much is known of centre, sizes and, where it counts, heading before anything is measured: 1 / variance."""
    known = [*(_LOOSE,) * 3, *(prior.spread**-2,) * len(prior.sizes)]
    return np.array(known if turn is None else [*known, turn])


def _refined(start: Fit, fixed: Rows, surface: SurfacePoints, prior: Prior, least: float) -> Fit | None:
    """Return the shape refined with surface points, each on the face that it is nearest to.

    None as soon as it is clear that its cost will not come down to `least`.
    """
    shape, centre, sizes, yaw = start.shape, start.centre, start.sizes, start.yaw
    turning = TURNS[shape] > 0.0
    count, planes = 3 + SIZES[shape], len(fixed.values)
    stiffness = _stiffness(prior, 1.0 if turning else None)
    certain = np.concatenate([fixed.weights, surface.weights])
    rest = np.empty(len(certain))
    last = False
    for iteration in range(_ITERATIONS + 1):
        faces, face, rest[planes:] = faces_of(shape, centre, sizes, axes_of(shape, yaw), surface)
        normals = np.concatenate([fixed.normals, faces])
        design = np.empty((len(normals), len(stiffness)))
        design[:, :3] = normals
        design[:, 3:count] = support_terms(shape, yaw, normals)
        if turning:
            design[:, count] = turn_terms(shape, yaw, normals) @ sizes
        rest[:planes] = fixed.values - fixed.normals @ centre - design[:planes, 3:count] @ sizes
        scaled = np.abs(rest) * certain
        clipped = np.minimum(scaled, _CLIP)
        cost = float(clipped @ clipped) / len(rest)
        if iteration >= _TRIES and cost > least + _HOPELESS:
            return None
        # Huber's weights: what is far off says little.
        weights = certain * certain * (_HUBER / np.maximum(scaled, _HUBER))
        pulls = weights * rest
        if face is not None:
            # Points on one face ask for the same.
            weights, pulls = (
                np.concatenate([each[:planes], np.bincount(face, each[planes:], len(faces))])
                for each in (weights, pulls)
            )
        normal = (design * weights[:, None]).T @ design
        normal.flat[:: len(stiffness) + 1] += stiffness
        if last:
            return Fit(shape, centre, sizes, yaw, cost, np.asarray(np.linalg.inv(normal), dtype=np.float64), len(rest))
        right = pulls @ design
        right[3:count] += (prior.sizes - sizes) * prior.spread**-2
        change = np.linalg.solve(normal, right)
        settled = float(np.abs(change[:3]).max()) < _SETTLED
        centre = centre + np.minimum(np.maximum(change[:3], -_MOST_SHIFT), _MOST_SHIFT)
        sizes = np.maximum(sizes + change[3:count], _LEAST_SIZE)
        if turning:
            yaw += min(max(float(change[count]), -_MOST_TURN), _MOST_TURN)
        last = settled or iteration == _ITERATIONS - 1
    raise AssertionError("the last iteration returns")
