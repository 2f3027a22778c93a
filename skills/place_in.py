"""Place in: put what is held into a container."""

from __future__ import annotations

from collections.abc import Iterator

from robosandbox.errors import ErrorCode
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.placing import occupied, opened_wide, place, spots_within, taken_anew, touched_within
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import DetectedObject, SkillCall, SkillResult
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import HELD, fact
from robosandbox.world.relations import MeasuredRelation, inside


class PlaceIn(Skill):
    """Put what is held into a container."""

    name = "place_in"

    def contract(self, *, container: str) -> Contract:
        """Return what putting the held object into a container needs and brings about."""
        return Contract(
            needs=(
                fact("has_gripper"),
                fact("holding", HELD),
                fact("distinct", HELD, container),
                fact("holds_things", container),
                fact("upright", container),
                fact("lets_in", HELD, container),
                fact("fits", HELD, container),
                fact("reachable_over", HELD, container),
            ),
            gives=(fact("inside", HELD, container), fact("hand_empty")),
        )

    def alternatives(self, failed: FailedCall, *, container: str) -> Iterator[Alternative]:
        """Yield opening what is not open to its end, another grip on what is held, or putting what has no room to spare in by feel."""
        yield from opened_wide(failed, container)
        yield from taken_anew(failed)
        if failed.error.code == ErrorCode.PLACEMENT and failed.scene.held is not None:
            by_feel = SkillCall(skill="insert", arguments={"container": container})
            yield Alternative(why=f"{failed.scene.held} is put into {container} by feel", call=by_feel)

    def run(self, ctx: SkillContext, *, container: str) -> SkillResult:
        """Put the held object into what holds things: a bin, bowl, cup, plate, tray or open drawer.

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
        held = arm.held
        vessel = arm.find(container)
        spots, within = spots_within(arm.start, held, vessel)
        if not spots:
            raise occupied(held.id, container, [item.id for item in within if not item.shape.is_granular])
        return place(
            arm,
            held,
            spots,
            skill=self.name,
            target=container,
            allowed=touched_within(vessel, within),
            check=lambda placed, scene: _in(placed, arm.find(container, scene)),
        )


def _in(placed: DetectedObject, vessel: DetectedObject) -> MeasuredRelation:
    """Tell whether something is in a container; a look that takes that for no container shows nothing of it."""
    return inside(placed, vessel) if vessel.shape.holds_things else MeasuredRelation(holds=False)
