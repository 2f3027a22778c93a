"""Place in: put what is held into a container."""

from __future__ import annotations

import numpy as np

from robosandbox.errors import Phase, PlacementError, PlacementEvidence
from robosandbox.perception.relations import bounds, gap, inside
from robosandbox.protocols import SkillContext
from robosandbox.skills.base import Skill
from robosandbox.skills.manipulator import Manipulator
from robosandbox.skills.placing import Spot, occupied, place, turns, with_pose, yaw_to_align
from robosandbox.types import CONTAINER_KINDS, CONTAINER_WALL, DetectedObject, Pose, SkillResult

_TAKES = ("bin", "bowl")
_GRID = (0.0, 0.5, -0.5)
_ABOVE_FLOOR = 0.002
_ABOVE_RIM = 0.004


class PlaceIn(Skill):
    """Put what is held into a container."""

    name = "place_in"

    def run(self, ctx: SkillContext, *, container: str) -> SkillResult:
        """Put the held object into a bin or bowl.

        Args:
            container: Id of the container.

        Raises:
            NotHoldingError: The gripper is empty.
            ObjectNotFoundError: The container is not seen.
            PlacementError: It is no container, the object does not fit, it is full, or the object did not stay.
            UnreachableError: The place is out of reach.
            CollisionError: Something is in the way.
        """
        arm = Manipulator(ctx)
        held = arm.require_held()
        vessel = arm.find(container)
        if vessel.kind not in _TAKES:
            remedy = "place_in fills bins and bowls" if vessel.kind in CONTAINER_KINDS else "use place_on"
            raise PlacementError(
                f"{container} is a {vessel.kind}, no open container; {remedy}",
                phase=Phase.CHECK,
                evidence=PlacementEvidence(object=held.id, target=container, reason="unsuitable"),
            )
        contents = [item for item in arm.start.objects if item.id not in (held.id, container) and inside(item, vessel)]
        spots = _spots(held, vessel, contents)
        if not spots:
            raise occupied(held.id, container, [item.id for item in contents])
        return place(
            arm,
            held,
            spots,
            skill=self.name,
            target=container,
            allowed=(container, *(item.id for item in contents)),
            check=lambda placed, scene: inside(placed, arm.find(container, scene)),
        )


def _spots(held: DetectedObject, vessel: DetectedObject, contents: list[DetectedObject]) -> list[Spot]:
    """Return where it fits, free floor first: low down where the hand fits, else dropped from the rim."""
    if vessel.kind == "bowl":
        radius, height = vessel.size
        # The square that fits into the round.
        half = np.full(2, radius / np.sqrt(2.0))
    else:
        half, height = np.array(vessel.size[:2]), vessel.size[2]
    low, high = bounds(held)
    room = half - float(np.max(high - low)) / 2.0 - 0.002
    if (room < 0.0).any():
        return []
    floor = vessel.pose.xyz[2] + CONTAINER_WALL
    rim = vessel.pose.xyz[2] + height
    yaw = turns(yaw_to_align(held.pose, vessel.pose))
    free, shared = [], []
    rotation = vessel.pose.rotation[:2, :2]
    for u in _GRID:
        for v in _GRID:
            xy = vessel.pose.position[:2] + rotation @ (np.array([u, v]) * 1.6 * room).clip(-room, room)
            spot_pose = Pose(xyz=(float(xy[0]), float(xy[1]), held.pose.xyz[2]), quat_xyzw=held.pose.quat_xyzw)
            crowded = any(gap(with_pose(held, spot_pose), item) < 0.004 for item in contents)
            at = (float(xy[0]), float(xy[1]))
            if not crowded:
                free.append(Spot(at, floor + _ABOVE_FLOOR, yaw))
            shared.append(Spot(at, rim + _ABOVE_RIM, yaw))
    return free + shared
