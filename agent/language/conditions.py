"""Conditions about what is there: "if there is no banana here", "if nothing is on the cube", "if the tray has a ball in it"."""

from __future__ import annotations

from abc import ABC
from typing import NamedTuple

from robosandbox.agent.language.intent import Command, Ref, Relation, replace
from robosandbox.agent.language.towers import Towers

_STILL = frozenset({"still", "already", "currently", "now"})
_POSTURES = frozenset({"standing", "sitting", "lying", "resting", "placed", "stacked", "left"})
_SEEN = tuple(
    tuple(phrase.split())
    for phrase in (
        "there is",
        "there are",
        "you see",
        "you find",
        "you spot",
        "you notice",
        "you can see",
        "you can find",
        "you can spot",
    )
)
_UNSEEN = tuple(
    tuple(phrase.split())
    for phrase in ("there is not", "there are not", "you do not see", "you do not find", "you can not see", "you can not find")
)  # fmt: skip
_INSIDE: dict[str, tuple[str, ...]] = {
    "in": ("in it", "inside it", "in there", "inside"),
    "on": ("on it", "on top of it", "on top"),
}
_THING = Ref(text="something", determiner="a", nouns=("thing",))


class Given(NamedTuple):
    """A condition, as far as the words go.

    Attributes:
        end: Where it ends.
        what: The thing that "it" means in the order itself; None leaves that to what was spoken of.
        there: The thing that "on it" or "in it" means there.
        condition: What has to be there, or the thing as it has to be.
        denied: It must not be there, or not be so.
        subject: The thing that a state is told of; None where the condition asks whether there is one.
    """

    end: int
    what: Ref | None
    there: Ref | None
    condition: Ref
    denied: bool = False
    subject: Ref | None = None


def under(command: Command, given: Given, *, unless: bool) -> Command | None:
    """Return a command that is done under a condition told before it; None if "it" is what must not be there."""
    denied = unless != given.denied
    it = bool(command.objects) and command.objects[0].determiner == "it"
    what = given.what
    if denied and given.subject is None:
        # "unless something is on the cube, tap it": the cube; but no ball that is not there can be tapped.
        what = given.there if given.condition.nouns == ("thing",) else None
        if it and what is None:
            return None
    objects = (what, *command.objects[1:]) if it and what else command.objects
    place = command.place
    there = given.there
    if given.subject is not None and it:
        # "if the can is not in the tray, put it there"
        around = [relation.refs for relation in given.condition.relations[len(given.subject.relations) :]]
        there = around[0][0] if len(around) == 1 and len(around[0]) == 1 else None
    if isinstance(place, Relation) and len(place.refs) == 1 and place.refs[0].determiner == "it" and there:
        if it and what == there:
            return None
        place = replace(place, refs=(there,))
    return replace(
        command, objects=objects, place=place, condition=given.condition, unless=denied, subject=given.subject
    )


def only_under(command: Command, given: Given, *, unless: bool) -> Command | None:
    """Return a command with the condition that follows it: "... unless there is something in it" is about the place named."""
    condition, subject = given.condition, given.subject
    inner = [relation for relation in condition.relations if relation.refs and relation.refs[0].determiner == "it"]
    if subject is None and inner:
        place = command.place
        if isinstance(place, Relation) and len(place.refs) == 1:
            named = place.refs[0] if {place.kind, inner[0].kind} in ({"in"}, {"on"}) else None
        else:
            named = command.objects[0] if len(command.objects) == 1 and not place else None
        if named is None or named.determiner == "it" or len(inner) != len(condition.relations):
            return None
        condition = replace(condition, relations=tuple(replace(relation, refs=(named,)) for relation in inner))
    elif condition.determiner == "it" and len(command.objects) == 1 and not command.place:
        # "close the drawer if it is open"
        subject = command.objects[0]
        relations = (*subject.relations, *condition.relations)
        colours = (*subject.colours, *condition.colours)
        condition = replace(subject, relations=relations, colours=colours, text=condition.text)
    return replace(command, condition=condition, unless=unless != given.denied, subject=subject)


class Conditions(Towers, ABC):
    """The rules for conditions about what there is."""

    def existence(self, i: int) -> list[Given]:
        """Return the readings at `i`, after "if", of what is there or is not: where, and what it is."""
        found: list[Given] = []
        for words, denied in (*((words, False) for words in _SEEN), *((words, True) for words in _UNSEEN)):
            if self.text(i) == words[0] and tuple(map(self.text, range(i, i + len(words)))) == words:
                for j, ref, none in self._something(self._after_still(i + len(words))):
                    if not (denied and none):
                        none = denied or none
                        text = " ".join(self.texts[i:j]) if none else ""
                        j += self.text(j) in ("anywhere", "around")
                        found += self._there(j, ref, denied=none, text=text)
        for j, ref, none in self._something(i):
            # "nothing is on the cube", "no ball is in the tray"
            k = self._after_still(j + 1)
            k += self.text(k) in _POSTURES
            for end, relation in self.relation(k) if self.text(j) in ("is", "are") and not ref.relations else ():
                if relation.refs and not relation.directional:
                    found += self._there(
                        end, replace(ref, relations=(relation,)), denied=none, text=" ".join(self.texts[i:end])
                    )
        found += self._having(i)
        return found

    def _after_still(self, i: int) -> int:
        return i + 1 if self.text(i) in _STILL else i

    def _something(self, i: int) -> list[tuple[int, Ref, bool]]:
        """As in "a ball", "nothing", "no ball": where it ends, what it is, and whether there has to be none."""
        if self.text(i) in ("nothing", "something", "anything"):
            none = self.text(i) == "nothing"
            found = [(i + 1, replace(_THING, text=self.said(i, i + 1)), none)]
            k = self._after_still(i + 1)
            k += self.text(k) in _POSTURES
            return found + [
                (j, replace(_THING, text=self.said(i, j), relations=(relation,)), none)
                for j, relation in self.relation(k)
                if relation.refs and not relation.directional
            ]
        none = self.text(i) == "no"
        return [
            (j, ref, none)
            for j, ref in self.np(i + none)
            if (ref.nouns or ref.names)
            and ref.determiner in (("bare",) if none else ("a",))
            and not (ref.unknown or ref.options or ref.claims or ref.other or ref.one or ref.ranks)
            and (ref.number is None or not none)
        ]

    def _there(self, j: int, ref: Ref, *, denied: bool, text: str = "") -> list[Given]:
        condition = replace(ref, determiner="a", plural=False, text=text or ref.text)
        thing = ref.nouns == ("thing",) and not ref.colours
        anchors = [relation.refs for relation in ref.relations]
        anchor = anchors[0][0] if len(anchors) == 1 and len(anchors[0]) == 1 else None
        if thing and anchor is None:
            # "if there is nothing": where?
            return []
        single = not (thing or denied or ref.plural or ref.number)
        what = replace(ref, determiner="the") if single else None
        return [Given(j, what, anchor if thing or denied else None, condition, denied)]

    def _having(self, i: int) -> list[Given]:
        """As in "the tray has nothing in it", "the cube has something on top", "the bowl contains a ball"."""
        found: list[Given] = []
        for j, holder in self.np(i) if not {"has", "contains", "holds"}.isdisjoint(self.texts) else ():
            if self.text(j) not in ("has", "contains", "holds") or holder.unknown or holder.plural:
                continue
            for k, ref, none in self._something(self._after_still(j + 1)):
                ends = [(k, "in")] if self.text(j) != "has" else []
                ends += [
                    (k + len(words), kind)
                    for kind, phrases in _INSIDE.items()
                    for words in map(str.split, phrases)
                    if self.texts[k : k + len(words)] == words
                ]
                for end, kind in ends if not ref.relations else ():
                    inside = replace(ref, relations=(Relation(kind, (holder,)),))
                    found += self._there(end, inside, denied=none, text=" ".join(self.texts[i:end]))
        return found

    def closed_off(self, j: int) -> bool:
        """Say whether a condition may end at `j`: at a mark, "then", or where an order begins."""
        return (
            self._skip(j) > j
            or self.text(j) == "then"
            or (j < self.count and "VERB" in self.tags[j])
            or j >= self.count
        )
