"""Repairs: what else would do, tried on the twin, a simulation of what is believed, before it is offered."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from robosandbox.errors import CancelledError, Repair, RoboSandboxError, SkillError
from robosandbox.types import ObservedScene
from robosandbox.world.alternatives import FailedCall
from robosandbox.world.operators import bind
from robosandbox.world.relations import moved
from robosandbox.world.workarounds import Calls, cheapest

if TYPE_CHECKING:
    from robosandbox.agent.context import AgentContext

_log = logging.getLogger(__name__)
# Repairs that are offered: the one that is taken, and another for where that fails as well.
_ENOUGH = 2
# Candidates that are tried at most: each costs some tenths of a second of planning where it cannot work.
_MOST_TRIED = 16
# Less than this an object is not taken to have been moved, metres; chosen as what the benchmarks count as disturbed.
_MOVED = 0.010


class _SpentError(RoboSandboxError):
    """The budget for roll-outs is used up."""


class _Budget:
    """A guard in copies of the world that ends the search when they have taken so many seconds together.

    Simulated seconds, so that the same failure gets the same answer on every machine.
    """

    def __init__(self, seconds: float, tick: float) -> None:
        self._left = seconds
        self._tick = tick

    def __call__(self) -> _SpentError | None:
        """Count a tick; return an error where it was one too many."""
        self._left -= self._tick
        return _SpentError() if self._left < 0.0 else None


def find_repairs(ctx: AgentContext, failed: FailedCall) -> tuple[Repair, ...]:
    """Return skill calls that bring about on the twin what the failed call promised.

    What moves the fewest other things there comes first, then what takes the least time. Candidates are tried one after
    another, the cheapest first, until some have succeeded or the context's budget of simulated seconds is spent. The live
    world is not touched.

    Args:
        ctx: Where it failed; the world as the failure left it.
        failed: What failed, and how.

    Raises:
        CancelledError: Somebody cancelled meanwhile.
    """
    budget: _Budget | None = None
    found: list[tuple[int, Repair]] = []
    for number, (calls, why) in enumerate(cheapest(failed, ctx.skills)):
        if len(found) >= _ENOUGH or number >= _MOST_TRIED:
            break
        with ctx.twin() as copy:
            budget = budget or _Budget(ctx.what_if_seconds, copy.driver.control_timestep)
            copy.driver.guards.append(budget)
            begin = copy.driver.time
            try:
                after = _rolled_out(copy, calls)
            except CancelledError:
                raise
            except _SpentError:
                break
            except SkillError as error:
                _log.debug("%s would fail too: %s", ", ".join(map(str, calls)), error)
                continue
            if failed.is_mended(after):
                cost, believed = round(copy.driver.time - begin, 3), not ctx.driver.capabilities.truth
                others = _moved(failed, after)
                found.append((others, Repair(calls=calls, why=why, cost=cost, believed=believed)))
    return tuple(repair for _, repair in sorted(found, key=lambda pair: (pair[0], pair[1].cost)))


def _rolled_out(copy: AgentContext, calls: Calls) -> ObservedScene:
    """Carry out calls in a copy of the world; return what is seen there then.

    Raises:
        SkillError: One of them failed.
    """
    for call in calls:
        copy.perform(bind(call, copy.skills))
    return copy.look()


def _moved(failed: FailedCall, after: ObservedScene) -> int:
    """Return how many things have moved that the call is not about."""
    pairs = ((item, after.find(item.id)) for item in failed.scene.objects if item.id not in failed.contract.objects)
    return sum(now is None or moved(item, now) > _MOVED for item, now in pairs)
