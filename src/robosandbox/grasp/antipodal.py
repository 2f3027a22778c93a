"""Grasps across a convex shape: from above, along its length, shallow, angled, and from the side."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robosandbox.grasp.hand import FINGER_CLEARANCE, FRICTION, THINNEST, UP, hand_pose, lean, turned, unit
from robosandbox.grasp.solid import ConvexObject
from robosandbox.types import Array, Grasp, cross
from robosandbox.types.robot import GripperGeometry

# Places off the middle, as fractions of the object's length. Chosen short of its ends.
_SHIFTS = (0.25, -0.25, 0.38, -0.38)
_SHALLOW = 0.009  # Metres that a shallow grasp goes below what it meets first. Chosen: holds by part of a pad.
# Metres that the point to be held must lie deeper than that, so that the grasp is another one. Chosen.
_SHALLOWER = 0.006
_ANGLES = tuple(np.radians([15.0, 30.0, 45.0]))
_LEANS = tuple(np.radians([15.0, 30.0, 45.0, -20.0]))
_SIDE_ANGLES = tuple(np.radians([60.0, 75.0, 90.0]))
_TILT_COST = 1.0  # Quality lost per radian of tilt. Chosen so that a hand from above comes first.
_DEPTH_COST = 5.0  # Quality lost per metre off the middle along the approach. Chosen.
_SHIFT_COST = 2.0  # Quality lost per metre off the middle along the object. Chosen: its weight turns it there.


class Antipodal:
    """Makes grasps of one solid, tier by tier.

    Args:
        solid: What to hold.
        geometry: The gripper.
        floor: Height under which no fingertip may come, metres.
        base: The robot's base, shape (3,): leaning hands lean away from it.
    """

    def __init__(self, solid: ConvexObject, geometry: GripperGeometry, *, floor: float, base: Array) -> None:
        self._solid = solid
        self._geometry = geometry
        self._floor = floor
        self._base = base
        self._ceiling = float(solid.support(UP[None])[0])
        self._closings = [
            (axis, width, point)
            for axis in solid.closings()
            for width, point in [solid.between(axis)]
            if geometry.min_aperture + THINNEST < width < geometry.max_aperture - 2.0 * FINGER_CLEARANCE
        ]

    def tiers(self) -> Iterator[list[Grasp]]:
        """Yield lists of grasps, each made when it is asked for: the plain ones first, the odd ones last."""
        yield self._angled(0.0, "top-down")
        yield self._shifted()
        for angle in _ANGLES:
            yield [*self._leaning(angle), *self._angled(angle, "angled"), *self._angled(-angle, "angled")]
        yield self._leaning(_LEANS[-1])
        for angle in _SIDE_ANGLES:
            yield [*self._angled(angle, "side"), *self._angled(-angle, "side")]

    def _angled(self, angle: float, how: str) -> list[Grasp]:
        """Hands turned about the closing line by an angle: the fingers still meet the surfaces squarely."""
        found = []
        for closing, width, point in self._closings:
            approach = turned(_down(closing), closing, angle)
            found += self._both_ways(closing, approach, width, point, how=how)
        return found

    def _shifted(self) -> list[Grasp]:
        """From above, off the middle along the object's length, and not as deep."""
        found = []
        for closing, width, point in self._closings:
            approach = _down(closing)
            found += self._both_ways(closing, approach, width, point, depth=_SHALLOW, how="shallow", cost=0.05)
            along = cross(closing, approach)
            length, middle = self._solid.between(along)
            if length < 2.0 * self._geometry.finger_width:
                continue
            offset = float(along @ (middle - point))
            for share in _SHIFTS:
                moved = point + along * (offset + share * length)
                cost = _SHIFT_COST * abs(share) * length
                found += self._both_ways(closing, approach, width, moved, how="top-down", cost=cost)
        return found

    def _leaning(self, angle: float) -> list[Grasp]:
        """Hands leaning away from the robot, as arms with few joints must; the closing line leans along.

        Left out is what leans it out of the friction cones of the surfaces: there a pad slides along its surface, or comes
        down on the edge above it, and no force of the other holds against it (Nguyen, Constructing force-closure grasps, 1988).
        """
        turn = lean(self._solid.middle - self._base, angle)
        found = []
        for flat, width, point in self._closings:
            closing = turn @ flat
            askew = float(np.arccos(np.clip(abs(closing @ flat), 0.0, 1.0)))
            if askew > np.arctan(FRICTION):
                continue
            found += self._both_ways(closing, turn @ _down(flat), width, point, how="leaning", cost=0.02 + 0.2 * askew)
        return found

    def _both_ways(
        self,
        closing: Array,
        approach: Array,
        width: float,
        point: Array,
        *,
        how: str,
        depth: float | None = None,
        cost: float = 0.0,
    ) -> list[Grasp]:
        near = float(self._solid.support(-approach[None])[0] + approach @ point)
        if depth is not None and near - depth < _SHALLOWER:
            return []
        found = []
        tilt = float(np.arccos(np.clip(-approach[2], -1.0, 1.0)))
        for sign in (closing, -closing):
            pose = hand_pose(
                self._geometry,
                point=point,
                closing=sign,
                approach=approach,
                width=width,
                near=near,
                floor=self._floor,
                ceiling=self._ceiling,
                depth=depth,
            )
            if pose is None:
                continue
            off = abs(float((pose.position - point) @ approach))
            quality = 1.0 - width / self._geometry.max_aperture - _DEPTH_COST * off - _TILT_COST * tilt - cost
            found.append(Grasp(object=self._solid.seen.id, tcp_pose=pose, width=width, quality=quality, how=how))
        return found


def _down(closing: Array) -> Array:
    """Return the unit vector at a right angle to `closing` that points down the most."""
    return unit(-UP + closing * (closing @ UP))
