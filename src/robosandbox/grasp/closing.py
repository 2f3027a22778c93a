"""Grasps on the real surface of what is made of convex pieces: walls, rims, handles, necks, edges, and across the whole.

A closing line joins two points of the surface through what is between them (antipodal points: Nguyen, Constructing force-closure
grasps, 1988). Around it the fingers' way is measured on the pieces: where pads first meet it on either side, over how much of
their area, and that nothing of the object is where the fingers are before they close.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from robosandbox.grasp.hand import FINGER_CLEARANCE, FRICTION, THINNEST, UP, hand_pose, turned, unit
from robosandbox.grasp.solid import STEEPEST
from robosandbox.grasp.surface import Surface
from robosandbox.types import Array, Grasp, cross
from robosandbox.types.robot import GripperGeometry
from robosandbox.values import frozen

# Metres that the fingers are open beyond what they hold at the least; chosen as where `_OPENINGS` in
# `skills/primitives/grasping.py` ends.
_OPENING = 0.005
# Metres that what is held must be narrower than open fingers; as for convex shapes.
_ROOM = 2.0 * FINGER_CLEARANCE
# Angles of the hand about the closing line, radians, tier by tier: from above, angled, from the side.
_ANGLES = tuple(np.radians([0.0, 20.0, 40.0, 60.0, 80.0]))
# Number of lines across a pad and along a finger on which its way is measured. Chosen: 5 mm apart for a pad of 2 cm.
_ACROSS, _ALONG = 5, 11
# Metres up to which a surface is as near to a pad as what the pad meets first: what a soft pad and the contacts of a
# simulation give. Chosen.
_MEETS = 0.001
# Share of a pad's lines that it must meet on either side, and metres between the middles of what the two pads meet: else
# what is held turns between them. Chosen.
_LEAST_MET, _MOST_ASKEW = 0.05, 0.008
# Metres and cosine up to which two closing lines are the same one. Chosen: a third of a pad.
_SAME_PLACE, _SAME_LINE = 0.006, 0.25
# Radians from which on a closing line is not level: a hand that leans by less is as good as upright.
_LEVEL = math.radians(5.0)
# Closing lines that are measured, and grasps that are tried of each tier. Chosen: a tier costs 0.1 s, and half a search.
_MOST_LINES, _MOST_OF_TIER = 120, 24
# Quality lost per metre of lever of the weight, per radian of tilt, and for pads that are met by little. Chosen so that a hand from
# above on a whole pad comes first, and the middle before the ends.
_LEVER_COST, _TILT_COST, _MET_COST = 4.0, 0.5, 0.5


@frozen
class _Meeting:
    """Contact of two pads with what is between them: width and the middle's offset along the line, metres, and the lesser share of a pad."""

    width: float
    offset: float
    share: float


class Closings:
    """Makes grasps of a surface, tier by tier.

    Args:
        name: The object's id.
        surface: What to hold.
        geometry: The gripper.
        has_room: Whether the fingers of a grasp have room among what stands near: those come first in a tier.
    """

    def __init__(
        self, name: str, surface: Surface, geometry: GripperGeometry, has_room: Callable[[Grasp], bool]
    ) -> None:
        self._name = name
        self._has_room = has_room
        self._surface = surface
        self._geometry = geometry
        self._floor = -surface.support(-UP)
        self._ceiling = surface.support(UP)
        self._lines = self._chosen()

    def tiers(self) -> Iterator[list[Grasp]]:
        """Yield lists of grasps, each made when it is asked for: from above first, from the side last; then those at other places.

        Near the middle is best as long as the hand has room there. Last comes a hand that is held upright at a wall that leans.
        """
        others: list[list[Grasp]] = []
        upright = [
            (middle, level, width) for middle, closing, width in self._lines if (level := _level(closing)) is not None
        ]
        # Pads that lie askew to a wall hold it by their tips.
        tips = _MOST_ASKEW - self._geometry.tip_depth
        for lines, angle, depth in [*((self._lines, angle, None) for angle in _ANGLES), (upright, 0.0, tips)]:
            found = [
                grasp
                for middle, closing, width in lines
                for turn in dict.fromkeys((angle, -angle))
                if (grasp := self._grasp(middle, closing, width, turn, depth)) is not None
            ]
            found.sort(key=lambda grasp: -grasp.quality)
            if len(found) > _MOST_OF_TIER // 2:
                found.sort(key=lambda grasp: not self._has_room(grasp))
            best = found[: _MOST_OF_TIER // 2]
            others.append(self._elsewhere(best, found[_MOST_OF_TIER // 2 :]))
            yield self._both_ways(best)
        yield from map(self._both_ways, others)

    def _chosen(self) -> list[tuple[Array, Array, float]]:
        """Return closing lines that fit between the fingers, no two the same, the best of them where there are many."""
        middles, closings, widths = self._surface.lines
        least, most = self._geometry.min_aperture + THINNEST, self._geometry.max_aperture - _ROOM
        fits = (widths > least) & (widths < most) & (np.abs(closings[:, 2]) < STEEPEST)
        levers = np.linalg.norm((middles - self._surface.middle)[:, :2], axis=1)
        cost = _LEVER_COST * levers + np.abs(closings[:, 2]) + widths / self._geometry.max_aperture
        found: dict[tuple[int, ...], tuple[Array, Array, float]] = {}
        for k in np.argsort(cost, kind="stable"):
            if not fits[k]:
                continue
            closing = closings[k]
            forth = closing if tuple(closing.round(6)) > tuple((-closing).round(6)) else -closing
            key = (*(middles[k] / _SAME_PLACE).round().astype(int), *(forth / _SAME_LINE).round().astype(int))
            found.setdefault(key, (middles[k], forth, float(widths[k])))
        lines = list(found.values())
        # The cheapest half, and of the others some from everywhere.
        near, rest = lines[: _MOST_LINES // 2], lines[_MOST_LINES // 2 :]
        return near + rest[:: max(1, -(-len(rest) // (_MOST_LINES // 2)))]

    def _grasp(
        self, middle: Array, closing: Array, width: float, angle: float, depth: float | None = None
    ) -> Grasp | None:
        """Return the grasp on a closing line with the hand turned about it, or None where fingers or palm have no room; depth as of `hand_pose`."""
        geometry = self._geometry
        approach = turned(unit(-UP + closing * (closing @ UP)), closing, angle)
        near = self._near(middle, closing, approach, width)
        point, centre, met, pose = middle, middle, None, None
        for _ in range(2):
            pose = hand_pose(
                geometry,
                point=point,
                closing=closing,
                approach=approach,
                width=width,
                near=near,
                floor=self._floor,
                ceiling=self._ceiling,
                depth=depth,
            )
            if pose is None:
                return None
            # What is held is where the pads are, beside a jaw that stands still.
            centre = pose.position + closing * float((point - pose.position) @ closing)
            met = self._met(centre, closing, approach, width)
            if met is None:
                return None
            point, width = point + met.offset * closing, met.width
        assert pose is not None and met is not None
        lever = float(np.linalg.norm((centre - self._surface.middle)[:2]))
        tilt = math.acos(min(1.0, max(-1.0, -float(approach[2]))))
        quality = (
            1.0 - _LEVER_COST * lever - _TILT_COST * tilt + _MET_COST * min(met.share, 0.5) - 0.2 * abs(closing[2])
        )
        how = (
            "upright"
            if depth is not None
            else "top-down"
            if angle == 0.0
            else "angled"
            if abs(angle) < math.pi / 4.0
            else "side"
        )
        return Grasp(object=self._name, tcp_pose=pose, width=width, quality=float(quality), how=how)

    def _elsewhere(self, best: Sequence[Grasp], others: Sequence[Grasp]) -> list[Grasp]:
        """Return the best of other grasps at each place that is a finger's width from any before."""
        found = list(best)
        for grasp in others:
            here = grasp.tcp_pose.position
            if all(math.dist(here, one.tcp_pose.position) > self._geometry.finger_width for one in found):
                found.append(grasp)
        return found[len(best) : len(best) + _MOST_OF_TIER // 2]

    def _both_ways(self, grasps: Sequence[Grasp]) -> list[Grasp]:
        return [both for grasp in grasps for both in (grasp, self._flipped(grasp))]

    def _flipped(self, grasp: Grasp) -> Grasp:
        """Return the same grasp with the hand turned round."""
        rotation = grasp.tcp_pose.rotation
        aside = self._geometry.centre(grasp.width)
        # A jaw that stands still comes to the other side.
        position = grasp.tcp_pose.position + 2.0 * aside * rotation[:, 1]
        round_about = rotation * [-1.0, -1.0, 1.0]
        return Grasp(
            object=grasp.object,
            tcp_pose=type(grasp.tcp_pose).from_matrix(position, round_about),
            width=grasp.width,
            quality=grasp.quality,
            how=grasp.how,
        )

    def _near(self, middle: Array, closing: Array, approach: Array, width: float) -> float:
        """Return how far what is between the fingers reaches from the middle against the approach, metres."""
        side = cross(closing, approach)
        half = self._geometry.finger_width / 2.0
        across = np.linspace(-half, half, _ACROSS)
        along = np.linspace(-0.5, 0.5, _ACROSS) * (width + 2.0 * _OPENING)
        grid = middle + (across[:, None, None] * side + along[None, :, None] * closing).reshape(-1, 3)
        _, leaves = self._surface.through(grid, -approach)
        return max(0.0, float(leaves.max()))

    def _met(self, centre: Array, closing: Array, approach: Array, width: float) -> _Meeting | None:
        """Return how pads that close on a centre from `width` and a little more meet the object; None where they do not."""
        geometry = self._geometry
        side = cross(closing, approach)
        across = np.linspace(-0.45, 0.45, _ACROSS) * geometry.finger_width
        along = np.linspace(-geometry.palm_depth, geometry.tip_depth, _ALONG)
        places = np.stack(np.meshgrid(across, along, indexing="ij"), axis=-1).reshape(-1, 2)
        grid = centre + places[:, :1] * side + places[:, 1:] * approach
        enters, leaves = self._surface.through(grid, closing)
        begin = width / 2.0 + _OPENING
        end = begin + geometry.finger_thickness
        # Nothing of the object is where the fingers are before they close.
        if ((enters < end) & (leaves > begin)).any() or ((enters < -begin) & (leaves > -end)).any():
            return None
        between = (enters < begin) & (leaves > -begin)
        high = np.where(between, leaves, -np.inf).max(axis=1)
        low = np.where(between, enters, np.inf).min(axis=1)
        top, bottom = float(high.max()), float(low.min())
        held = top - bottom
        if not geometry.min_aperture + THINNEST < held < geometry.max_aperture - _ROOM:
            return None
        right, left = high > top - _MEETS, low < bottom + _MEETS
        askew = float(np.linalg.norm(places[right].mean(axis=0) - places[left].mean(axis=0)))
        share = float(min(right.mean(), left.mean()))
        if share < _LEAST_MET or askew > _MOST_ASKEW:
            return None
        # The edge of a tip slides off a face that it does not meet squarely; a pad that lies on an edge presses along its own normal.
        for is_met, reach, way in ((right, high, closing), (left, -low, -closing)):
            by_tip = bool((places[is_met, 1] >= along[-1]).all())
            if by_tip and not self._surface.meets_squarely(grid[is_met] + reach[is_met, None] * way, way):
                return None
        return _Meeting(held, (top + bottom) / 2.0, share)


def _level(closing: Array) -> Array | None:
    """Return the level unit vector (3,) nearest to a closing line, or None where pads would slip so, or the line is level."""
    level = unit(closing * [1.0, 1.0, 0.0])
    askew = math.acos(min(1.0, float(level @ closing)))
    return level if _LEVEL < askew < math.atan(FRICTION) else None
