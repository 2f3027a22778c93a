"""What stands against where a skill would put the hand, told by the planner before anything moves."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.errors import CollisionError, SkillError, UnreachableError
from robosandbox.evidence import CollisionEvidence
from robosandbox.protocols import SkillContext
from robosandbox.skills.primitives.manipulator import most_telling
from robosandbox.types import ObservedScene, Pose
from robosandbox.world.abilities import Obstruction

# Seeds of inverse kinematics for each pose; chosen as half of the planner's 60, as skills take where another pose is worth more.
_RESTARTS = 30


class Rehearsal:
    """Poses that a skill goes through on each of its ways, tried in a scene that may only be imagined.

    Only what any way through these poses would meet is told: the hand itself touching something there, or not getting there.
    Where a part of the arm touches something another posture may not, and nothing is said.

    Args:
        ctx: The robot.
        scene: Where things are thought to be; nothing is held.
        aperture: How far apart the fingers are, metres.
    """

    def __init__(self, ctx: SkillContext, scene: ObservedScene, aperture: float) -> None:
        self._planning = ctx.planning(scene)
        self._motion = ctx.motion
        self._state = ctx.sim.state()
        self._motion.use(self._planning, self._state)
        self._motion.open_to(aperture)
        self._failures: list[SkillError] = []

    def works(self, *poses: tuple[Pose, Sequence[str]]) -> bool:
        """Tell whether nothing stands against a way through TCP poses, each with what may be touched there."""
        q = self._state.q
        for pose, allowed in poses:
            try:
                q = self._motion.ik(pose, q, restarts=_RESTARTS)
            except UnreachableError as error:
                self._failures.append(error)
                return False
            self._motion.allow(*allowed)
            touch = self._motion.touch(q)
            if touch is not None and self._is_of_hand(touch):
                self._failures.append(touch)
                return False
        return True

    @property
    def obstruction(self) -> Obstruction | None:
        """What stood against the way that came closest to working; None where none was tried."""
        if not self._failures:
            return None
        failure = most_telling(self._failures)
        evidence = failure.evidence
        if not isinstance(evidence, CollisionEvidence):
            return Obstruction(cause="it is out of reach")
        met = evidence.other.partition("/")[0]
        return Obstruction(cause=f"{evidence.body} would touch {met}", met=met)

    def _is_of_hand(self, touch: CollisionError) -> bool:
        evidence = touch.evidence
        return isinstance(evidence, CollisionEvidence) and self._planning.is_of_hand(evidence.body)
