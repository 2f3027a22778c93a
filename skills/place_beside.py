"""Place beside: put what is held on the table next to something."""

from __future__ import annotations

import numpy as np

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.protocols import SkillContext
from robosandbox.skills.base import Skill
from robosandbox.skills.manipulator import Manipulator
from robosandbox.skills.placing import occupied, place, table_spots
from robosandbox.types import SIDE_AXES, Array, DetectedObject, Side, SkillResult
from robosandbox.world.relations import BESIDE_GAP, beside, centre, support

_SHIFTS = (0.0, 0.02, -0.02, 0.04, -0.04)
_GAP_SHARES = (0.4, 0.55, 0.3, 0.7, 0.2)


class PlaceBeside(Skill):
    """Put what is held on the table next to something."""

    name = "place_beside"

    def run(self, ctx: SkillContext, *, target: str, side: Side) -> SkillResult:
        """Put the held object down next to another.

        Args:
            target: Id of the object that it is to stand beside.
            side: Which side, as the robot sees it; front is the side nearer to the robot.

        Raises:
            NotHoldingError: The gripper is empty.
            ObjectNotFoundError: The target is not seen.
            PlacementError: There is no room, or the object did not stay.
            UnreachableError: The place is out of reach.
            CollisionError: Something is in the way.
        """
        arm = Manipulator(ctx)
        held = arm.require_held()
        neighbour = arm.find(target)
        if neighbour.id == held.id:
            raise InvalidArgumentError(f"{self.name}: {target} cannot stand beside itself", phase=Phase.CHECK)
        spots, blocking = table_spots(arm, held, _points(held, neighbour, side))
        place_name = f"{side} of {target}"
        if not spots:
            raise occupied(held.id, place_name, blocking)
        return place(
            arm,
            held,
            spots,
            skill=self.name,
            target=place_name,
            allowed=("table",),
            check=lambda placed, scene: beside(placed, arm.find(target, scene), side),
        )


def _points(held: DetectedObject, neighbour: DetectedObject, side: Side) -> list[Array]:
    axis = np.array([*SIDE_AXES[side], 0.0])
    across = np.array([-axis[1], axis[0]])
    edge = float(support(neighbour, axis[None])[0] - axis @ centre(neighbour))
    half = float(support(held, -axis[None])[0] + axis @ centre(held))
    middle = centre(neighbour)[:2]
    distances = [edge + half + share * BESIDE_GAP for share in _GAP_SHARES]
    return [middle + axis[:2] * d + across * shift for shift in _SHIFTS for d in distances]
