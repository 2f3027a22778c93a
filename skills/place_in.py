"""Place in: put what is held into a container."""

from __future__ import annotations

import numpy as np

from robosandbox.errors import Phase, PlacementError, PlacementEvidence
from robosandbox.perception.relations import BoxRoom, bounds, box_room, gap, inside
from robosandbox.protocols import SkillContext
from robosandbox.skills.base import Skill
from robosandbox.skills.drawers import check_open, mouth
from robosandbox.skills.manipulator import Manipulator
from robosandbox.skills.placing import Spot, occupied, place, turns, with_pose, yaw_to_align
from robosandbox.types import CONTAINER_WALL, ROUND_CONTAINERS, DetectedObject, Pose, SkillResult

_TAKES = ("bin", "bowl", "cup", "drawer")
# Where the hand does not fit down to the floor of a drawer it lets go higher up.
_DROPS = (0.1, 0.3, 0.5)
_GRID = (0.0, 0.5, -0.5)
_ABOVE_FLOOR = 0.002
_ABOVE_RIM = 0.004


class PlaceIn(Skill):
    """Put what is held into a container."""

    name = "place_in"

    def run(self, ctx: SkillContext, *, container: str) -> SkillResult:
        """Put the held object into a bin, bowl, cup or open drawer.

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
            raise PlacementError(
                f"{container} is a {vessel.kind}, no open container; use place_on",
                phase=Phase.CHECK,
                evidence=PlacementEvidence(object=held.id, target=container, reason="unsuitable"),
            )
        if vessel.kind == "drawer":
            check_open(vessel, held)
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
            # Into a drawer the hand goes down between walls, so it is led clear of them.
            allowed=() if vessel.kind == "drawer" else (container, *(item.id for item in contents)),
            check=lambda placed, scene: inside(placed, arm.find(container, scene)),
        )


def _spots(held: DetectedObject, vessel: DetectedObject, contents: list[DetectedObject]) -> list[Spot]:
    """Return where it fits, free floor first: low down where the hand fits, else dropped from the rim."""
    if vessel.kind in ROUND_CONTAINERS:
        radius, height = vessel.size
        # The square that fits into the round.
        opening = BoxRoom(np.zeros(2), np.full(2, radius / np.sqrt(2.0)), CONTAINER_WALL, height)
    else:
        opening = mouth(vessel) if vessel.kind == "drawer" else box_room(vessel)
    low, high = bounds(held)
    room = opening.half - float(np.max(high - low)) / 2.0 - 0.002
    if (room < 0.0).any():
        return []
    floor = vessel.pose.xyz[2] + opening.floor
    rim = vessel.pose.xyz[2] + opening.rim
    middle = opening.middle
    yaw = turns(yaw_to_align(held.pose, vessel.pose))
    free, shared = [], []
    rotation = vessel.pose.rotation[:2, :2]
    for u in _GRID:
        for v in _GRID:
            xy = vessel.pose.position[:2] + rotation @ (middle + (np.array([u, v]) * 1.6 * room).clip(-room, room))
            spot_pose = Pose(xyz=(float(xy[0]), float(xy[1]), held.pose.xyz[2]), quat_xyzw=held.pose.quat_xyzw)
            crowded = any(gap(with_pose(held, spot_pose), item) < 0.004 for item in contents)
            at = (float(xy[0]), float(xy[1]))
            if not crowded:
                free.append(Spot(at, floor + _ABOVE_FLOOR, yaw))
                if vessel.kind == "drawer":
                    free += [Spot(at, floor + share * (rim - floor), yaw) for share in _DROPS]
            shared.append(Spot(at, rim + _ABOVE_RIM, yaw))
    return free + shared
