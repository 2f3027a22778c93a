"""Foresight of a plan: what is taken to be put on or into a fixture is taken so that the hand has room there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from robosandbox.types import ObservedScene, SkillCall
from robosandbox.world.facts import HELD, Fact
from robosandbox.world.operators import BoundCall, Operator, bind


def with_grips(
    calls: Sequence[BoundCall], scene: ObservedScene, skills: Mapping[str, Operator]
) -> tuple[BoundCall, ...]:
    """Return the calls of a plan, those that take something for a fixture with where it is to go.

    Elsewhere nothing covers the place, and the thing is turned with the hand until both have room.
    """
    return tuple(_with_grip(call, calls[index + 1 :], scene, skills) for index, call in enumerate(calls))


def _with_grip(
    call: BoundCall, later: Sequence[BoundCall], scene: ObservedScene, skills: Mapping[str, Operator]
) -> BoundCall:
    takes = any(gift.relation == "holding" for gift in call.contract.gives)
    said = call.call.arguments
    if not takes or set(said) != {"object"} or "to" not in call.skill.schema.get("properties", {}):
        return call
    using = next((one for one in later if any(_is_held(need) for need in one.contract.needs)), None)
    goals = () if using is None else using.contract.gives
    goal = next((g for g in goals if g.relation in ("on", "inside", "around") and g.arguments[0] == HELD), None)
    item = None if goal is None else scene.find(str(goal.arguments[1]))
    if goal is None or item is None or not item.is_fixed:
        return call
    top = {"on": True} if goal.relation == "on" and item.shape.holds_things else {}
    return bind(SkillCall(skill=call.name, arguments={**said, "to": item.id, **top}), skills)


def _is_held(need: Fact) -> bool:
    return need.relation == "holding" and need.arguments[:1] == (HELD,)
