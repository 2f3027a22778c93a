"""Truth of conditions in the world as it is when their turn comes."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy

from robosandbox.agent.language import match
from robosandbox.agent.language.discourse import RefusedError, cannot_see, listed
from robosandbox.agent.language.ground import Grounder
from robosandbox.agent.language.intent import Ref, Relation, replace, unseen
from robosandbox.agent.language.logic import (
    Alike,
    Condition,
    Is,
    More,
    Not,
    Several,
    There,
    stripped,
)
from robosandbox.agent.language.materials import is_familiar
from robosandbox.agent.language.pushing import Pushing
from robosandbox.agent.language.things import KINDS_OF
from robosandbox.types import RefusalCode
from robosandbox.values import frozen

_SIDES = frozenset({"left", "right", "front", "back"})
_SPATIAL = _SIDES | {"beside", "between", "than", "opposite"}
_STATES_OF = {"empty": match.CONTAINERS, "open": frozenset({"drawer"}), "closed": frozenset({"drawer"})}
# Ratio up to which two measures count as one. Chosen: what cannot be told by eye.
_SHADE = 0.02


class NotYetError(Exception):
    """Only time can tell whether a condition holds."""


@frozen
class Finding:
    """Whether a condition holds, and what it speaks of.

    Attributes:
        holds: Whether it is so.
        spoken: The descriptions that "it" may refer back to afterwards.
    """

    holds: bool
    spoken: tuple[Ref, ...] = ()


class Deciding(Pushing):
    """Decides conditions in the world as it is when their turn comes."""

    def finding(self, condition: Condition) -> Finding:
        """Say whether a condition holds.

        Raises:
            RefusedError: That cannot be seen; or what it is about is not there, or may be several things.
            NotYetError: Steps of the plan decide it, in a way that nobody can foretell.
        """
        # What is looked at to decide is not yet spoken of.
        ground = Grounder(self.world, deepcopy(self.ground.discourse), self.ground.chosen)
        pushed = {str(s.call.arguments["object"]) for s in self.steps if s.call.skill == "push"}
        opened = {str(s.call.arguments["drawer"]) for s in self.steps if s.call.skill == "open_drawer"}
        return _Judge(ground, frozenset(pushed), frozenset(opened), frozenset(self.poured)).finding(condition)


class _Judge:
    """Looks at the world for what conditions say of it.

    Args:
        ground: Finds what descriptions mean.
        pushed: What has been pushed, nobody knows how far.
        opened: Drawers that have been opened, with nobody knows what in them.
        poured: What beads were poured out of.
    """

    def __init__(
        self, ground: Grounder, pushed: frozenset[str], opened: frozenset[str], poured: frozenset[str]
    ) -> None:
        self.ground, self.world = ground, ground.world
        self.pushed, self.opened, self.poured = pushed, opened, poured

    def finding(self, condition: Condition) -> Finding:
        match condition:
            case Not():
                inner, denied = stripped(condition)
                found = self.finding(inner)
                if not denied:
                    return found
                if isinstance(inner, There):
                    return Finding(not found.holds, () if found.holds else _anchors(inner.what))
                return Finding(not found.holds, found.spoken)
            case Several():
                findings = [self.finding(each) for each in condition.of]
                every = [found.holds for found in findings]
                return Finding(all(every) if condition.every else any(every), findings[0].spoken)
            case There():
                _readable(condition.what, condition)
                so, names = self.is_there(condition)
                positive = so and not condition.bound.none
                return Finding(so, _again(condition.what, names) if positive else _anchors(condition.what))
            case More():
                return Finding(self._more(condition))
            case Alike():
                return Finding(self._alike(condition))
            case Is():
                return self._is(condition)

    # What is there.

    def is_there(self, condition: There) -> tuple[bool, list[str]]:
        """Say whether there are so many things as a condition describes, and which there are."""
        bound = condition.bound
        count, names = self._number(condition.what, condition)
        plain = bound.none or (bound.least, bound.most) == (1, None)
        if bound.loose and count > bound.least:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"“{condition.text}”: I see {listed(names)}.", names)
        so = {
            each >= bound.least and (bound.most is None or each <= bound.most)
            for each in (count, *(self._otherwise_counted(condition.what, names, condition) if not plain else ()))
        }
        if len(so) > 1:
            raise _unseen(condition)
        return so.pop(), names

    def _more(self, condition: More) -> bool:
        ours, theirs = (
            {count, *self._otherwise_counted(ref, names, condition)}
            for ref in (condition.one, condition.other)
            for count, names in (self._number(ref, condition),)
        )
        signs = {"more": (1,), "fewer": (-1,), "as many": (0,)}[condition.sign]
        so = {(one > other) - (one < other) in signs for one in ours for other in theirs}
        if len(so) > 1:
            raise _unseen(condition)
        return so.pop()

    def _otherwise_counted(self, ref: Ref, names: list[str], condition: Condition) -> Iterator[int]:
        """Yield how many there are where a name is taken in its strict sense, and in its widest.

        As in "more than two cans", where one of three is called a tin; "more than five things", where two are bins.
        """
        objects = self.world.objects
        if not ref.nouns or any(objects[name].shape.is_granular for name in names):
            return
        if ref.nouns == ("thing",):
            yield sum(self.world.movable(name) for name in names)
            wide = [name for name in objects if not ref.colours or match.colour_of(objects[name]) in ref.colours]
        else:
            yield sum(any(match.noun_fit(noun, objects[name]) >= match.SYNONYM for noun in ref.nouns) for name in names)
            wide = self.ground.fitting(replace(ref, determiner="all", plural=True, number=None, relations=()))
        yield sum(all(self._stands(name, relation, condition) for relation in ref.relations) for name in wide)

    def _number(self, ref: Ref, condition: Condition) -> tuple[int, list[str]]:
        """Return how many things fit a description, each grain for one, and their ids."""
        _readable(ref, condition)
        anything = ref.nouns == ("thing",) and not ref.colours
        names = list(self.world.objects) if anything else self._such(ref, condition)
        for relation in ref.relations:
            self._looked_into(relation, condition)
            among = [name for name in names if self._stands(name, relation, condition)]
            if names and not among and not relation.refs and relation.kind in ("on", "in") and not self.world.put_in:
                # Not on the table itself, but in or on something that stands on it.
                raise _unseen(condition)
            names = among
        grains = [self.world.objects[name].grains for name in names if self.world.objects[name].shape.is_granular]
        if (grains and ref.nouns == ("bead",)) or any(len(each) for each in grains):
            if self.poured:
                raise NotYetError
            return len(names) - len(grains) + sum(map(len, grains)), names
        return len(names), names

    def _such(self, ref: Ref, condition: Condition) -> list[str]:
        """Return what a description may mean, wherever it is.

        Raises:
            RefusedError: A thing may be one, or may not.
        """
        every = ref if ref.determiner == "it" else replace(
            ref, determiner="all", plural=True, number=None, relations=()
        )  # fmt: skip
        try:
            names = list(self.ground.many(every, lambda name: True).ids)
        except RefusedError as error:
            if error.refusal.code is not RefusalCode.OBJECT_NOT_FOUND:
                raise
            names = []
        names = [name for name in names if not match.is_only_shaped_so(ref.nouns, self.world.objects[name])]
        objects = self.world.objects
        kinds = {match.NOUN_CLASS.get(noun, noun) for noun in ref.nouns} & {*KINDS_OF}
        strange = [name for name in objects if self.world.movable(name) and not is_familiar(name)] if kinds else []
        doubtful = ref.nouns and all(
            match.noun_fit(noun, objects[name]) == match.LOOSE for name in names for noun in ref.nouns
        )
        if (names and doubtful and ref.nouns != ("thing",)) or (not names and strange):
            raise _unseen(condition)
        return names

    # How it is.

    def _is(self, condition: Is) -> Finding:
        # That something is in it does not say that no more goes in.
        _readable(condition.so, condition)
        if condition.among:
            return Finding(self._one_is(condition))
        names = self.ground.many(condition.subject, lambda name: True).ids
        if len(names) > 1 and not (condition.subject.plural or condition.subject.determiner == "all"):
            names = self.ground.one(condition.subject, lambda name: True).ids
        so = [self._has(name, condition) for name in names]
        if any(so) != all(so) and condition.subject.determiner != "all":
            some = [name for name, each in zip(names, so, strict=True) if each]
            raise RefusedError(RefusalCode.AMBIGUOUS, f"“{condition.text}”: {listed(some)} only; what then?", some)
        own = condition.subject
        full = replace(
            own, relations=(*own.relations, *condition.so.relations), colours=(*own.colours, *condition.so.colours)
        )
        plain = not (
            condition.so.nouns or condition.so.ranks or any(r.kind in ("bare", "than") for r in condition.so.relations)
        )
        return Finding(all(so), (full,) if all(so) and plain and own.determiner != "it" else (own,))

    def _has(self, name: str, condition: Is) -> bool:
        """Say whether one thing is as a condition tells."""
        item, so = self.world.objects[name], condition.so
        if so.nouns and so.determiner == "a":
            return name in self._such(so, condition)
        if so.ranks:
            return name in self.ground.one(so, lambda other: True).ids
        if so.colours and match.colour_of(item) not in so.colours:
            if match.with_colour([item], so.colours):
                # It is called red and does not look it.
                raise _unseen(condition)
            return False
        return all(self._stands(name, relation, condition) for relation in so.relations)

    def _one_is(self, condition: Is) -> bool:
        """As in "put the can in the crate if it is empty": said of the one thing that can be so, or true of all of them."""
        told: set[bool] = set()
        refs = condition.among
        if not (condition.so.colours or any(ref.determiner == "it" for ref in refs)):
            kinds = [_STATES_OF.get(relation.kind, frozenset()) for relation in condition.so.relations]
            able = frozenset.intersection(*kinds) if kinds else frozenset()
            names = [name for ref in refs for name in self.ground.many(ref, lambda name: True).ids]
            told = {self._has(name, condition) for name in names if self.world.objects[name].kind in able}
        if len(told) != 1:
            raise RefusedError(RefusalCode.UNSUPPORTED, f"“{condition.text}”: which of the things is meant?")
        return told.pop()

    def _alike(self, condition: Alike) -> bool:
        names = [name for ref in condition.things for name in self.ground.many(ref, lambda name: True).ids]
        colours = {match.colour_of(self.world.objects[name]) for name in names}
        if len(names) < 2 or None in colours:
            raise _unseen(condition)
        return len(colours) == 1

    def _looked_into(self, relation: Relation, condition: Condition) -> list[str]:
        """Return what a relation is to; what is in a drawer that is shut cannot be seen."""
        anchors = [name for ref in relation.refs for name in self.ground.many(ref, lambda name: True).ids]
        holds_nothing = [name for name in anchors if not match.holds_things(self.world.objects[name])]
        if relation.kind == "in" and (holds_nothing or any(self._shut(name) for name in anchors)):
            raise _unseen(condition)
        if relation.kind == "in" and self.opened & {*anchors}:
            raise NotYetError
        return anchors

    def _stands(self, name: str, relation: Relation, condition: Condition) -> bool:
        if relation.kind == "than":
            return self._exceeds(name, relation, condition)
        if relation.kind == "there":
            raise _unseen(condition)
        if relation.kind == "bare":
            return not self.world.on_top_of(name)
        anchors = self._looked_into(relation, condition)
        if relation.kind in _SPATIAL and self.pushed & {name, *anchors}:
            raise NotYetError
        if relation.kind == "empty" and not match.holds_things(self.world.objects[name]):
            raise RefusedError(RefusalCode.UNSUPPORTED, f"I cannot see whether {name} is empty.", (name,))
        if relation.kind in ("empty", "holds", "lacks"):
            if self._shut(name):
                raise _unseen(condition)
            if name in self.opened:
                raise NotYetError
        if relation.kind in ("open", "closed") and not self.world.objects[name].shape.opens:
            raise RefusedError(RefusalCode.UNSUPPORTED, f"{name} neither opens nor closes.", (name,))
        so = self.ground.stands(name, relation, _described(condition))
        if so and relation.kind == "beside" and not self.ground.side_by_side(name, anchors):
            # Near, but how near is next to it?
            raise _unseen(condition)
        if so and relation.kind in _SIDES and not self.ground.plainly_beside(name, relation.kind, anchors):
            # Farther ahead than it is to the left.
            raise _unseen(condition)
        return so

    def _exceeds(self, name: str, relation: Relation, condition: Condition) -> bool:
        """As in "taller than the can", "closer to the bin than the ball"; too close to tell counts as neither."""
        other = self.ground.one(relation.refs[0], lambda each: True, (name,)).ids[0]
        anchors = [self.ground.one(ref, lambda each: True).ids[0] for ref in relation.refs[1:]]
        if relation.order in ("near", "far", "left", "right") and self.pushed & {name, other, *anchors}:
            raise NotYetError
        score = self.ground.measured([name, other], relation.order, *anchors)
        if abs(score[name] - score[other]) < _SHADE * max(map(abs, score.values())):
            raise _unseen(condition)
        return score[name] < score[other]

    def _shut(self, name: str) -> bool:
        return self.world.objects[name].shape.opens and name not in self.world.opened


def _again(ref: Ref, names: list[str]) -> tuple[Ref, ...]:
    """Return descriptions of what was found by one, as "it" and "them" refer back to it."""
    if ref.plural:
        return (replace(ref, determiner="all", number=None),)
    if ref.nouns == ("thing",) and len(names) == 1:
        return (Ref(text=names[0], names=(names[0],)),)
    return (ref,)


def _anchors(ref: Ref) -> tuple[Ref, ...]:
    return tuple(each for relation in ref.relations for each in relation.refs)


def _described(condition: Condition) -> Ref:
    match condition:
        case There():
            return condition.what
        case Is():
            return replace(condition.so, text=condition.text)
        case _:
            return Ref(text=condition.text)


def _readable(ref: Ref, condition: Condition) -> None:
    if unseen(ref):
        raise cannot_see(unseen(ref))
    if any(relation.kind == "full" for relation in ref.relations):
        raise _unseen(condition)


def _unseen(condition: Condition) -> RefusedError:
    return RefusedError(RefusalCode.UNSUPPORTED, f"I cannot see whether “{condition.text}”.")
