"""Symbolic state of a scene: what is on, in and beside what, what is open, what is held."""

from __future__ import annotations

from collections.abc import Iterator

from robosandbox.types import SIDE_AXES, ObservedScene
from robosandbox.values import frozen
from robosandbox.world.abilities import Abilities
from robosandbox.world.contracts import find
from robosandbox.world.facts import TABLE, Fact, fact
from robosandbox.world.predicate import Finding, View
from robosandbox.world.standing import standing_on


@frozen
class Stated:
    """Fact of the symbolic state.

    Attributes:
        fact: The relation and what it is between.
        finding: By how much it holds, and whether that is sure.
    """

    fact: Fact
    finding: Finding


def symbolic_state(scene: ObservedScene, robot: Abilities | None = None) -> tuple[Stated, ...]:
    """Return the relations that hold in a scene, or that may hold where what is seen does not settle it."""
    view = View.of(scene, robot)
    stated = (Stated(one, find(one, view)) for one in _candidates(view))
    return tuple(one for one in stated if one.finding.holds or not one.finding.is_sure)


def _candidates(view: View) -> Iterator[Fact]:
    scene = view.scene
    yield from _of_hands(scene)
    held = scene.in_hands
    for item in scene.objects:
        if item.shape.opens:
            yield from (fact("open", item.id), fact("closed", item.id))
        if item.shape.holds_things:
            yield fact("empty", item.id)
        if item.id in held:
            continue
        yield from (fact("inside", item.id, other.id) for other in view.others(item.id) if other.shape.holds_things)
        if item.shape.is_granular:
            continue
        yield fact("on", item.id, TABLE)
        yield from (fact("on", item.id, other.id) for other in view.others(item.id) if not other.shape.is_granular)
        yield fact("upright", item.id)
        if not standing_on(view, item.id):
            yield fact("clear", item.id)
        for other in view.others(item.id):
            if not other.shape.is_granular:
                yield from (fact("beside", item.id, other.id, side) for side in SIDE_AXES)


def _of_hands(scene: ObservedScene) -> Iterator[Fact]:
    """Yield what each hand holds; the only hand goes unnamed."""
    if len(scene.hands) < 2:
        yield fact("hand_empty") if scene.held is None else fact("holding", scene.held)
        return
    for hand, held in scene.hands.items():
        yield fact("hand_empty", hand) if held is None else fact("holding", held, hand)
