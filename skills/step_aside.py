"""Step aside: bring the arm to where it hides less from the cameras."""

from __future__ import annotations

import numpy as np

from robosandbox.errors import CollisionError, Phase, SkillError, UnreachableError
from robosandbox.perception.protocols import Uncovering
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import Array, SkillResult

# Rad between the turns of the arm's first joint that are looked at, and between those that are tried; how many of them are.
_STEP, _APART, _TRIES = np.pi / 12.0, np.pi / 5.0, 4
# Share of what the best turn shows that a smaller one has to show.
_NEARLY_ALL = 0.8
_CAMERAS = ("the camera", "the cameras", "your camera", "your cameras")
_NOTHING = "the arm hides nothing of the table that it could uncover"


class StepAside(HandMove):
    """Bring the arm to where it hides less of the table from the cameras."""

    name = "step_aside"
    words = Words(
        verbs=(
            *("step aside", "get out of view", "move out of view", "clear the view"),
            *(f"{get} out of the way of {cameras}" for get in ("get", "move", "go") for cameras in _CAMERAS),
            *(f"{get} out of {cameras} view" for get in ("get", "move", "go") for cameras in _CAMERAS),
            *(f"{clear} {cameras} view" for clear in ("clear", "free") for cameras in _CAMERAS),
        ),
    )

    def run(self, ctx: SkillContext) -> SkillResult:
        """Turn the arm, else at home, about its first joint to where fixed cameras see past it.

        Where a thing is half hidden there as well, it goes on to another turn, up to four.

        Raises:
            CollisionError: There is no free way to any such posture.
            UnreachableError: There is none on which what is held stays level.
            TrackingError: The arm did not arrive.
        """
        perception = ctx.perception
        if not isinstance(perception, Uncovering):
            return SkillResult(skill=self.name, found=_NOTHING)
        tried, blocked = list[float](), list[SkillError]()
        while len(tried) < _TRIES:
            arm = Mover(ctx)
            q = next(
                (q for q in _turns(ctx, arm, perception) if all(abs(q[0] - first) > _APART for first in tried)), None
            )
            if q is None:
                break
            tried.append(float(q[0]))
            try:
                way = arm.way_to(q)
            except (CollisionError, UnreachableError) as error:
                blocked.append(error)
                continue
            arm.follow(way, Phase.RETREAT)
            ctx.doubt()
            ctx.look()
            if not perception.half_hidden:
                break
        if tried and len(blocked) == len(tried):
            raise blocked[0]
        return SkillResult(
            skill=self.name, detail={"turns": len(tried) - len(blocked)}, found="" if tried else _NOTHING
        )


def _turns(ctx: SkillContext, arm: Mover, perception: Uncovering) -> list[Array]:
    """Return configurations (n,) in which the cameras see more of what is hidden, the best first."""
    spec, now = arm.spec, perception.uncovered(arm.driver, {})
    low, high = max(spec.lower[0], spec.home_q[0] - np.pi), min(spec.upper[0], spec.home_q[0] + np.pi)
    every = [np.array([first, *spec.home_q[1:]]) for first in np.arange(low, high, _STEP)]
    found = [(share, q) for q in every if (share := perception.uncovered(arm.driver, {ctx.arm.name: q})) > now]
    least = _NEARLY_ALL * max((share for share, _ in found), default=0.0)
    found.sort(key=lambda pair: (pair[0] < least, abs(float(pair[1][0] - arm.q[0])), -pair[0]))
    return [q for _, q in found]
