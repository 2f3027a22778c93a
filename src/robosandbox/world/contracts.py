"""Contracts: what a skill needs and what it brings about, in relations; what follows from them for one call."""

from __future__ import annotations

from collections.abc import Iterable

from robosandbox.errors import InputError, Phase, PlacementError, SkillError
from robosandbox.evidence import PlacementEvidence
from robosandbox.suggestions import did_you_mean
from robosandbox.types import ObservedScene
from robosandbox.values import frozen
from robosandbox.world.facts import HELD, Fact
from robosandbox.world.hand import not_seen, not_seen_error
from robosandbox.world.predicate import Finding, Predicate, View, predicates


@frozen(kw_only=True)
class Contract:
    """Preconditions and effects of a call of a skill.

    Attributes:
        needs: What has to hold before anything moves; what is told first is what a person should hear first.
        gives: What holds afterwards; where nothing is promised, all that the call names may be changed.
        keeps_hold: Whether what is held stays held, though nothing else is promised.
        rank: Place among calls that bring about the same, the lowest first: where exact ones fail, rough ones are tried.
    """

    needs: tuple[Fact, ...] = ()
    gives: tuple[Fact, ...] = ()
    keeps_hold: bool = False
    rank: int = 0

    def resolved(self, scene: ObservedScene) -> Contract:
        """Return the contract with what is held in a scene by its name."""
        names = {HELD: scene.held}
        return Contract(
            needs=tuple(need.resolved(names) for need in self.needs),
            gives=tuple(gift.resolved(names) for gift in self.gives),
            keeps_hold=self.keeps_hold,
            rank=self.rank,
        )

    @property
    def moves(self) -> tuple[str, ...]:
        """Ids of what it moves: the first object of each thing that it brings about."""
        return self._first_of_gifts(moving=True)

    @property
    def subjects(self) -> tuple[str, ...]:
        """Ids of what it moves or merely touches, as a tap does: the first object of all that it brings about."""
        return self._first_of_gifts(moving=False)

    def _first_of_gifts(self, *, moving: bool) -> tuple[str, ...]:
        found = dict[str, None]()
        for gift in self.gives:
            known = predicates().get(gift.relation)
            if known is not None and (known.effect is not None or not moving):
                found.update(dict.fromkeys(known.objects(gift.arguments)[:1]))
        return tuple(found)

    @property
    def objects(self) -> tuple[str, ...]:
        """Ids of all that it is about."""
        known = predicates()
        return tuple(
            dict.fromkeys(
                name
                for fact in (*self.needs, *self.gives)
                if fact.relation in known
                for name in known[fact.relation].objects(fact.arguments)
            )
        )


def lookup(fact: Fact) -> Predicate:
    """Return the relation that a fact names.

    Raises:
        InputError: There is none of that name, or it takes other arguments.
    """
    known = predicates()
    found = known.get(fact.relation)
    if found is None:
        names = sorted(name for name, one in known.items() if one.lasts)
        raise InputError(
            f"{fact}: no relation is called {fact.relation!r}; there is {', '.join(names)}"
            f"{did_you_mean(fact.relation, names)}"
        )
    least = sum(not kind.endswith("?") for kind in found.parameters)
    if not least <= len(fact.arguments) <= len(found.parameters):
        raise InputError(f"{fact}: {found.name} takes ({', '.join(found.parameters)})")
    for kind, value in zip(found.parameters, fact.arguments, strict=False):
        if (kind.rstrip("?") == "number") != isinstance(value, int | float):
            raise InputError(
                f"{fact}: {value!r} is no {kind.rstrip('?')}; {found.name} takes ({', '.join(found.parameters)})"
            )
    return found


def find(fact: Fact, view: View) -> Finding:
    """Return whether a fact holds in a view; an object that is not seen is a reason that it does not."""
    known = lookup(fact)
    for name in known.objects(fact.arguments):
        if view.scene.find(name) is None:
            return not_seen(view.scene, name)
    return known.test(view, *fact.arguments)


def first_refuted(facts: Iterable[Fact], view: View) -> tuple[Fact, Finding] | None:
    """Return the first of some facts that surely does not hold."""
    for fact in facts:
        finding = find(fact, view)
        if finding.is_refuted:
            return fact, finding
    return None


def error_for(fact: Fact, finding: Finding, view: View) -> SkillError:
    """Return the error of a skill that needs a fact which does not hold."""
    known = lookup(fact)
    missing = next((name for name in known.objects(fact.arguments) if view.scene.find(name) is None), None)
    if missing is not None:
        return not_seen_error(view, missing)
    return known.error(view, fact.arguments, finding)


def lost(promise: Fact, finding: Finding, view: View, *, by: str) -> SkillError:
    """Return the error for something that was brought about and is not seen, or not any more.

    Args:
        promise: What.
        finding: Why it does not hold.
        view: Where that was told.
        by: The call or the skill that brought it about.
    """
    known = lookup(promise)
    if known.lost is not None:
        return known.lost(view, promise.arguments, finding)
    subject = str(promise.arguments[0]) if promise.arguments else ""
    item = view.scene.find(subject)
    return PlacementError(
        f"{by} is to bring about {promise}, and {finding.cause}; look again and do it anew",
        phase=Phase.VERIFY,
        evidence=PlacementEvidence(
            object=subject,
            target=", ".join(map(str, promise.arguments[1:])),
            reason="missed",
            actual=None if item is None else item.pose,
            blocking=finding.blocking,
        ),
    )


def apply_effects(contract: Contract, scene: ObservedScene) -> ObservedScene:
    """Return the scene as a call would leave it that keeps what its contract promises."""
    for gift in contract.resolved(scene).gives:
        known = lookup(gift)
        if known.effect is not None:
            scene = known.effect(scene, *gift.arguments)
    return scene
