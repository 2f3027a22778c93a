"""Calls and plans that failed, and the alternatives that a skill declares beside its contract."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from robosandbox.errors import ErrorCode, Failure, Phase
from robosandbox.types import ObservedScene, SkillCall
from robosandbox.values import frozen
from robosandbox.world.contracts import Contract, first_refuted, lookup
from robosandbox.world.facts import Fact
from robosandbox.world.predicate import View

# Ends of a call that say nothing of the world.
NOT_OF_THE_WORLD = frozenset(
    {
        ErrorCode.REFUSED,
        ErrorCode.CANCELLED,
        ErrorCode.GOAL_TIMEOUT,
        ErrorCode.UNAVAILABLE,
        ErrorCode.INTERNAL,
        ErrorCode.FAULT,
        ErrorCode.TWIN,
        ErrorCode.BUSY,
        ErrorCode.FORBIDDEN,
    }
)
# Phases of a skill before anything moves.
BEFORE_MOVING = (Phase.CHECK, Phase.PERCEIVE, Phase.PLAN)


@frozen(kw_only=True)
class Attempt:
    """A plan that ended early.

    Attributes:
        completed: Its calls that reached their post-conditions.
        failed: The call that did not.
        error: How that failed.
        remaining: The calls after it, which were not begun.
    """

    completed: tuple[SkillCall, ...]
    failed: SkillCall
    error: Failure
    remaining: tuple[SkillCall, ...] = ()


@dataclass(frozen=True, kw_only=True)
class FailedCall:
    """A call that did not bring about what it promises.

    Attributes:
        call: Which one.
        error: How it failed.
        contract: What it needed and promised, of the things themselves.
        before: What was seen when it began.
        scene: What is seen now.
    """

    call: SkillCall
    error: Failure
    contract: Contract
    before: ObservedScene
    scene: ObservedScene

    @cached_property
    def met(self) -> tuple[str, ...]:
        """Ids of what touched or stood in the way, as the evidence says, but for what the call is about."""
        evidence = self.error.evidence
        names = () if evidence is None else evidence.met()
        # A part of a thing is named behind its id: "drawer/box".
        whole = dict.fromkeys(name.partition("/")[0] for name in names)
        return tuple(name for name in whole if self.scene.find(name) and name not in self.contract.objects)

    @property
    def is_hopeless(self) -> bool:
        """True where the cause is the thing, the gripper or nothing in the world, so that nothing done first can help."""
        evidence = self.error.evidence
        return self.error.code in NOT_OF_THE_WORLD or (evidence is not None and evidence.is_final)

    @property
    def had_begun(self) -> bool:
        """True where the robot had moved for it, or may have, so that another try begins from somewhere else."""
        # Of a sim that went away nobody knows how far it came.
        return self.error.code == ErrorCode.CONNECTION_LOST or self.error.phase not in BEFORE_MOVING

    @property
    def promises_a_change(self) -> bool:
        """True where it promises a change from how things were, which the same call would bring about once more."""
        known = [lookup(gift) for gift in self.contract.gives]
        return any(one.effect is not None and not one.lasts for one in known)

    def is_mended(self, scene: ObservedScene) -> bool:
        """Tell whether what the call promised holds in a scene, seen from when it began."""
        return (
            first_refuted(self.contract.gives, View(scene=scene, before=self.before, robot=View.of(scene).robot))
            is None
        )


@frozen(kw_only=True)
class Alternative:
    """Another way to what a failed call was to bring about.

    Attributes:
        why: In a clause, for the person.
        first: What is brought about first, one after the other, by whichever skills promise it.
        cleared: Ids of what is put aside then.
        elsewhere: Whether that goes to another place than the nearest with room, where the hand may not get to.
        call: What is called at last; None where the rest has brought it about already.
    """

    why: str
    first: tuple[Fact, ...] = ()
    cleared: tuple[str, ...] = ()
    elsewhere: bool = False
    call: SkillCall | None = None
