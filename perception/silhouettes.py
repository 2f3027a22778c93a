"""Recognition without depth: shapes fitted to outlines alone, standing on the table or on one another.

A place and a size follow from the outlines of two views, or from those of one and the height of what a thing stands on; what
the task says of sizes is a prior. Where several supports explain what is seen, all of their places make the spread.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations, product
from math import dist

import numpy as np

from robosandbox.perception.evidence import ShapeEvidence
from robosandbox.perception.fit import Fit, Prior, best_fit, fit
from robosandbox.perception.frames import FrameSet
from robosandbox.perception.groups import Group, alike, same_colour
from robosandbox.perception.naming import Declared
from robosandbox.perception.outlines import filled
from robosandbox.perception.recognize import (
    AIR,
    AIR_GAIN,
    COMPLEXITY,
    LEAST_EXTENT,
    SHAPES,
    as_thing,
    kind_of_form,
    measurements,
    stands_on,
)
from robosandbox.perception.segments import Segment
from robosandbox.perception.shape_prior import GAIN, WORST, KnownShape
from robosandbox.perception.support import Form
from robosandbox.perception.table_edges import CorrectedPose
from robosandbox.perception.thing import Thing
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.shapes import shape_of
from robosandbox.shapes.hull import BoxHull, CylinderHull, Hull, SphereHull
from robosandbox.types import Array, ObjectKind
from robosandbox.values import frozen

# Distance of shares of red and green up to which a piece may be of a described colour: as of known_meshes.py.
_SAME_CHROMA = 0.12
# Tangents of an outline that err alike: lens, pose and light move neighbours together.
_CORRELATED = 4.0
# Metres around a support that a thing's middle may seem to be beside it.
_BESIDE = 2.0 * TOLERANCES.position


@frozen(eq=False)
class SizePrior:
    """A shape whose size is known: described by the task, or clearly seen before.

    Attributes:
        kind: What it is.
        form: How it would lie.
        sizes: As in `Fit`, metres.
        chroma: Shares of red and green of its colour, (2,).
    """

    kind: ObjectKind
    form: Form
    sizes: Array
    chroma: Array

    @staticmethod
    def of_declared(declared: Iterable[Declared]) -> Iterator[SizePrior]:
        """Yield the ways in which described things can lie; meshes have none."""
        for item in declared:
            shape = shape_of(item.kind)
            if not item.size or shape.opens or shape.is_granular:
                continue
            rgb = np.array(item.rgb)
            for form, sizes in _ways(shape.hull(item.size), tips=not shape.holds_things):
                yield SizePrior(item.kind, form, sizes, rgb[:2] / max(float(rgb.sum()), 1e-6))

    @staticmethod
    def of_known(known: Iterable[KnownShape]) -> Iterator[SizePrior]:
        """Yield the shapes that were clearly seen before."""
        for item in known:
            chroma = np.median([segment.chroma for segment in item.group.segments], axis=0)
            yield SizePrior(kind_of_form(item.fit.shape), item.fit.shape, item.fit.sizes, chroma)


def _ways(hull: Hull, *, tips: bool) -> Iterator[tuple[Form, Array]]:
    """Yield the forms and sizes that a hull has lying on each of its sides."""
    match hull:
        case BoxHull(size=half):
            for sizes in sorted(set(permutations(map(float, half)))):
                if tips or sizes[2] == half[2]:
                    yield "box", np.array(sizes)
        case CylinderHull(size=half):
            yield "cylinder", np.array(half)
            if tips:
                yield "lying", np.array(half)
        case SphereHull(size=half):
            yield "sphere", np.array(half)
        case _:
            return


@dataclass(frozen=True, eq=False)
class _Option:
    """A way to explain a group: what it is, where, on what."""

    kind: ObjectKind
    fit: Fit
    resting: float | None
    seen: ShapeEvidence

    @property
    def charged(self) -> float:
        """Its cost, with what floating costs."""
        return self.fit.cost + (AIR_GAIN if self.resting is None else 0.0)


def recognize_outlines(
    frames: FrameSet, poses: Mapping[str, CorrectedPose], priors: Sequence[SizePrior]
) -> tuple[list[Thing], FrameSet]:
    """Return what the pieces of all views are, and the frames with its depth.

    Args:
        frames: As `outlined` cuts them.
        poses: Of their cameras, with their errors.
        priors: Sizes that are known.
    """
    groups = dict(enumerate(_matched(frames, priors)))
    things: dict[int, Thing] = {}
    drawn = frames
    # Once on the table alone, so that each has a depth and hides what is behind it; then on one another, from the lowest up.
    for again in (False, True, True):
        if again:
            groups = _merged(groups, things)
            things = {number: thing for number, thing in things.items() if number in groups}
        for number in sorted(groups, key=lambda number: things[number].fit.bottom if number in things else np.inf):
            members = _redrawn(groups[number], frames, drawn)
            others = [thing for other, thing in things.items() if other != number] if again else []
            thing = _recognized(members, frames, drawn, others, priors, poses)
            if thing is None:
                things.pop(number, None)
            else:
                things[number] = replace(thing, group=groups[number])
        drawn = FrameSet(
            {name: filled(one, frames.table, [*things.values()]) for name, one in frames.by_camera.items()},
            frames.table,
        )
    return [replace(thing, group=_redrawn(thing.group, frames, drawn)) for thing in things.values()], drawn


def _merged(groups: Mapping[int, Group], things: Mapping[int, Thing]) -> dict[int, Group]:
    """Return the groups, those as one whose shapes are in one place and of one colour: something before them parts them."""
    merged = dict(groups)
    for one, other in combinations(sorted(things, key=lambda number: -len(things[number].group.points)), 2):
        if one not in merged or other not in merged or not same_colour(merged[one], merged[other]):
            continue
        if things[one].fit.outside(things[other].fit.centre) < 0.0:
            merged[one] = Group((*merged[one].segments, *merged.pop(other).segments))
    return merged


def _redrawn(members: Group, before: FrameSet, now: FrameSet) -> Group:
    """Return a group's pieces as they are in frames with other depths."""
    pieces = []
    for camera, one in before.by_camera.items():
        for old, new in zip(one.segments, now.by_camera[camera].segments, strict=True):
            if any(old is own for own in members.segments):
                pieces.append(new)
    return Group(tuple(pieces))


def _matched(frames: FrameSet, priors: Sequence[SizePrior]) -> list[Group]:
    """Return the pieces in groups, one of each view at most: those that one shape on the table, or in the air, explains best."""
    left: list[tuple[Segment, ...]] = []
    for one in frames.by_camera.values():
        mine = list(one.segments)
        costs = {}
        for (k, members), segment in product(enumerate(left), mine):
            if not all(alike(member, segment) for member in members):
                continue
            both = Group((*members, segment))
            seen = measurements(both, frames, depth=False)
            found = [
                option.charged
                for resting in (frames.table.height, None)
                if (option := _best(both, seen, resting, priors)) is not None
            ]
            if found and min(found) < WORST:
                costs[k, id(segment)] = min(found)
        taken: set[int] = set()
        for (k, own), _ in sorted(costs.items(), key=lambda each: each[1]):
            if k in taken or own in taken:
                continue
            segment = next(each for each in mine if id(each) == own)
            left[k] = (*left[k], segment)
            taken |= {k, own}
        left += [(segment,) for segment in mine if id(segment) not in taken]
    return [Group(segments) for segments in left]


def _recognized(
    members: Group,
    undrawn: FrameSet,
    frames: FrameSet,
    others: Sequence[Thing],
    priors: Sequence[SizePrior],
    poses: Mapping[str, CorrectedPose],
) -> Thing | None:
    seen = measurements(members, frames, depth=False)
    table = frames.table.height
    options = [option for option in (_best(members, seen, table, priors),) if option and _is_free(option.fit, others)]
    for other in others:
        height = stands_on(other, other.fit.centre[:2]) if other.resting is not None else None
        if height is None or not (other.shape.holds_things or other.shape.flat_top):
            continue
        # What stands on another is before it, and so is its outline; a container's wall may be before what lies in it.
        kin = () if other.shape.holds_things else _redrawn(other.group, undrawn, frames).segments
        found = _best(members, measurements(members, frames, kin=kin, depth=False), height, priors)
        if found is None or not _is_free(found.fit, [each for each in others if each is not other]):
            continue
        if other.fit.outside(np.array([*found.fit.centre[:2], other.fit.centre[2]])) < _BESIDE:
            options.append(found)
    if len({segment.frame.camera for segment in members.segments}) > 1:
        floating = _best(members, seen, None, priors)
        if floating is not None and floating.fit.bottom > table + AIR and _is_free(floating.fit, others):
            options.append(floating)
    if not options:
        return None
    best = min(options, key=lambda option: option.charged)
    found = replace(best.fit, covariance=_spread(best, options, [poses[each.frame.camera] for each in members.segments]))
    return as_thing(best.kind, found, members, best.seen, best.resting, frames)


def _is_free(found: Fit, others: Sequence[Thing]) -> bool:
    """Tell whether a shape's middle is in none of the other things."""
    return all(other.fit.outside(found.centre) > 0.0 for other in others)


def _spread(best: _Option, options: Sequence[_Option], poses: Sequence[CorrectedPose]) -> Array:
    """Return the covariance of a fit with what the cameras' poses, and other options that explain as much, add to it."""
    covariance = best.fit.covariance.copy()
    known = sum(np.linalg.inv(pose.error_at(best.fit.centre)) for pose in poses)
    covariance[:3, :3] += np.linalg.inv(known)
    count = len(best.seen.rows.values) / _CORRELATED
    weights = np.exp([-0.5 * count * (option.charged - best.charged) for option in options])
    for weight, option in zip(weights / weights.sum(), options, strict=True):
        off = option.fit.centre - best.fit.centre
        covariance[:3, :3] += weight * np.outer(off, off)
    return covariance


def _best(members: Group, seen: ShapeEvidence, resting: float | None, priors: Sequence[SizePrior]) -> _Option | None:
    """Return what explains a group at a height best: a known size where one does about as well as any."""
    found = best_fit(SHAPES, seen, resting, COMPLEXITY)
    if found is not None and found.sizes.min() < LEAST_EXTENT:
        found = None
    chroma = np.mean([segment.chroma for segment in members.segments], axis=0)
    best = None if found is None else _Option(kind_of_form(found.shape), found, resting, seen)
    least = min(WORST, np.inf if found is None else found.cost + GAIN)
    for prior in priors:
        if dist(prior.chroma, chroma) > _SAME_CHROMA:
            continue
        familiar = fit(prior.form, seen, resting, Prior(prior.sizes, TOLERANCES.size))
        if familiar is not None and familiar.cost < least:
            best, least = _Option(prior.kind, familiar, resting, seen), familiar.cost
    return best
