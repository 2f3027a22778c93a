"""Whether what a condition says is so: decided by what is seen, or not at all."""

from __future__ import annotations

from copy import deepcopy

from robosandbox.agent.language import match
from robosandbox.agent.language.discourse import RefusedError, listed
from robosandbox.agent.language.ground import Grounder
from robosandbox.agent.language.intent import Command, Ref, Relation, replace
from robosandbox.agent.language.materials import is_familiar
from robosandbox.agent.language.pushing import Pushing
from robosandbox.agent.language.things import KINDS_OF
from robosandbox.types import RefusalCode

_SIDES = frozenset({"left", "right", "front", "back"})
_STATES_OF = {"empty": match.CONTAINERS, "open": frozenset({"drawer"}), "closed": frozenset({"drawer"})}


class Deciding(Pushing):
    """Decides conditions in the world as it is when their turn comes."""

    def is_so(self, command: Command) -> bool:
        """Say whether what a command's condition tells is so, whatever follows from that.

        Raises:
            RefusedError: That cannot be seen; or what it is about is not there, or may be several things.
        """
        condition, subject = command.condition, command.subject
        if condition is None:
            return True
        if condition.unknown or any(relation.kind == "full" for relation in condition.relations):
            # That something is in it does not say that no more goes in.
            raise _unseen(condition)
        # What is looked at to decide is not yet spoken of.
        judge = _Judge(Grounder(self.world, deepcopy(self.ground.discourse), self.ground.chosen))
        if subject is None:
            so = judge.is_there(condition)
            spoken_of = [condition] if so and not command.unless else [
                ref for relation in condition.relations for ref in relation.refs
            ]  # fmt: skip
        elif subject.determiner == "it" and isinstance(command.place, Relation) and command.place.refs:
            so, spoken_of = judge.one_is(condition, (*command.objects, *command.place.refs)), []
        else:
            name = judge.ground.one(subject, lambda name: True).ids[0]
            so, spoken_of = judge.has_state(name, condition, subject), [condition] if not command.unless else [subject]
            spoken_of = spoken_of if so else [subject]
        for ref in spoken_of:
            self.ground.many(ref, lambda name: True)
        return so


class _Judge:
    """Looks at the world for what conditions say of it."""

    def __init__(self, ground: Grounder) -> None:
        self.ground, self.world = ground, ground.world

    def has_state(self, name: str, condition: Ref, subject: Ref) -> bool:
        """Say whether one thing has the colour, or stands in the relations, that a condition adds to its description."""
        item = self.world.objects[name]
        colours = condition.colours[len(subject.colours) :]
        if colours and match.colour_of(item) not in colours:
            if match.with_colour([item], colours):
                # It is called red and does not look it.
                raise _unseen(condition)
            return False
        return all(
            self._stands(name, relation, condition) for relation in condition.relations[len(subject.relations) :]
        )

    def one_is(self, condition: Ref, refs: tuple[Ref, ...]) -> bool:
        """As in "put the can in the crate if it is empty": said of the one thing that can be so, or true of all of them."""
        told: set[bool] = set()
        if not (condition.colours or any(ref.determiner == "it" for ref in refs)):
            kinds = [_STATES_OF.get(relation.kind, frozenset()) for relation in condition.relations]
            able = frozenset.intersection(*kinds) if kinds else frozenset()
            names = [name for ref in refs for name in self.ground.many(ref, lambda name: True).ids]
            able_names = [name for name in names if self.world.objects[name].kind in able]
            told = {self.has_state(name, condition, replace(condition, relations=())) for name in able_names}
        if len(told) != 1:
            raise RefusedError(RefusalCode.UNSUPPORTED, f"“{condition.text}”: which of the things is meant?")
        return told.pop()

    def is_there(self, condition: Ref) -> bool:
        """Say whether there is anything as a condition describes it, or as many as it says."""
        anything = condition.nouns == ("thing",) and not condition.colours
        names = list(self.world.objects) if anything else self._such(condition)
        for relation in condition.relations:
            self._looked_into(relation, condition)
            among = [name for name in names if self._stands(name, relation, condition)]
            if names and not among and not relation.refs:
                # Not on the table itself, but in or on something that stands on it.
                raise _unseen(condition)
            names = among
        if condition.number and len(names) > condition.number:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"“{condition.text}”: I see {listed(names)}.", names)
        return len(names) >= (condition.number or 1)

    def _such(self, condition: Ref) -> list[str]:
        """Return what a description may mean, wherever it is.

        Raises:
            RefusedError: A thing may be one, or may not.
        """
        every = replace(condition, determiner="all", plural=True, number=None, relations=())
        try:
            names = list(self.ground.many(every, lambda name: True).ids)
        except RefusedError as error:
            if error.refusal.code is not RefusalCode.OBJECT_NOT_FOUND:
                raise
            names = []
        names = [name for name in names if not match.is_only_shaped_so(condition.nouns, self.world.objects[name])]
        objects = self.world.objects
        kinds = {match.NOUN_CLASS.get(noun, noun) for noun in condition.nouns} & {*KINDS_OF}
        strange = [name for name in objects if self.world.movable(name) and not is_familiar(name)] if kinds else []
        doubtful = condition.nouns and all(
            match.noun_fit(noun, objects[name]) == match.LOOSE for name in names for noun in condition.nouns
        )
        if (names and doubtful and condition.nouns != ("thing",)) or (not names and strange):
            raise _unseen(condition)
        return names

    def _looked_into(self, relation: Relation, condition: Ref) -> list[str]:
        """Return what a relation is to; what is in a drawer that is shut cannot be seen."""
        anchors = [name for ref in relation.refs for name in self.ground.many(ref, lambda name: True).ids]
        holds_nothing = [name for name in anchors if self.world.objects[name].kind not in match.CONTAINERS]
        if relation.kind == "in" and (holds_nothing or any(self._shut(name) for name in anchors)):
            raise _unseen(condition)
        return anchors

    def _stands(self, name: str, relation: Relation, condition: Ref) -> bool:
        anchors = self._looked_into(relation, condition)
        if relation.kind == "empty" and self.world.objects[name].kind not in match.CONTAINERS:
            raise RefusedError(RefusalCode.UNSUPPORTED, f"I cannot see whether {name} is empty.", (name,))
        if relation.kind in ("empty", "holds", "lacks") and self._shut(name):
            raise _unseen(condition)
        so = self.ground.stands(name, relation, condition)
        if so and relation.kind == "beside" and not self.ground.side_by_side(name, anchors):
            # Near, but how near is next to it?
            raise _unseen(condition)
        if so and relation.kind in _SIDES and not self.ground.plainly_beside(name, relation.kind, anchors):
            # Farther ahead than it is to the left.
            raise _unseen(condition)
        return so

    def _shut(self, name: str) -> bool:
        return self.world.objects[name].shape.opens and name not in self.world.opened


def _unseen(condition: Ref) -> RefusedError:
    return RefusedError(RefusalCode.UNSUPPORTED, f"I cannot see whether “{condition.text}”.")
