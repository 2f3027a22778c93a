"""Place at: put what is held at a spot on the table."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.placing import occupied, place, taken_anew
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import DetectedObject, ObservedScene, SkillResult
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import HELD, TABLE, fact
from robosandbox.world.placement_sampling import table_placements
from robosandbox.world.relations import MeasuredRelation, centre, on_table
from robosandbox.world.standing import AT_TOLERANCE


class PlaceAt(Skill):
    """Put what is held at a spot on the table."""

    name = "place_at"

    def contract(self, *, x: float, y: float) -> Contract:
        """Return what putting the held object down at a point needs and brings about."""
        return Contract(
            needs=(
                fact("has_gripper"),
                fact("holding", HELD),
                fact("room_at", HELD, x, y),
                fact("reachable_at", HELD, x, y),
                fact("room_to_put_at", HELD, x, y),
            ),
            gives=(fact("at", HELD, x, y), fact("on", HELD, TABLE), fact("hand_empty")),
        )

    def alternatives(self, failed: FailedCall, *, x: float, y: float) -> Iterator[Alternative]:
        """Yield another grip on what is held."""
        del x, y
        yield from taken_anew(failed)

    def run(self, ctx: SkillContext, *, x: float, y: float) -> SkillResult:
        """Put the held object down at a point of the table.

        Args:
            x: World x, metres; forward from the robot.
            y: World y, metres; to the robot's left.

        Raises:
            NotHoldingError: The gripper is empty.
            PlacementError: The spot is off the table or occupied, or the object did not stay.
            UnreachableError: The spot is out of reach.
            CollisionError: Something is in the way.
        """
        arm = Manipulator(ctx)
        held = arm.held
        point = np.array([x, y])
        spots, blocking = table_placements(arm.start, held, [point])
        place_name = f"({x:.3f}, {y:.3f})"
        if not spots:
            raise occupied(held.id, place_name, blocking)

        def check(placed: DetectedObject, scene: ObservedScene) -> MeasuredRelation:
            off = float(np.linalg.norm(centre(placed)[:2] - point))
            standing = on_table(placed, scene.table_height)
            return MeasuredRelation(standing.holds and off < AT_TOLERANCE, {"off_mm": 1000.0 * off, **standing.detail})

        return place(arm, held, spots, skill=self.name, target=place_name, allowed=("table",), check=check)
