"""Place on: put what is held on top of something."""

from __future__ import annotations

from collections.abc import Iterator

from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.placing import occupied, place, taken_anew
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import SkillResult
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import HELD, Fact, fact
from robosandbox.world.placement_sampling import placements_on
from robosandbox.world.relations import on_top


class PlaceOn(Skill):
    """Put what is held on top of something."""

    name = "place_on"

    def contract(self, *, target: str) -> Contract:
        """Return what standing the held object on another needs and brings about."""
        return Contract(
            needs=(fact("has_gripper"), fact("holding", HELD), *needs_of_standing(HELD, target)),
            gives=(fact("on", HELD, target), fact("hand_empty")),
        )

    def alternatives(self, failed: FailedCall, *, target: str) -> Iterator[Alternative]:
        """Yield another grip on what is held."""
        del target
        yield from taken_anew(failed)

    def run(self, ctx: SkillContext, *, target: str) -> SkillResult:
        """Put the held object on top of another.

        Args:
            target: Id of the object to put it on.

        Raises:
            NotHoldingError: The gripper is empty.
            ObjectNotFoundError: The target is not seen.
            PlacementError: The target is round, has something on it, or the object did not stay.
            UnreachableError: The place is out of reach.
            CollisionError: Something is in the way.
        """
        arm = Manipulator(ctx)
        held = arm.held
        base = arm.find(target)
        spots, blocking = placements_on(held, base, arm.start.objects)
        if not spots:
            raise occupied(held.id, target, blocking)
        return place(
            arm,
            held,
            spots,
            skill=self.name,
            target=target,
            allowed=(target,),
            check=lambda placed, scene: on_top(placed, arm.find(target, scene)),
        )


def needs_of_standing(item: str, target: str) -> tuple[Fact, ...]:
    """Return what has to hold of a target for an object to be stood on it."""
    return (
        fact("distinct", item, target),
        fact("has_top", target),
        fact("supports", target),
        fact("accessible", target),
        fact("room_on", item, target),
        fact("reachable_over", item, target),
        fact("room_to_put_on", item, target),
    )
