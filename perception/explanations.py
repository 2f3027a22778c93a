"""Explanations of outlines: a shape on a support of known height, or in the air, free in its size or of a known one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import dist

import numpy as np

from robosandbox.perception.evidence import ShapeEvidence
from robosandbox.perception.fit import Fit, Prior, best_fit, cost_of, fit
from robosandbox.perception.groups import Group
from robosandbox.perception.known_meshes import DESCRIBED_CHROMA
from robosandbox.perception.recognize import AIR_GAIN, COMPLEXITY, LEAST_EXTENT, SHAPES, kind_of_form
from robosandbox.perception.shape_prior import GAIN, NEAR, WORST
from robosandbox.perception.size_prior import SizePrior
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.perception.track import AS_WELL
from robosandbox.types import ObjectKind

# Number of tangents of an outline that err alike, because lens, pose and light move neighbours together. Chosen.
CORRELATED = 4.0
# Metres around a support that a thing's middle may seem to be beside it.
BESIDE = 2.0 * TOLERANCES.position


@dataclass(frozen=True, eq=False)
class Explanation:
    """A way to explain a group of pieces: what it is, where, on what.

    Attributes:
        kind: Its shape.
        fit: As fitted.
        resting: Height of what it stands on, metres; None in the air.
        support: Number of the group that it stands on or in; None for the table, and in the air.
        seen: What it was fitted to.
        cost: That of the fit, with what it costs to float, and to have none of the sizes that its colour is known to have.
    """

    kind: ObjectKind
    fit: Fit
    resting: float | None
    support: int | None
    seen: ShapeEvidence
    cost: float


def best_explanation(
    members: Group, seen: ShapeEvidence, resting: float | None, support: int | None, priors: Sequence[SizePrior]
) -> Explanation | None:
    """Return what explains a group at a height best: a known size where one does about as well as any; None where nothing does.

    Args:
        members: The group; its colour tells which known sizes it may have.
        seen: What is measured of it.
        resting: Height of what it stands on, metres; None in the air.
        support: Number of the group that it stands on or in; None for the table, and in the air.
        priors: Sizes that are known.
    """
    chroma = np.mean([segment.chroma for segment in members.segments], axis=0)
    own = [prior for prior in priors if dist(prior.chroma, chroma) < DESCRIBED_CHROMA]
    places = [prior.place.centre for prior in own if prior.place is not None]

    def charge(found: Fit) -> float:
        # What lies about where it was needs to explain what is seen no better than what would be new.
        moved = bool(places) and min(dist(found.centre, place) for place in places) > NEAR
        return (AS_WELL if moved else 0.0) + (AIR_GAIN if resting is None else 0.0)

    found = best_fit(SHAPES, seen, resting, COMPLEXITY)
    best = None
    if found is not None and found.sizes.min() > LEAST_EXTENT:
        cost = found.cost + charge(found) + (GAIN if own else 0.0)
        best = Explanation(kind_of_form(found.shape), found, resting, support, seen, cost)
    for prior in own:
        for familiar in (_unmoved(prior, seen, resting), _of_size(prior, seen, resting)):
            if familiar is None or familiar.cost > WORST:
                continue
            cost = familiar.cost + charge(familiar)
            if best is None or cost < best.cost:
                best = Explanation(prior.kind, familiar, resting, support, seen, cost)
    return best


def _of_size(prior: SizePrior, seen: ShapeEvidence, resting: float | None) -> Fit | None:
    """Return a shape of a known size; its cost has that of what its size is off, because outlines err all around alike."""
    found = fit(prior.form, seen, resting, Prior(prior.sizes, TOLERANCES.size))
    if found is None:
        return None
    off = float((((found.sizes - prior.sizes) / TOLERANCES.size) ** 2).sum())
    return replace(found, cost=found.cost + CORRELATED * off / len(seen.rows.values))


def _unmoved(prior: SizePrior, seen: ShapeEvidence, resting: float | None) -> Fit | None:
    """Return a known thing where it was, if that explains what is seen; None else."""
    place = prior.place
    if place is None or resting is None or abs(place.bottom - resting) > BESIDE or not len(seen.rows.values):
        return None
    cost = cost_of(place, seen)
    return replace(place, cost=cost) if cost < TOLERANCES.cost else None
