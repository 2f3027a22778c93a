"""Grasps from an object's shape, made lazily: across what is convex, around the rim of what is open; by a cup on what is flat."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from robosandbox.grasp.antipodal import Antipodal
from robosandbox.grasp.closing import Closings
from robosandbox.grasp.crowding import has_room, neighbours
from robosandbox.grasp.hand import UP
from robosandbox.grasp.rim import rim_tiers
from robosandbox.grasp.sideways import is_filled, sideways
from robosandbox.grasp.solid import STEEPEST, ConvexObject
from robosandbox.grasp.suction import suction_tiers
from robosandbox.grasp.surface import Surface
from robosandbox.shapes.box import Box
from robosandbox.types import Array, DetectedObject, Grasp, ObservedScene
from robosandbox.types.robot import GripperGeometry, RobotSpec


class AnalyticTopDown:
    """Candidates for boxes, cylinders, balls, capsules, meshes (by their convex pieces), and open containers.

    Closing lines join parallel faces, or opposite points of what is round, so that friction holds; the hand comes from
    above, angled, or from the side. Grasps with no room for the fingers between neighbours come last.
    """

    def candidates(
        self,
        target: DetectedObject,
        scene: ObservedScene,
        robot: RobotSpec,
        *,
        pieces: Sequence[Array] = (),
        hand: Array | None = None,
    ) -> Iterator[Grasp]:
        """Yield grasps, best first, each tier made when it is asked for; none when nothing fits the gripper.

        Args:
            target: What to hold.
            scene: Where it stands among others.
            robot: Its gripper's measured figures decide width and depth.
            pieces: For a mesh: points that span each of its convex pieces, in the object's frame, each (k, 3).
            hand: The TCP's rotation now (3, 3): of grasps about as good the one that turns it least comes first.
        """
        if robot.gripper is None:
            return
        geometry = robot.gripper.geometry
        if geometry.cup is not None:
            for tier in suction_tiers(target, geometry.cup, robot.base_position, pieces):
                yield from _ranked(tier, hand)
            return
        near: list[DetectedObject] | None = None
        crowded: list[Grasp] = []
        for tier in _tiers(target, scene, geometry, robot.base_position, pieces):
            near = neighbours(target, scene) if near is None else near
            for grasp in _ranked(tier, hand):
                if has_room(grasp, near, geometry):
                    yield grasp
                else:
                    crowded.append(grasp)
        yield from crowded


def _tiers(
    target: DetectedObject, scene: ObservedScene, geometry: GripperGeometry, base: Array, pieces: Sequence[Array]
) -> Iterator[list[Grasp]]:
    """Yield tiers of grasps that are not empty: from the side where it is full, across, and around the rim."""
    if len(pieces) > 1:
        near = neighbours(target, scene)
        closings = Closings(
            target.id, Surface(target.pose, pieces), geometry, lambda grasp: has_room(grasp, near, geometry)
        )
        yield from filter(None, closings.tiers())
        return
    solids = (
        [ConvexObject(target, pieces[0])]
        if pieces
        else [ConvexObject(part) for part in _parts(target)] or [ConvexObject(target)]
    )
    floor = min(-float(solid.support(-UP[None])[0]) for solid in solids)
    across = [Antipodal(each, geometry, floor=floor, base=base).tiers() for each in solids]
    sides = [sideways(target, geometry, base)] if is_filled(target, scene) else []
    yield from filter(None, chain(sides, _merged(across), rim_tiers(target, geometry, floor)))


def _parts(target: DetectedObject) -> list[DetectedObject]:
    """Return the parts that can be taken hold of by themselves, as boxes; none where the object's hull says it all."""
    return [
        replace(target, kind=Box.kind, size=hull.size, pose=pose) for hull, pose in target.shape.convex_parts(target)
    ]


def _merged(tiers: Sequence[Iterator[list[Grasp]]]) -> Iterator[list[Grasp]]:
    """Yield the first tiers of all parts together, then their second ones, and so on."""
    for level in zip(*tiers, strict=True):
        yield [grasp for tier in level for grasp in tier]


def _ranked(tier: list[Grasp], hand: Array | None) -> list[Grasp]:
    if hand is None:
        return sorted(tier, key=lambda grasp: -grasp.quality)

    def key(grasp: Grasp) -> tuple[float, float]:
        return -round(grasp.quality, 1), -float((hand * grasp.tcp_pose.rotation).sum())

    return sorted(tier, key=key)


def narrowest(target: DetectedObject, pieces: Sequence[Array] = (), least: float = 0.0) -> float:
    """Return the object's least extent between fingers from above, metres; of several pieces the least over `least`, if any."""
    if len(pieces) > 1:
        _, closings, widths = Surface(target.pose, pieces).lines
        level = widths[np.abs(closings[:, 2]) < STEEPEST]
        wider = level[level > least]
        return float(wider.min() if len(wider) else level.max(initial=0.0))
    solid = ConvexObject(target, pieces[0]) if pieces else ConvexObject(target)
    extents = [solid.between(axis)[0] for axis in solid.closings()]
    return min(extents, default=float(np.inf))
