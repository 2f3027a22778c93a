"""Recognition of each group of pieces: shape, size, pose, support, colour, and how sure that is."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import get_args

import numpy as np

from robosandbox.perception.albedo import albedo_of
from robosandbox.perception.containers import Hull, families, find_containers, kind_by_proportions, outer
from robosandbox.perception.drawers import SeenDrawer, find_drawers
from robosandbox.perception.evidence import NO_SURFACE, ShapeEvidence, SurfacePoints
from robosandbox.perception.fit import Fit, best_fit, fit_leaning
from robosandbox.perception.frame import Mask
from robosandbox.perception.frames import FrameSet
from robosandbox.perception.free_space import seen_through
from robosandbox.perception.groups import Group, explains, may_be_one, same_colour
from robosandbox.perception.quantiles import percentiles
from robosandbox.perception.segments import Segment
from robosandbox.perception.shape_prior import GAIN, WORST, KnownShape, best_known, candidates, is_gone, pairs
from robosandbox.perception.silhouette import Rows, tangents
from robosandbox.perception.stacks import Parts, cut, cut_at, ledges
from robosandbox.perception.support import Form
from robosandbox.perception.thing import Thing, size_and_pose
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.shapes import shape_of
from robosandbox.types import Array, ObjectKind

# Number of pixels whose depth errs alike, because stereo matches windows; sim/sensors.py shares noise in 3 x 3 pixels.
_CORRELATED = 9.0
AIR = 0.015  # Metres over its support from which a thing may be in the air. Chosen above the errors of both heights.
# Cost by which a thing in the air must explain what is seen better, because most things stand (units: mean squared residual
# over standard deviation). Chosen.
AIR_GAIN = 0.15
_UNDER = 0.008  # Metres by which a thing's lowest seen point may lie under the top of what it stands on. Chosen.
_MOST_POINTS = (4.0, 96.0)  # Percentiles between which most points lie, percent: what is outside may be stray. Chosen.
# Cost of each number that a shape is described by, so that a ball is no cylinder where both fit (units: mean squared residual
# over standard deviation). Chosen.
COMPLEXITY = 0.012
# Cost by which a leaning shape must be better, because it has two more numbers (units: mean squared residual over standard
# deviation). Chosen.
_LEAN_GAIN = 0.2
# Cost from which confidence falls to 1/e with each unit (units: mean squared residual over standard deviation). Chosen.
_POOR_COST = 0.35
# Number of tangents with which a thing counts as fully seen. Chosen: one camera shows up to 32.
_ENOUGH_TANGENTS = 14.0
_USUAL_SIGMA = 2.0 * TOLERANCES.position  # Standard deviation of a position, metres, up to which confidence is full.
# Half-extent, metres, below which a fit is none. Chosen: thinner things are lost in the table's noise.
LEAST_EXTENT = 0.004
# Cost from which the pieces may be several things, one on another (units: mean squared residual over standard deviation).
# Chosen: residuals as large as expected.
_SEVERAL = 1.0
# Cost of pieces that no shape explains (units: mean squared residual over standard deviation). Chosen.
UNEXPLAINED = 3.0
# Cost of taking pieces for two things and not for one (units: mean squared residual over standard deviation). Chosen.
_STACK_CHARGE = 0.3
# Cost up to which one shape explains two groups tolerably, where nothing is seen between them.
_TOLERABLY = 2.0 * TOLERANCES.cost
# Cost by which one shape for both may be worse than the better one of two (units: mean squared residual over standard
# deviation). Chosen.
_WORSE = 0.3
SHAPES: tuple[Form, ...] = get_args(Form)


def recognize(
    groups: Sequence[Group],
    frames: FrameSet,
    hulls: Sequence[Hull] = (),
    known: Sequence[KnownShape] = (),
    kinds: Collection[ObjectKind] = (),
) -> list[Thing]:
    """Return what the groups are, the lowest first.

    Args:
        groups: The pieces of each thing.
        frames: Where they are seen.
        hulls: Of containers that were seen before.
        known: Solid things that were clearly seen before.
        kinds: Kinds of open containers that may be there beside the usual ones.
    """
    drawers, groups = find_drawers(families(groups), frames)
    containers, rest, frames = find_containers(groups, frames, hulls)
    things = [
        as_thing(
            kind_by_proportions(kind, hull, kinds),
            hull,
            members,
            outer(members, (), hull.top, frames),
            frames.table.height,
            frames,
        )
        for kind, hull, members in containers
    ]
    things += [_as_thing(drawer, frames) for drawer in drawers]
    waiting = list(rest)
    while waiting:
        waiting.sort(key=lambda members: float(members.bounds[1][2]))
        members = waiting.pop(0)
        thing = _solid(members, things, frames, known)
        if thing is None or thing.fit.cost > _SEVERAL:
            parts, frames = _in_parts(members, things, frames, thing, known)
            if parts:
                waiting += parts
                continue
        if thing is not None:
            things = _joined(things, thing, frames, known)
    return things


def _in_parts(
    members: Group, things: Sequence[Thing], frames: FrameSet, whole: Thing | None, known: Sequence[KnownShape]
) -> tuple[list[Group], FrameSet]:
    """Return the two groups, the lower one first, that explain a group better than one shape does; none where none do."""
    least = UNEXPLAINED if whole is None else whole.fit.cost
    found: list[Group] = []
    divided = frames
    for (lower, upper), there in _cuts(members, frames, known):
        if lower is None or upper is None:
            continue
        below = _solid(lower, things, there, known)
        above = None if below is None else _solid(upper, [*things, below], there, known)
        if below is None or above is None:
            continue
        share = len(lower.points) / (len(lower.points) + len(upper.points))
        cost = share * below.fit.cost + (1.0 - share) * above.fit.cost + _STACK_CHARGE
        if cost < least:
            found, divided, least = [lower, upper], there, cost
    return found, divided


def _cuts(members: Group, frames: FrameSet, known: Sequence[KnownShape]) -> Iterator[tuple[Parts, FrameSet]]:
    """Yield a group cut in two: between known things that lie side by side in it, and at heights."""
    for lower, upper in pairs(candidates(members, known)):

        def nearer(points: Array, lower: Fit = lower, upper: Fit = upper) -> Mask:
            return np.asarray(upper.distances(points) < lower.distances(points))

        yield cut(members, nearer, frames)
    for height in ledges(members):
        yield cut_at(members, height, frames)


def _joined(things: Sequence[Thing], new: Thing, frames: FrameSet, known: Sequence[KnownShape]) -> list[Thing]:
    """Return the things with a new one, made one with those that turn out to be the same."""
    for other in things:
        if other.shape.holds_things or not same_colour(other.group, new.group):
            continue
        same = explains(other.fit, new.group) or explains(new.fit, other.group)
        if not (same or may_be_one(other.group, new.group, frames)):
            continue
        rest = [thing for thing in things if thing is not other]
        both = _solid(Group((*other.group.segments, *new.group.segments)), rest, frames, known)
        if same:
            better = max(other, new, key=lambda thing: len(thing.group.points) * thing.confidence)
            if both is None or both.fit.cost > max(better.fit.cost, TOLERANCES.cost) + _WORSE:
                both = better
        elif both is None or both.fit.cost > _TOLERABLY or seen_through(both.fit, frames):
            continue
        return _joined(rest, both, frames, known)
    return [*things, new]


def _as_thing(drawer: SeenDrawer, frames: FrameSet) -> Thing:
    hull, seen = drawer.hull, drawer.seen
    return Thing(
        kind="drawer",
        size=drawer.size,
        pose=drawer.pose,
        rgb=albedo_of(drawer.members.segments, hull, frames),
        confidence=_confidence(hull, seen.rows),
        sigma=_sigma(hull),
        group=drawer.members,
        fit=hull,
        seen=seen,
        resting=frames.table.height,
        opening=drawer.opening,
    )


def measurements(
    members: Group, frames: FrameSet, *, kin: Sequence[Segment] = (), wary: bool = False, depth: bool = True
) -> ShapeEvidence:
    """Return the tangent planes of a group, and where depth is measured its surface points; `kin`, `wary` as for `tangents`."""
    rows, surfaces = [], []
    for camera, segmented in frames.by_camera.items():
        own = [segment for segment in members.segments if segment.frame.camera == camera]
        if not own:
            continue
        rows.append(tangents(own, segmented, kin, wary=wary))
        for segment in own if depth else ():
            # Neighbouring pixels err together, so that many points say less than their number.
            sigma = max(segmented.frame.noise, TOLERANCES.least_depth)
            pixels = float(segment.mask.sum())
            share = min(1.0, pixels / _CORRELATED / len(segment.points))
            surfaces.append(SurfacePoints(segment.points, segmented.frame.position, np.sqrt(share) / sigma))
    return ShapeEvidence(Rows.stack(rows), SurfacePoints.stack(surfaces) if surfaces else NO_SURFACE)


def _solid(members: Group, things: Sequence[Thing], frames: FrameSet, known: Sequence[KnownShape]) -> Thing | None:
    under = _support(members, things, frames)
    familiar = _as_known(members, under, frames, known)
    if familiar is not None and familiar.fit.cost < TOLERANCES.cost:
        return familiar
    seen = measurements(members, frames)
    found, resting = _as_any(members, seen, under)
    if familiar is not None and (found is None or familiar.fit.cost < found.cost + GAIN):
        return familiar
    if found is None or found.sizes.min() < LEAST_EXTENT:
        return None
    return as_thing(kind_of_form(found.shape), found, members, seen, resting, frames)


def _as_known(members: Group, under: float, frames: FrameSet, known: Sequence[KnownShape]) -> Thing | None:
    """Return a group as the known thing of its colour that explains it, with the size that it has; None where none does."""
    near = candidates(members, known)
    astray = [] if near else [each for each in known if same_colour(each.group, members) and is_gone(each, frames)]
    if not near and not astray:
        return None
    seen = measurements(members, frames, wary=True)
    found = best_known(near or astray, seen, under, WORST if near else TOLERANCES.cost)
    return None if found is None else as_thing(kind_of_form(found.shape), found, members, seen, under, frames)


def _as_any(members: Group, seen: ShapeEvidence, under: float) -> tuple[Fit | None, float | None]:
    """Return the shape that explains a group best, and what height it stands at, None in the air."""
    resting: float | None = under
    found = best_fit(SHAPES, seen, under, COMPLEXITY)
    if float(members.bounds[0][2]) - under > AIR:
        floating = best_fit(SHAPES, seen, None, COMPLEXITY)
        if floating and (found is None or floating.cost < found.cost - AIR_GAIN) and floating.bottom > under + AIR:
            found, resting = floating, None
    if found is None or found.cost > TOLERANCES.cost:
        leaning = fit_leaning(seen)
        if leaning is not None and (found is None or leaning.cost < found.cost - _LEAN_GAIN):
            found, resting = leaning, None
    return found, resting


def kind_of_form(shape: Form) -> ObjectKind:
    """Return the kind of a solid shape."""
    return "cylinder" if shape == "lying" else shape


def as_thing(
    kind: ObjectKind,
    found: Fit,
    members: Group,
    seen: ShapeEvidence,
    resting: float | None,
    frames: FrameSet,
) -> Thing:
    """Return a fitted shape as a thing: its colour is read, its confidence and spread follow from the fit.

    Args:
        kind: Which.
        found: Its hull, as fitted.
        members: Its pieces.
        seen: What it was fitted to.
        resting: Height of what it stands on, metres; None in the air.
        frames: Where the pieces are seen.
    """
    size, pose = size_and_pose(kind, found)
    return Thing(
        kind=kind,
        size=size,
        pose=pose,
        rgb=albedo_of(members.segments, found, frames, hollow=shape_of(kind).holds_things),
        confidence=_confidence(found, seen.rows),
        sigma=_sigma(found),
        group=members,
        fit=found,
        seen=seen,
        resting=resting,
    )


def _support(members: Group, things: Sequence[Thing], frames: FrameSet) -> float:
    """Return the height of what the group stands on: the highest thing under its middle, or the table."""
    low, _ = members.bounds
    middle = _foot(members)
    height = frames.table.height
    for thing in things:
        top = stands_on(thing, middle)
        if top is not None and height < top < float(low[2]) + _UNDER:
            height = top
    return height


def _foot(members: Group) -> Array:
    """Return about where the middle (2,) of a group's thing is in the plan, taken to be as deep as it is wide."""
    sight = np.sum([(each.points - each.frame.position).sum(axis=0) for each in members.segments], axis=0)
    level = float(np.hypot(sight[0], sight[1]))
    ahead = sight[:2] / max(level, 1e-9)
    axes = np.column_stack([ahead, [-ahead[1], ahead[0]]])
    low, high = percentiles(members.points[:, :2] @ axes, _MOST_POINTS)
    deep, wide = high - low
    hidden = max(wide - deep, 0.0) * level / float(np.linalg.norm(sight))
    return np.asarray(axes @ ((low + high) / 2.0) + hidden / 2.0 * ahead)


def stands_on(thing: Thing, place: Array) -> float | None:
    """Return the height at which something stands on or in a thing at a place (2,) of the plan; None beside it."""
    local = thing.fit.axes.T @ (np.array([*place, thing.fit.centre[2]]) - thing.fit.centre)
    half = thing.fit.sizes
    within = (
        float(np.hypot(local[0], local[1])) < half[0]
        if thing.fit.shape in ("cylinder", "sphere")
        else bool((np.abs(local[:2]) < half[:2]).all())
        if thing.fit.shape == "box"
        else False
    )
    room = thing.shape.room(thing.size, thing.opening)
    if room is not None and thing.shape.opens:
        # The part of the sliding box that is still in the cabinet is covered.
        return thing.top if within else thing.fit.bottom + room.floor if room.margin(local) > 0.0 else None
    if not within:
        return None
    return thing.top if room is None else thing.fit.bottom + room.floor


def _confidence(found: Fit, rows: Rows) -> float:
    """Return how sure a fit is, 0..1: how well it explains what was seen, and how much of it was seen."""
    explained = np.exp(-max(0.0, found.cost - _POOR_COST))
    seen = min(1.0, len(rows.values) / _ENOUGH_TANGENTS)
    spread = float(np.sqrt(np.trace(found.covariance[:3, :3])))
    return float(np.clip(explained * (0.4 + 0.6 * seen) * min(1.0, _USUAL_SIGMA / max(spread, 1e-6)), 0.0, 1.0))


def _sigma(found: Fit) -> Array:
    deviations = np.sqrt(np.clip(np.diag(found.covariance), 0.0, None))
    yaw = deviations[-1] if found.shape in ("box", "lying") else np.pi
    return np.array([*deviations[:3], yaw])
