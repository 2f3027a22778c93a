"""Relations of the gripper: what it holds and what it can take hold of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from robosandbox.errors import (
    AlreadyHoldingError,
    NotHoldingError,
    ObjectNotFoundError,
    Phase,
    SkillError,
    UnsupportedError,
)
from robosandbox.evidence import HoldingEvidence, ObjectNotFoundEvidence
from robosandbox.suggestions import did_you_mean
from robosandbox.types import ObservedScene
from robosandbox.world import parts
from robosandbox.world.containers import no_door_before
from robosandbox.world.covered import ways_out
from robosandbox.world.effects import taken
from robosandbox.world.facts import HELD, TABLE, Fact, fact
from robosandbox.world.predicate import Finding, View, is_clearly_seen, predicate, sentence
from robosandbox.world.relations import lies_in, mouth_of, on_table, room_of, stands_on

# How far under a drawer's cabinet the middle of a thing may lie and still be got out, metres; chosen as half a finger's
# thickness, by which fingers reach in.
_UNDER = 0.01


def _slipped(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    name = str(arguments[0])
    at = view.scene.find(name)
    where = f"it is at ({', '.join(f'{value:.2f}' for value in at.pose.xyz)})" if at else "it is not seen any more"
    return NotHoldingError(f"{name} is out of the hand: {finding.cause}, and {where}; pick it anew", phase=Phase.VERIFY)


def _not_holding(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    return NotHoldingError(sentence(finding), phase=Phase.CHECK, evidence=_evidence(view, arguments[1:]))


def _not_empty(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    return AlreadyHoldingError(sentence(finding), phase=Phase.CHECK, evidence=_evidence(view, arguments))


def _not_ready(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    evidence = _evidence(view, arguments[1:])
    if evidence.held is None:
        # Another hand holds it.
        evidence = evidence.model_copy(update={"held": str(arguments[0])})
    return AlreadyHoldingError(sentence(finding), phase=Phase.CHECK, evidence=evidence)


def _evidence(view: View, named: Sequence[Any]) -> HoldingEvidence:
    held = _held(view.scene, str(named[0]) if named else None)
    return HoldingEvidence(held=next(iter(held), None), aperture=view.robot.aperture)


def _held(scene: ObservedScene, hand: str | None) -> tuple[str, ...]:
    """Return what a hand holds: the one named, else the one that calls are made with, else any of several."""
    if hand is None and scene.hand is None:
        return tuple(held for held in scene.hands.values() if held is not None)
    held = scene.hands.get(hand or scene.hand or "")
    return () if held is None else (held,)


def _holder(scene: ObservedScene, hand: str | None) -> str:
    """Return what a hand is called in a sentence: the gripper, where there is one."""
    name = hand or scene.hand
    return f"the hand {name!r}" if name is not None and len(scene.hands) > 1 else "the gripper"


def _other_holder(scene: ObservedScene, name: str, hand: str | None) -> str | None:
    """Return the hand that holds an object, where it is another than the one named, or than the one that calls are made with."""
    hand = hand or scene.hand
    holders = (other for other, held in scene.hands.items() if held == name and other != hand)
    return None if hand is None else next(holders, None)


def _unknown(scene: ObservedScene, hand: str | None) -> Finding | None:
    """Return the finding for a hand that the robot has not."""
    if hand is None or hand in scene.hands:
        return None
    there = f"there is {', '.join(scene.hands)}" if scene.hands else "it has none"
    return Finding(
        holds=False, cause=f"the robot has no hand {hand[:60]!r}", help=f"{there}{did_you_mean(hand, scene.hands)}"
    )


def _unsupported(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    del view, arguments
    return UnsupportedError(sentence(finding), phase=Phase.CHECK)


def not_seen(scene: ObservedScene, name: str) -> Finding:
    """Return the finding for an object that is not seen."""
    seen = [item.id for item in scene.objects]
    if name == HELD:
        return Finding(holds=False, cause="the gripper is empty", help="pick something first")
    return Finding(
        holds=False,
        cause=f"no object {name[:60]!r} is seen",
        help=f"there is {', '.join(seen) or 'nothing'}{did_you_mean(name, seen)}",
    )


def not_seen_error(view: View, name: str) -> SkillError:
    """Return the error of a skill that is asked for an object which is not seen."""
    scene = view.scene
    finding = not_seen(scene, name)
    if name == HELD:
        return _not_holding(view, (), finding)
    return ObjectNotFoundError(
        sentence(finding),
        phase=Phase.PERCEIVE,
        evidence=ObjectNotFoundEvidence(query=name, seen=tuple(item.id for item in scene.objects)),
    )


def _put_down(held: Sequence[str]) -> tuple[Fact, ...]:
    return tuple(fact("on", name, TABLE) for name in held)


def _gripped(scene: ObservedScene, a: str, b: str) -> ObservedScene:
    del b
    return taken(scene, a)


@predicate("object")
def seen(view: View, a: str) -> Finding:
    """An object is seen; without that nothing else is asked of it."""
    return Finding(holds=True, is_sure=view.scene.find(a) is not None)


def stands(scene: ObservedScene, name: str) -> bool:
    """Tell whether a thing is seen to rest on the table or on another one."""
    item = scene.find(name)
    if item is None:
        return False
    others = (other for other in scene.objects if other.id != name)
    return on_table(item, scene.table_height).holds or any(stands_on(item, other) for other in others)


@predicate("object", "word?", effect=taken, lasts=True, last=True, blame=_not_holding, lost=_slipped)
def holding(view: View, a: str, hand: str | None = None) -> Finding:
    """A hand holds an object: the one named, else the one that calls are made with, else any."""
    if (unknown := _unknown(view.scene, hand)) is not None:
        return unknown
    held, holder = _held(view.scene, hand), _holder(view.scene, hand)
    now = f"{holder} holds {' and '.join(held)}" if held else f"{holder} is empty"
    named = () if hand is None else (hand,)
    return Finding(
        holds=a in held,
        # A hand that has closed on what still stands there may yet lose it: it is not known to carry it.
        is_sure=a not in held or not stands(view.scene, a),
        cause=now,
        help=f"pick {a} first",
        remedies=(fact("holding", a, *named),),
    )


@predicate("object", "object", effect=_gripped)
def gripped_for(view: View, a: str, b: str) -> Finding:
    """The hand holds an object so that it has room to put it on or into another; that is seen when it puts it there."""
    return Finding(holds=a in view.scene.in_hands, is_sure=False, cause=f"{a} is not held for {b}")


@predicate("word?", blame=_not_empty)
def hand_empty(view: View, hand: str | None = None) -> Finding:
    """A hand holds nothing: the one named, else the one that calls are made with, else none of them."""
    if (unknown := _unknown(view.scene, hand)) is not None:
        return unknown
    held = _held(view.scene, hand)
    cause = f"{_holder(view.scene, hand)} holds {' and '.join(held)}"
    return Finding(holds=not held, cause=cause, help="place it first", remedies=_put_down(held))


@predicate("object", "word?", blame=_not_ready)
def hand_ready(view: View, a: str, hand: str | None = None) -> Finding:
    """A hand is empty, or holds the object already, and no other hand does; which, as in `hand_empty`."""
    held = _held(view.scene, hand)
    if (other := _other_holder(view.scene, a, hand)) is not None:
        return Finding(
            holds=False, cause=f"{_holder(view.scene, other)} holds {a}", help="have that hand put it down first"
        )
    cause = f"{_holder(view.scene, hand)} holds {' and '.join(held)}"
    return Finding(holds=held in ((), (a,)), cause=cause, help="place it first", remedies=_put_down(held))


@predicate(fixed=True, blame=_unsupported)
def has_gripper(view: View) -> Finding:
    """The robot has a gripper."""
    return Finding(
        holds=view.robot.gripper,
        cause="the robot has no gripper in its sidecar, so it cannot hold things",
        help="it can push, tap and go home",
    )


@predicate("object", fixed=True)
def liftable(view: View, a: str) -> Finding:
    """An object is one thing that can be carried off, not many and not a piece of furniture."""
    item = view.get(a)
    if item.shape.is_granular:
        return Finding(
            holds=False,
            cause=f"{a} are {item.shape.name}: too many and too small for the gripper",
            help="pick what they are in, and pour",
        )
    return Finding(
        holds=not item.shape.opens and not item.is_fixed,
        cause=f"{a} is {item.shape.name}, which stays where it is",
        help="choose something that can be lifted",
    )


@predicate("object", "object", fixed=True)
def distinct(view: View, a: str, b: str) -> Finding:
    """Two arguments are not the same object."""
    del view
    return Finding(holds=a != b, cause=f"{b} cannot be its own target", help="choose another target")


@predicate("object")
def graspable(view: View, a: str) -> Finding:
    """The gripper can take hold of an object as it lies."""
    why = view.robot.ungraspable(view.get(a), view.scene)
    other = "narrower" if view.robot.cup is None else "with a wider flat face"
    return Finding(holds=why is None, cause=why or "", help=f"take something {other}, or push it")


@predicate("object")
def accessible(view: View, a: str) -> Finding:
    """No drawer's cabinet is over an object, and no door before it; an open side it is taken out by."""
    item = view.get(a)
    for drawer in view.others(a):
        if drawer.kind == "cupboard" and lies_in(item, drawer):
            ways = [(item, out) for out in ways_out(item, [drawer], drawer.size[2])]
            finding = no_door_before(view, drawer, ways)
            if not finding.holds:
                return finding
            continue
        # A cabinet is where its drawers are, and in none of them.
        if parts.is_part(drawer) and not item.is_fixed and lies_in(item, drawer):
            finding = parts.open_(view, drawer.id)
            if not finding.holds:
                return replace(finding, blocking=(drawer.id,), remedies=(fact("open", drawer.id),))
            continue
        if not drawer.shape.opens or item.shape.is_granular:
            continue
        local = drawer.pose.rotation.T @ (item.shape.centre(item) - drawer.pose.position)
        room = room_of(drawer)
        if room.margin(local) <= 0.0 or not 0.0 < float(local[2]) < drawer.size[2]:
            continue
        margin = mouth_of(drawer).margin(local) + _UNDER
        return Finding(
            holds=margin > 0.0,
            margin=margin,
            tolerance=_UNDER,
            is_sure=drawer.opening is not None and is_clearly_seen(item, drawer),
            cause=f"{a} is inside {drawer.id}, which is not open far enough",
            help=f"open {drawer.id} first",
            blocking=(drawer.id,),
            remedies=(fact("open", drawer.id),),
        )
    return Finding(holds=True)
