"""Put over: put what is held, which has a hole, over a post."""

from __future__ import annotations

from collections.abc import Iterator

from robosandbox.errors import Phase, PlacementError
from robosandbox.evidence import PlacementEvidence
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.placing import place, taken_anew
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import SkillResult
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import HELD, TABLE, fact
from robosandbox.world.rings import goes_around, placements_around


class PutOver(Skill):
    """Put what is held, which has a hole, over a post."""

    name = "put_over"
    words = Words(verbs=("thread it onto", "thread it over"), object="post", hand="any")

    def contract(self, *, post: str) -> Contract:
        """Return what putting the held object over a post needs and brings about."""
        return Contract(
            needs=(
                fact("has_gripper"),
                fact("holding", HELD),
                fact("distinct", HELD, post),
                fact("upright", post),
                fact("goes_over", HELD, post),
            ),
            gives=(fact("around", HELD, post), fact("hand_empty")),
        )

    def alternatives(self, failed: FailedCall, *, post: str) -> Iterator[Alternative]:
        """Yield another grip on what is held."""
        yield from taken_anew(failed)

    def run(self, ctx: SkillContext, *, post: str) -> SkillResult:
        """Bring the held object's hole over a post, come down around it and let go.

        Args:
            post: Id of the post.

        Raises:
            NotHoldingError: The gripper is empty.
            ObjectNotFoundError: The post is not seen.
            PlacementError: The post does not go through, or the object did not stay around it.
            UnreachableError: The post is out of reach.
            CollisionError: Something is in the way.
        """
        arm = Manipulator(ctx)
        held = arm.held
        spots = placements_around(held, arm.find(post), arm.start)
        if not spots:
            raise PlacementError(
                f"{post} does not go through {held.id}; choose another post",
                phase=Phase.PLAN,
                evidence=PlacementEvidence(object=held.id, target=post, reason="unsuitable"),
            )
        return place(
            arm,
            held,
            spots,
            skill=self.name,
            target=post,
            allowed=(TABLE,),
            check=lambda placed, scene: goes_around(placed, arm.find(post, scene)),
        )
