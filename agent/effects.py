"""What finished calls brought about, and whether it still holds: a tower may fall while the next block is fetched."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from robosandbox.errors import NotHoldingError, Phase, PlacementError, SkillError
from robosandbox.evidence import HoldingEvidence, PlacementEvidence
from robosandbox.types import DetectedObject, ObservedScene, SkillCall
from robosandbox.world.relations import Relation, beside, centre, inside, on_top

# Looser than the skills' own checks: what one of them accepted is not to be undone by a rounding.
_PLACED = 0.025
_HANDLING = ("object", "drawer")

Check = Callable[[DetectedObject, ObservedScene], Relation | None]


@dataclass(frozen=True, slots=True)
class Effect:
    """Something that a call brought about.

    Attributes:
        call: Which one.
        object: The object that it is about.
        target: What that is on, in or beside; "table", or None where it is held.
        holds: Tells whether it holds in a scene; None where that cannot be seen.
    """

    call: SkillCall
    object: str
    target: str | None
    holds: Check


@dataclass(frozen=True, slots=True)
class Undone:
    """An effect that does not hold any more.

    Attributes:
        call: The call whose effect it was.
        error: The failure that it is now.
        to_repeat: Later calls whose effects go with it when its object is moved.
    """

    call: SkillCall
    error: SkillError
    to_repeat: tuple[SkillCall, ...]


class Effects:
    """The effects of an episode's calls that nothing done on purpose has changed since."""

    def __init__(self) -> None:
        self._standing: list[Effect] = []
        self._held: str | None = None
        self._last: SkillCall | None = None

    def begin(self, scene: ObservedScene) -> None:
        """Take what the gripper holds before the first call."""
        self._held = scene.held

    def add(self, call: SkillCall) -> None:
        """Take a call that has succeeded: it ends the effects on what it moved."""
        self._last = call
        moved = {str(call.arguments[key]) for key in _HANDLING if key in call.arguments}
        if call.skill.startswith("place_") and self._held:
            moved.add(self._held)
        self._standing = [e for e in self._standing if not moved & {e.object, e.target}]
        effect = self._effect(call)
        if effect is not None:
            self._standing.append(effect)
        if call.skill == "pick":
            self._held = str(call.arguments.get("object"))
        elif call.skill.startswith("place_"):
            self._held = None

    def undone(self, look: Callable[[], ObservedScene], *, at_the_end: bool) -> Undone | None:
        """Return the earliest effect that does not hold any more; it does not stand any longer.

        The last call's own has just been checked. While something is carried nothing is asked: it has to be put down first.
        """
        earlier = [effect for effect in self._standing if effect.call is not self._last]
        if not earlier or (self._held and not at_the_end):
            return None
        scene = look()
        for effect in earlier:
            item = scene.find(effect.object)
            relation = effect.holds(item, scene) if item is not None else None
            if relation is not None and not relation.holds:
                later = self._resting_on(effect)
                self._standing = [other for other in self._standing if other not in (effect, *later)]
                return Undone(effect.call, _error(effect, scene), tuple(other.call for other in later))
        return None

    def _resting_on(self, effect: Effect) -> list[Effect]:
        moving, found = {effect.object}, []
        for later in self._standing[self._standing.index(effect) + 1 :]:
            if later.target in moving:
                moving.add(later.object)
                found.append(later)
        return found

    def _effect(self, call: SkillCall) -> Effect | None:
        """Return what a call brought about, if that can be seen and is to last."""
        match call.skill, call.arguments:
            case "pick", {"object": str(name)}:
                return Effect(call, name, None, lambda item, scene: Relation(scene.held == item.id))
            case "stack", {"object": str(name), "target": str(target)}:
                return Effect(call, name, target, lambda item, scene: _with(on_top, item, target, scene))
        if self._held is None:
            return None
        match call.skill, call.arguments:
            case "place_on", {"target": str(target)}:
                return Effect(call, self._held, target, lambda item, scene: _with(on_top, item, target, scene))
            case "place_in", {"container": str(target)}:
                return Effect(call, self._held, target, lambda item, scene: _with(inside, item, target, scene))
            case "place_beside", {"target": str(target), "side": side}:
                next_to = partial(beside, side=side)
                return Effect(call, self._held, target, lambda item, scene: _with(next_to, item, target, scene))
            case "place_at", {"x": float(x), "y": float(y)}:
                return Effect(
                    call,
                    self._held,
                    "table",
                    lambda item, scene: Relation(math.dist(centre(item)[:2], (x, y)) < _PLACED),
                )
        return None


def _error(effect: Effect, scene: ObservedScene) -> SkillError:
    if effect.target is None:
        return NotHoldingError(
            f"{effect.object} was picked up and is no longer in the gripper; pick it again",
            phase=Phase.VERIFY,
            evidence=HoldingEvidence(held=scene.held, aperture=0.0),
        )
    seen = scene.find(effect.object)
    return PlacementError(
        f"{effect.object} was put where it belongs ({effect.call}) and is not there any more; place it anew",
        phase=Phase.VERIFY,
        evidence=PlacementEvidence(
            object=effect.object, target=effect.target, reason="missed", actual=seen.pose if seen else None
        ),
    )


def _with(
    relation: Callable[[DetectedObject, DetectedObject], Relation],
    item: DetectedObject,
    target: str,
    scene: ObservedScene,
) -> Relation | None:
    other = scene.find(target)
    return relation(item, other) if other is not None else None
