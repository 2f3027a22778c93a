"""Open drawer: pull a drawer out by its grip."""

from __future__ import annotations

from collections.abc import Iterator

from robosandbox.errors import CollisionError, DrawerError, GraspError, SkillError, UnreachableError
from robosandbox.evidence import DrawerEvidence
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.drawers import (
    OPEN_SHARE,
    RESISTED,
    find_drawer,
    let_go,
    opening_of,
    outwards,
    slide,
    stuck,
    take_grip,
)
from robosandbox.skills.primitives.manipulator import Manipulator, most_telling
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import DetectedObject, SkillResult
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact

# Shares of its way that are tried, the most first; chosen so that a hand which cannot go all the way still opens it.
_SHARES = (0.98, 0.9, 0.8)
# Times that a grip which slipped is taken anew; chosen as in `pick`.
_ATTEMPTS = 3


class OpenDrawer(Skill):
    """Pull a drawer out by its grip."""

    name = "open_drawer"

    def contract(self, *, drawer: str) -> Contract:
        """Return what pulling a drawer open needs and brings about."""
        return Contract(
            needs=(
                fact("has_gripper"),
                fact("opens", drawer),
                fact("hand_empty"),
                fact("grip_fits", drawer),
                fact("may_press", RESISTED),
                fact("reachable", drawer),
                fact("room_to_open", drawer),
            ),
            gives=(fact("open", drawer),),
        )

    def alternatives(self, failed: FailedCall, *, drawer: str) -> Iterator[Alternative]:
        """Yield sliding it back first: what it presses on is free then."""
        if failed.had_begun and failed.met:
            why = f"{', '.join(failed.met)} jams {drawer} and is put aside first"
            yield Alternative(why=why, first=(fact("closed", drawer),), cleared=failed.met, call=failed.call)

    def run(self, ctx: SkillContext, *, drawer: str) -> SkillResult:
        """Pull a drawer open by its grip.

        Args:
            drawer: Id of the drawer.

        Raises:
            ObjectNotFoundError: It is not seen.
            InvalidArgumentError: It is no drawer.
            AlreadyHoldingError: The gripper is full.
            GraspError: The fingers are too narrow for the grip, or missed it.
            UnreachableError: The grip, or where it would go, is out of reach.
            CollisionError: Something is in the way.
            DrawerError: It is locked or blocked, or the hand slipped off.
        """
        arm = Manipulator(ctx)
        before = find_drawer(arm, drawer)
        enough = OPEN_SHARE * before.size[3]
        force, attempts = 0.0, 0
        now = before
        while opening_of(now) < enough:
            attempts += 1
            try:
                travel = _grip(arm, now)
            except GraspError:
                if attempts >= _ATTEMPTS:
                    raise
                let_go(arm, now)
                continue
            force = slide(arm, now, 0.0, travel, outwards(now))
            let_go(arm, now)
            pulled, now = now, arm.find(drawer, arm.settle(drawer))
            if opening_of(now) >= enough:
                break
            error = stuck(arm, now, pulled, enough, force)
            if attempts >= _ATTEMPTS or not _slipped(error):
                raise error
        return SkillResult(
            skill=self.name,
            detail={
                "drawer": drawer,
                "opening_mm": 1e3 * opening_of(now),
                "force_n": force,
                **({"already_open": True} if now is before else {}),
            },
        )


def _slipped(error: DrawerError) -> bool:
    return isinstance(error.evidence, DrawerEvidence) and error.evidence.reason == "slipped"


def _grip(arm: Manipulator, drawer: DetectedObject) -> float:
    """Take the grip where the hand can then pull furthest; return how far, metres."""
    failures: list[SkillError] = []
    for share in _SHARES:
        travel = share * drawer.size[3] - opening_of(drawer)
        try:
            take_grip(arm, drawer, travel)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
            continue
        return travel
    raise most_telling(failures)
