"""Monitor of the effects of finished calls: a tower may fall while the next block is fetched."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from robosandbox.types import ObservedScene, SkillCall
from robosandbox.values import frozen
from robosandbox.world.alternatives import Attempt
from robosandbox.world.contracts import Contract, find, lookup, lost
from robosandbox.world.facts import HELD, Fact
from robosandbox.world.predicate import View

# Metres; chosen as twice what perception and settling move an object that stands (REST_TOLERANCE): what a skill
# accepted is not to be undone by a rounding, while a block that fell is off by its own size.
_SLACK = 0.010


@frozen
class Effect:
    """Something that a call brought about.

    Attributes:
        call: Which one.
        fact: What it brought about.
        is_asked: Whether the call was not made because another one had failed.
    """

    call: SkillCall
    fact: Fact
    is_asked: bool = True

    @property
    def objects(self) -> list[str]:
        """Ids of what it is about, first what was moved for it."""
        return lookup(self.fact).objects(self.fact.arguments)


class Monitor:
    """The effects of an episode's calls that nothing done on purpose has changed since.

    What a way around a failure has changed, as a thing that was taken out of its bin again to make room, is owed at the end.
    """

    def __init__(self) -> None:
        self._standing: list[Effect] = []
        self._owed: list[Effect] = []
        self._held: str | None = None
        self._last: SkillCall | None = None

    def begin(self, scene: ObservedScene) -> None:
        """Take what the gripper holds before the first call."""
        self._held = scene.held

    def add(self, call: SkillCall, contract: Contract, *, is_detour: bool = False) -> None:
        """Take a call that has succeeded: it ends the effects on what it moved.

        Args:
            call: Which one.
            contract: What it promised; where that is nothing, all that the call names may have been moved.
            is_detour: It was made because another one had failed: what it undoes is still wanted at the end.
        """
        self._last = call
        if not contract.gives:
            self._forget({str(value) for value in call.arguments.values()})
            return
        gives = [gift.resolved({HELD: self._held}) for gift in contract.gives]
        moved = {*Contract(gives=tuple(gives)).moves}
        if is_detour:
            # Releasing an object that a later step places is no undone effect.
            wanted = [effect for effect in self._standing if effect.is_asked and effect.fact.relation != "holding"]
            self._owed += [effect for effect in wanted if moved & {*effect.objects}]
        else:
            self._owed = [effect for effect in self._owed if not moved & {*effect.objects}]
        self._forget(moved)
        for gift in gives:
            if lookup(gift).lasts and HELD not in gift.arguments:
                self._standing.append(Effect(call, gift, is_asked=not is_detour))
            if gift.relation == "holding":
                self._held = str(gift.arguments[0])
            elif gift.relation == "hand_empty":
                self._held = None

    def undone(self, look: Callable[[], ObservedScene], *, at_the_end: bool) -> Attempt | None:
        """Return the failure of the earliest call whose effect does not hold any more; it does not stand any longer.

        What remains after it are the later calls whose effects go with it when its object is moved.

        The last call's own has just been checked. While something is carried nothing is asked: it has to be put down first.
        """
        earlier = [effect for effect in self._standing if effect.call is not self._last]
        earlier = [*(self._owed if at_the_end else ()), *earlier]
        if not earlier or (self._held and not at_the_end):
            return None
        scene = look()
        view = View(scene=scene, before=scene, robot=View.of(scene).robot, slack=_SLACK)
        for effect in earlier:
            if any(scene.find(name) is None for name in effect.objects):
                continue
            # Another arm may have gone on since: what is held counts in whichever hand it is.
            held = replace(view, scene=replace(scene, hand=None)) if effect.fact.relation == "holding" else view
            finding = find(effect.fact, held)
            if finding.is_refuted:
                later = self._resting_on(effect)
                self._standing = [other for other in self._standing if other not in (effect, *later)]
                self._owed = [other for other in self._owed if other is not effect]
                error = lost(effect.fact, finding, view, by=str(effect.call)).failure
                again = tuple(other.call for other in later)
                return Attempt(completed=(), failed=effect.call, error=error, remaining=again)
        return None

    def _forget(self, moved: set[str]) -> None:
        self._standing = [effect for effect in self._standing if not moved & {*effect.objects}]

    def _resting_on(self, effect: Effect) -> list[Effect]:
        """Return the effects that go when an effect's object is moved again: of the later ones, and of what is owed of all."""
        moving, found = {effect.objects[0]}, []
        first = self._standing.index(effect) + 1 if effect in self._standing else 0
        for later in self._standing[first:]:
            if {*later.objects[1:]} & moving:
                moving.add(later.objects[0])
                found.append(later)
        return found
