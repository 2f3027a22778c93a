"""Recognition without depth: shapes fitted to outlines alone, standing on the table or on one another.

A place and a size follow from the outlines of two views, or from those of one and the height of what a thing stands on; what
the task says of sizes is a prior. Where several supports explain what is seen, all of their places make the spread.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from itertools import combinations, permutations, product

import cv2
import numpy as np

from robosandbox.perception.evidence import ShapeEvidence
from robosandbox.perception.explanations import BESIDE, CORRELATED, Explanation, best_explanation
from robosandbox.perception.fit import cost_of
from robosandbox.perception.frame import LEAST_DEPTH, with_depth
from robosandbox.perception.frames import FrameSet
from robosandbox.perception.groups import MOST_OF_IT, Group, alike, same_colour
from robosandbox.perception.outlines import MIXED, filled, redrawn
from robosandbox.perception.raycast import depths_of
from robosandbox.perception.recognize import AIR, UNEXPLAINED, as_thing, measurements, stands_on
from robosandbox.perception.segments import Segment
from robosandbox.perception.shape_prior import WORST
from robosandbox.perception.size_prior import SizePrior
from robosandbox.perception.table_edges import CorrectedPose
from robosandbox.perception.thing import Thing
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.shapes import shape_of
from robosandbox.types import Array


@dataclass(frozen=True, eq=False)
class _Rival:
    """Another way to explain a group: where it would be, and how much worse that explains what is seen, by how many rows."""

    centre: Array
    worse: float
    rows: int


def recognize_outlines(
    frames: FrameSet, poses: Mapping[str, CorrectedPose], priors: Sequence[SizePrior]
) -> tuple[list[Thing], FrameSet]:
    """Return what the pieces of all views are, and the frames with its depth.

    Args:
        frames: As `outlined` cuts them.
        poses: Of their cameras, with their errors.
        priors: Sizes that are known.
    """
    scene = _Outlines(frames, poses, priors)
    scene.stand_on_the_table()
    scene.merge()
    # Now that each has a depth, it hides what is behind it.
    scene.stand_on_the_table()
    scene.stack()
    return scene.things(), scene.told()


class _Outlines:
    """The groups of a look, and what explains each so far.

    Args:
        frames: As for `recognize_outlines`.
        poses: Likewise.
        priors: Likewise.

    Attributes:
        drawn: The frames with the depth of what explains the groups.
    """

    def __init__(self, frames: FrameSet, poses: Mapping[str, CorrectedPose], priors: Sequence[SizePrior]) -> None:
        self._frames, self._poses, self._priors = frames, poses, priors
        self._groups = dict(enumerate(_matched(frames, priors)))
        self._options: dict[int, Explanation] = {}
        self._rivals: dict[int, list[_Rival]] = {}
        self.drawn = frames

    def things(self) -> list[Thing]:
        """Return what explains the groups."""
        return [thing for _, thing in self._numbered()]

    def told(self) -> FrameSet:
        """Return the frames with the depth of what explains the groups, and none where nothing does."""
        by_camera = {}
        left = [
            each for number in self._groups if number not in self._options for each in self._groups[number].segments
        ]
        for camera, one in self.drawn.by_camera.items():
            depth = one.frame.depth.copy()
            for segment in left:
                if segment.frame.camera == camera:
                    depth[segment.crop][segment.mask] = 0.0
            by_camera[camera] = replace(one, frame=with_depth(one.frame, depth))
        return FrameSet(by_camera, self._frames.table)

    def stand_on_the_table(self) -> None:
        """Explain each group by something on the table, or where two views show it, in the air."""
        table = self._frames.table.height
        found: dict[int, Explanation] = {}
        for number, members in self._members().items():
            seen = measurements(members, self.drawn, depth=False)
            options = [self._best(number, seen, table, None)]
            if len({segment.frame.camera for segment in members.segments}) > 1:
                floating = self._best(number, seen, None, None)
                options.append(floating if floating and floating.fit.bottom > table + AIR else None)
            best = min((option for option in options if option), key=lambda option: option.cost, default=None)
            if best is not None:
                found[number] = best
                self._rivals[number] = [
                    _Rival(option.fit.centre, option.cost - best.cost, len(seen.rows.values))
                    for option in options
                    if option
                ]
        self._options = found
        self._draw()

    def merge(self) -> None:
        """Take groups of one colour for one thing where its shape would be seen in both: something before it parts them."""
        order = sorted(self._groups, key=lambda number: -sum(each.mask.sum() for each in self._groups[number].segments))
        for one, other in combinations(order, 2):
            if one not in self._options or other not in self._groups:
                continue
            a, b = self._groups[one], self._groups[other]
            if same_colour(a, b) and self._covers(one, other):
                self._groups[one] = Group((*a.segments, *b.segments))
                del self._groups[other]
                self._options.pop(other, None)

    def _covers(self, number: int, other: int) -> bool:
        """Tell whether what explains a group would be seen where the pieces of another are."""
        thing = self._thing(number, self._options[number])
        found = []
        for segment in self._member(other, self.drawn).segments:
            rows, columns = np.nonzero(segment.mask)
            found.append(depths_of(thing, segment.frame, rows + segment.box[1], columns + segment.box[0]))
        return float(np.isfinite(np.concatenate(found)).mean()) > MOST_OF_IT

    def stack(self) -> None:
        """Put groups on or into one another where both are explained better so."""
        for _ in range(len(self._groups)):
            tried = [
                (gain, number, option, below)
                for number, support in permutations(self._groups, 2)
                if support in self._options
                and self._touch(number, support)
                and (found := self._on(number, support)) is not None
                for gain, option, below in (found,)
            ]
            if not tried or max(tried, key=lambda each: each[0])[0] <= 0.0:
                for gain, number, option, _ in tried:
                    assert option.support is not None, "a group is put on another"
                    rows = len(option.seen.rows.values) + len(self._options[option.support].seen.rows.values)
                    self._rivals.setdefault(number, []).append(_Rival(option.fit.centre, -gain, rows))
                return
            gain, number, option, below = max(tried, key=lambda each: each[0])
            assert option.support is not None, "a group is put on another"
            # What the others leave unexplained is of both things.
            rows = len(self._options[option.support].seen.rows.values)
            self._rivals[number] = [
                _Rival(option.fit.centre, 0.0, 0),
                *(
                    replace(rival, worse=rival.worse + gain, rows=rival.rows + rows)
                    for rival in self._rivals.get(number, [])
                ),
                *(
                    _Rival(instead.fit.centre, gain - other, len(instead.seen.rows.values) + rows)
                    for other, another, instead, _ in tried
                    if another == number and instead is not option
                ),
            ]
            self._options[number], self._options[option.support] = option, below
            self._draw()

    def _on(self, number: int, support: int) -> tuple[float, Explanation, Explanation] | None:
        """Return by how much less a group that stands on another costs with it, and what explains the two so; None where none does."""
        under, now = self._options[support], self._options.get(number)
        if (now is not None and now.support == support) or under.resting is None or self._stands_on(support, number):
            return None
        shape = shape_of(under.kind)
        if not (shape.holds_things or shape.flat_top):
            return None
        below = under if shape.holds_things else self._cut_off(support, under)
        base = self._thing(support, below)
        height = stands_on(base, base.fit.centre[:2])
        if height is None:
            return None
        seen = (
            measurements(self._member(number, self.drawn), self.drawn, depth=False)
            if shape.holds_things
            else self._measured(number, {number, support})
        )
        found = self._best(number, seen, height, support)
        if found is None or base.fit.outside(np.array([*found.fit.centre[:2], base.fit.centre[2]])) > BESIDE:
            return None
        before = (UNEXPLAINED if now is None else now.cost) + under.cost
        if now is not None and (base.fit.outside(now.fit.centre) < 0.0 or self._is_behind(number, now, support)):
            # Two things are not in one place, and what is behind another is not seen before it.
            before += UNEXPLAINED
        return before - found.cost - below.cost, found, below

    def _cut_off(self, support: int, under: Explanation) -> Explanation:
        """Return what explains a group where what stands on it, whose outline is its own, cuts off its outline."""
        kept = {support} if under.support is None else {support, under.support}
        seen = self._measured(support, kept, wary=True)
        # Where too little of it is left, what explained it before stays; nothing speaks against it.
        return self._best(support, seen, under.resting, under.support) or replace(
            under, cost=min(cost_of(under.fit, seen), TOLERANCES.cost)
        )

    def _is_behind(self, number: int, option: Explanation, other: int) -> bool:
        """Tell whether a group is seen where what explains another would hide what explains it, by more than mixed pixels."""
        thing, before = self._thing(number, option), self._thing(other, self._options[other])
        for segment in self._member(number, self.drawn).segments:
            rows, columns = np.nonzero(segment.mask)
            left, top = segment.box[:2]
            own, near = (depths_of(each, segment.frame, rows + top, columns + left) for each in (thing, before))
            hidden = np.zeros(segment.mask.shape, np.uint8)
            hidden[rows, columns] = near < own
            if cv2.erode(hidden, np.ones((2 * MIXED + 1,) * 2, np.uint8), borderValue=0).any():
                return True
        return False

    def _touch(self, number: int, other: int) -> bool:
        """Tell whether some view shows two groups beside one another, as what stands on something is always seen to."""
        for a, b in product(self._groups[number].segments, self._groups[other].segments):
            (left, top, right, bottom), (x, y, to_x, to_y) = a.box, b.box
            apart = max(x - right, left - to_x, y - bottom, top - to_y)
            if a.frame.camera == b.frame.camera and apart <= MIXED:
                return True
        return False

    def _stands_on(self, number: int, support: int) -> bool:
        """Tell whether a group stands on another, or on what stands on it."""
        option = self._options[number]
        while option.support is not None:
            if option.support == support:
                return True
            option = self._options[option.support]
        return False

    def _measured(self, number: int, kept: Set[int], *, wary: bool = False) -> ShapeEvidence:
        """Return what is measured of a group as if all others were before it, but those that are kept, which are behind it.

        Args:
            number: Which.
            kept: The others that are behind it, and itself.
            wary: As for `tangents`.
        """
        by_camera = {}
        others = [segment for other in self._groups if other not in kept for segment in self._groups[other].segments]
        for camera, one in self.drawn.by_camera.items():
            depth = one.frame.depth.copy()
            for segment in others:
                if segment.frame.camera == camera:
                    depth[segment.crop][segment.mask] = np.float32(LEAST_DEPTH)
            by_camera[camera] = redrawn(one, self._frames.table, depth)
        frames = FrameSet(by_camera, self._frames.table)
        kin = [segment for other in kept - {number} for segment in self._member(other, frames).segments]
        return measurements(self._member(number, frames), frames, kin=kin, wary=wary, depth=False)

    def _members(self) -> dict[int, Group]:
        return {number: self._member(number, self.drawn) for number in self._groups}

    def _member(self, number: int, frames: FrameSet) -> Group:
        """Return a group's pieces as they are in frames with other depths."""
        pieces = []
        for camera, one in self._frames.by_camera.items():
            for old, new in zip(one.segments, frames.by_camera[camera].segments, strict=True):
                if any(old is own for own in self._groups[number].segments):
                    pieces.append(new)
        return Group(tuple(pieces))

    def _draw(self) -> None:
        """Give the frames the depth of what explains their groups."""
        things = [replace(thing, group=self._groups[number]) for number, thing in self._numbered()]
        self.drawn = FrameSet(
            {name: filled(one, self._frames.table, things) for name, one in self._frames.by_camera.items()},
            self._frames.table,
        )

    def _numbered(self) -> list[tuple[int, Thing]]:
        return [(number, self._thing(number, option)) for number, option in self._options.items()]

    def _thing(self, number: int, option: Explanation) -> Thing:
        """Return a group as a thing, its spread that of the fit, of the cameras' poses and of all rivals together."""
        members = self._member(number, self.drawn)
        covariance = option.fit.covariance.copy()
        cameras = {segment.frame.camera for segment in members.segments}
        known = sum(np.linalg.inv(self._poses[camera].error_at(option.fit.centre)) for camera in cameras)
        covariance[:3, :3] += np.linalg.inv(known)
        rivals = self._rivals.get(number, [])
        weights = np.exp([-0.5 * rival.rows / CORRELATED * max(rival.worse, 0.0) for rival in rivals])
        for weight, rival in zip(weights / max(weights.sum(), 1.0), rivals, strict=True):
            off = rival.centre - option.fit.centre
            covariance[:3, :3] += weight * np.outer(off, off)
        found = replace(option.fit, covariance=covariance)
        return as_thing(option.kind, found, members, option.seen, option.resting, self.drawn)

    def _best(self, number: int, seen: ShapeEvidence, resting: float | None, support: int | None) -> Explanation | None:
        return best_explanation(self._groups[number], seen, resting, support, self._priors)


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
                option.cost
                for resting in (frames.table.height, None)
                if (option := best_explanation(both, seen, resting, None, priors)) is not None
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
