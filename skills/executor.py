"""The one place where a skill is run: limits, needs, the verb itself, promises, side effects, repairs."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from robosandbox.errors import FaultError, Phase, SkillError
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.abilities import GripperAbilities
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import BEFORE, ObservedScene, SkillResult
from robosandbox.world.alternatives import FailedCall
from robosandbox.world.contracts import Contract, apply_effects, error_for, first_refuted, lost
from robosandbox.world.facts import fact
from robosandbox.world.operators import BoundCall
from robosandbox.world.predicate import View
from robosandbox.world.side_effects import disturbed

# How far a joint goes, rad or m, where the arm has moved; an arm that stands sways less.
_MOVED = 0.01


class Executor:
    """Runs bound calls in a context.

    Args:
        ctx: The world; its context for agents is who asks.
    """

    def __init__(self, ctx: SkillContext) -> None:
        self._ctx = ctx

    def perform(self, call: BoundCall[Skill]) -> SkillResult:
        """Carry out a call and hold it to its contract.

        Raises:
            SkillError: A limit forbids it, it lacks what it needs, it failed, or what it promises is not seen; with
                repairs that were tried on the twin.
        """
        ctx = self._ctx
        ctx.starts.append(ctx.driver.time)
        ctx.permit(call)
        before = ctx.look()
        contract = call.contract.resolved(before)
        stood = ctx.arm.state().q
        try:
            return self._kept(call, contract, before)
        except SkillError as error:
            ctx.doubt()
            repairs = error.repairs
            if not repairs and ctx.what_if:
                repairs = ctx.repairs_for(
                    FailedCall(call=call.call, error=error.failure, contract=contract, before=before, scene=ctx.look())
                )
            advice = ctx.advice_for(error.failure)
            said_already = error.message.endswith(advice)
            raise error.with_(message=error.message + ("" if said_already else advice), repairs=repairs) from error
        finally:
            # An arm that has been lost is told by what lost it.
            with suppress(SkillError):
                if np.abs(ctx.arm.state().q - stood).max(initial=0.0) > _MOVED:
                    ctx.poses[ctx.arm.name, BEFORE] = stood

    def _kept(self, call: BoundCall[Skill], contract: Contract, before: ObservedScene) -> SkillResult:
        """Run the skill between a look at what it needs and one at what it promises.

        Raises:
            SkillError: What it needs does not hold, it failed, or what it promises is not seen.
        """
        ctx = self._ctx
        if not contract.gives and not contract.keeps_hold:
            unsaid: SkillResult = call.skill.run(ctx, **call.arguments)
            self._check_robot()
            return unsaid
        require(ctx, contract, before)
        robot = GripperAbilities(ctx)
        result: SkillResult = call.skill.run(ctx, **call.arguments)
        after = ctx.look()
        self._check_robot()
        seen = View(scene=after, before=before, robot=robot)
        broken = first_refuted(contract.gives, seen)
        if broken is None:
            after_all = apply_effects(contract, before).hands
            kept = [(hand, held) for hand, held in before.hands.items() if after_all.get(hand) == held]
            several = len(before.hands) > 1
            holds = [fact("holding", held, *([hand] if several else [])) for hand, held in kept if held]
            broken = first_refuted(holds, seen)
        if broken is not None:
            raise lost(*broken, seen, by=call.skill.name)
        moved = disturbed(before, after, *contract.moves, *before.in_hands)
        return result.model_copy(update={"side_effects": (*result.side_effects, *moved)})

    def _check_robot(self) -> None:
        """Hear of the robot once more: what one that has failed meanwhile was last seen to have done is not what is so."""
        self._ctx.arm.state()
        if self._ctx.driver.fault:
            raise FaultError(f"{self._ctx.driver.fault}; whether it is done is not known", phase=Phase.VERIFY)


def require(ctx: SkillContext, contract: Contract, scene: ObservedScene) -> None:
    """Check that what a contract needs holds in a scene; skills do so again where it has changed under way.

    Raises:
        SkillError: Something that it needs does not hold.
    """
    view = View.of(scene, GripperAbilities(ctx))
    lacking = first_refuted(contract.resolved(scene).needs, view)
    if lacking is not None:
        raise error_for(*lacking, view)
