"""Repairs: what else would do, tried on the twin, a simulation of what is believed, before it is offered."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from robosandbox.agent.candidates import Calls, Candidates
from robosandbox.errors import CancelledError, ErrorCode, Repair, SkillError
from robosandbox.types import SkillCall

if TYPE_CHECKING:
    from robosandbox.agent.context import AgentContext

_log = logging.getLogger(__name__)
_ENOUGH = 2
_CURABLE = frozenset(
    {
        ErrorCode.UNREACHABLE,
        ErrorCode.COLLISION,
        ErrorCode.TRACKING,
        ErrorCode.GRASP,
        ErrorCode.ALREADY_HOLDING,
        ErrorCode.PLACEMENT,
        ErrorCode.PUSH,
        ErrorCode.TAP,
        ErrorCode.DRAWER,
        ErrorCode.POUR,
    }
)


class _SpentError(Exception):
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


def find_repairs(ctx: AgentContext, call: SkillCall, error: SkillError) -> tuple[Repair, ...]:
    """Return skill calls that reach the failed call's post-condition on the twin.

    What moves the fewest other things comes first, then what takes the least time.

    Candidates are made from the evidence, the likeliest first, and rolled out one after another until some have succeeded
    or the context's budget of simulated seconds is spent. The live world is not touched.

    Args:
        ctx: Where it failed; the world as the failure left it.
        call: What failed.
        error: How.

    Raises:
        CancelledError: Somebody cancelled meanwhile.
    """
    if error.code not in _CURABLE:
        return ()
    skills = ctx.skills
    budget: _Budget | None = None
    found: list[Repair] = []
    tried: list[Calls] = []
    for calls, why in Candidates(ctx.look(), call, error).all():
        if calls in tried or any(item.skill not in skills for item in calls):
            continue
        tried.append(calls)
        copy = ctx.twin()
        budget = budget or _Budget(ctx.what_if_seconds, copy.sim.control_timestep)
        copy.sim.guards.append(budget)
        begin = copy.sim.time
        try:
            for item in calls:
                skills[item.skill](copy, item.arguments)
        except CancelledError:
            raise
        except _SpentError:
            break
        except SkillError as failure:
            _log.debug("%s would fail too: %s", ", ".join(map(str, calls)), failure)
        else:
            cost, believed = round(copy.sim.time - begin, 3), not ctx.sim.capabilities.truth
            found.append(Repair(calls=calls, why=why, cost=cost, believed=believed))
        if len(found) >= _ENOUGH:
            break
    return tuple(sorted(found, key=lambda repair: (len(_handled(repair.calls) - _handled((call,))), repair.cost)))


def _handled(calls: Calls) -> set[object]:
    """Return what these calls pick up or push."""
    return {item.arguments["object"] for item in calls if "object" in item.arguments}
