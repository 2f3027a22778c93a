"""Place beside: put what is held on the table next to something."""

from __future__ import annotations

from collections.abc import Iterator

from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.placing import occupied, place, taken_anew
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Side, SkillResult
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import HELD, fact
from robosandbox.world.placement_sampling import points_beside, table_placements
from robosandbox.world.relations import beside


class PlaceBeside(Skill):
    """Put what is held on the table next to something."""

    name = "place_beside"

    def contract(self, *, target: str, side: Side) -> Contract:
        """Return what standing the held object next to another needs and brings about."""
        return Contract(
            needs=(
                fact("has_gripper"),
                fact("holding", HELD),
                fact("distinct", HELD, target),
                fact("room_beside", HELD, target, side),
                fact("reachable_beside", HELD, target, side),
                fact("room_to_put_beside", HELD, target, side),
            ),
            gives=(fact("beside", HELD, target, side), fact("hand_empty")),
        )

    def alternatives(self, failed: FailedCall, *, target: str, side: Side) -> Iterator[Alternative]:
        """Yield another grip on what is held."""
        del target, side
        yield from taken_anew(failed)

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
        held = arm.held
        neighbour = arm.find(target)
        spots, blocking = table_placements(arm.start, held, points_beside(held, neighbour, side))
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
