"""Wishes: what should be where, told by the end and not by the deed."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property

from robosandbox.agent.language.chart import Found
from robosandbox.agent.language.clauses import Clauses, Element
from robosandbox.agent.language.frames import frame_command
from robosandbox.agent.language.intent import Command, Ref, Relation, replace
from robosandbox.agent.language.match import NOUN_CLASS
from robosandbox.agent.language.tokens import MARKS, id_parts
from robosandbox.agent.language.verbs import BASE_FORMS

_MODALS = frozenset({"should", "must", "can", "could", "shall", "will", "may"})
_MODALS_TO = frozenset({"needs to", "need to", "has to", "have to", "ought to", "is to", "are to"})
_HOLDS = frozenset({"has", "contain", "hold", "have", "get", "receive", "contains", "containing", "holding", "with"})
_UNDERGONE = frozenset({"put", "move", "stack", "tap", "push", "pour"})
_PASSIVE = frozenset({"is", "are", "been", "gets"})
_HAS_BEEN = frozenset({"has been", "have been", "is safely", "is all"})
_BY_DOING = frozenset({"tidy", "clean", "discard", "empty", "build", "sort", "move", "put", "relocate"})
_GOES = frozenset({"go", "sit", "stand", "rest", "be", "come", "lie", "end"})


class Wishes(Clauses, ABC):
    """The rules for wishes."""

    @abstractmethod
    def _asks_for(self, i: int) -> bool:
        """Say whether "if there is a ball" is said; `Commands` knows how."""

    @abstractmethod
    def _verb_first(self, i: int) -> Found[Command]:
        """A command that begins with its verb; `Commands` knows how."""

    @cached_property
    def skips(self) -> list[int]:
        """The next token that is no mark, by position."""
        ends = [self.count]
        for text in reversed(self.texts):
            k = self.count - len(ends)
            ends.append(ends[-1] if text in MARKS else k)
        return ends[::-1]

    def _skip(self, i: int) -> int:
        return self.skips[i] if i < self.count else i

    def _asks(self, i: int) -> bool:
        """Say whether a verb asks for something: "pick", and "picking" or "picked" where what precedes makes it so."""
        if self.text(i) in BASE_FORMS:
            return True
        asked = self.text(i - 1) in ("have", "having", "got") or (self.text(i - 1) == "you" and i > 1)
        return i > 0 and (self.text(i).endswith("ing") or asked)

    def _wish(self, i: int) -> Found[Command]:
        """As in "I want the red cube in the bin", "make sure the can is on the tray", "the red cube goes in the bin"."""
        found: Found[Command] = []
        if self.text(i) in ("can", "could"):
            # "could the can go in the bin?"
            for j, refs in self.np_list(i + 1):
                found += self._placed_there(refs, j + 1) if self.text(j) in _GOES else []
        starts = [end for end, _ in self.tag(i, "DESIRE")]
        for start in starts:
            # "I want to see a tower of the cubes"
            for end, elements in self.elements(start):
                if elements and elements[0].kind == "objects" and elements[0].value[0].nouns[:1] == ("tower",):
                    found += [(end, command) for command in frame_command("build", elements)]
        for start in [*starts, i]:
            for j, refs in self.np_list(start):
                lead = refs[0]
                found += self._holding(refs, j, wished=start > i)
                found += self._belonging(refs, j)
                aside = j + 1 if len(refs) > 1 and self.text(j) in (",", "all", "both", "each") else j
                copulas = [end for m in {j, aside} for end, _ in self.tag(m, "COPULA")]
                k = j + 1 if self.text(j) in (*_MODALS, "to") else j + 2 if self.said(j, j + 2) in _MODALS_TO else j
                found += [
                    # "the can and the tin should trade places", "I'd like the markers to swap"
                    (end, command)
                    for m, verb in self.tag(k, "VERB")
                    if verb == "swap" and (k > j or start > i or self.text(m - 1) in ("places", "positions"))
                    for end, elements in self.elements(m)
                    for command in frame_command(verb, (spoken(refs), *elements))
                ]
                if lead.text.startswith("anything else") or (
                    lead.text.startswith("anything") and self.text(j) in _MODALS
                ):
                    # "anything but the apple can go in the bin" allows, and "before you do anything else, ..." says when.
                    continue
                if start > i:
                    # "make sure the can is on the tray"; alone, "the can is on the tray" asks for nothing.
                    copulas += [end for end, _ in self.tag(j, "IS_NOW")]
                if start > i:
                    # "I would like the salt a bit further to the left"
                    found += [
                        (end, command)
                        for end, elements in self.elements(j)
                        if {"direction"} <= {e.kind for e in elements} <= {"direction", "distance"}
                        # "may I have the can back" is no push.
                        and self.said(j, end) != "back"
                        for command in frame_command("push", (spoken(refs), *elements))
                    ]
                for k in copulas + ([j] if start > i else []):
                    for m, verb in self.tag(k, "VERB"):
                        # "I need the red cube picked up", "... to be put in the bin".
                        if verb == "swap" or self.text(k).endswith(("ed", "en", "t", "ng", "d")):
                            for end, elements in self.elements(m):
                                objects = spoken(refs)
                                found += [(end, c) for c in frame_command(verb, (objects, *elements))]
                    found += self._placed_there(refs, k)
                    if start > i and k == j and self.text(j) == ",":
                        # "I need the soup can, in the yellow crate"
                        there = self._placed_there(refs, j + 1)
                        found += [hit for hit in there if getattr(hit[1].place, "kind", "") in ("in", "on")]
                    if self.text(k - 1) in ("goes", "go"):
                        found += self._run_on(refs, k)
        return found

    def _holding(self, refs: tuple[Ref, ...], i: int, *, wished: bool) -> Found[Command]:
        """As in "the tray should contain the ball": the container is named first."""
        k = i + 1 if self.text(i) in (*_MODALS, "to") else i + 2 if self.said(i, i + 2) in _MODALS_TO else i
        held = self.text(k)
        plain = held in ("gets", "receives")
        if held == "with" and k > i:
            # "the short can with it" says no "can".
            return []
        if len(refs) != 1 or not (plain or (held in _HOLDS and (k > i or wished))):
            return []
        found: Found[Command] = []
        for j, objects in self.np_list(k + 1):
            if any(part.determiner == "it" for ref in objects for where in ref.relations for part in where.refs):
                continue
            if self.text(j) == "on" and self.text(j + 1) in ("it", "top"):
                found.append((j + 2, Command("put", objects, Relation("on", refs), bare=0.3)))
            ends = [j + 1] if self.text(j) in ("inside", "in") else []
            ends += [j + 2] if self.said(j, j + 2) in ("in it", "inside it") else []
            found += [(end, Command("put", objects, Relation("in", refs), bare=0.3)) for end in (*ends, j)]
        return found

    def _belonging(self, refs: tuple[Ref, ...], i: int) -> Found[Command]:
        """As in "the bin is where the ball belongs", "the ball's place is in the bin"."""
        found: Found[Command] = []
        if self.said(i, i + 2) in ("is for", "are for"):
            # "the ball is for the bin"
            found += [
                (j, Command("put", refs, Relation("in", where), bare=0.6))
                for j, where in self.np_list(i + 2)
                if self._named_container(where) and not self._named_container(refs)
            ]
        return found

    def _by_doing(self, i: int) -> Found[Command]:
        """As in "clean up the toys by putting them in the box", "clear the table by putting everything in the bin"."""
        found: Found[Command] = []
        for j, verb in self.tag(i, "VERB") if self._asks(i) else []:
            if verb not in _BY_DOING:
                continue
            for k, element in self.element(j):
                if self.text(k) != "by" or not self.text(k + 1).endswith("ing"):
                    continue
                for end, command in self._verb_first(k + 1):
                    if not command.objects or command.verb not in ("put", "stack"):
                        continue
                    it = command.objects[0].determiner == "it"
                    if it and element.kind == "objects":
                        found.append((end, replace(command, objects=(*element.value, *command.objects[1:]))))
        return found

    def _accomplished(self, i: int) -> Found[Command]:
        """As in "once the sponge is in the box", "not before the drawer is open": to be done before the rest."""
        k = i + 1 if self.text(i) in ("once", "after") else i + 3 if self.said(i, i + 3) == "as soon as" else i
        if self.text(i) == "not" and self.text(i + 1) in ("before", "until", "till"):
            k = i + 2
        found: Found[Command] = []
        for j, refs in self.np_list(k) if k > i else ():
            m = j + 1 if self.text(j) in ("is", "are") else j + 2 if self.said(j, j + 2) in _HAS_BEEN else j
            m += self.text(m) in ("safely", "all", "both") and m > j
            if m == j or refs[0].determiner == "it":
                continue
            found += self._placed_there(refs, m) + self._undergone(refs, m)
        return found

    def _to_be_done(self, i: int) -> Found[Command]:
        """As in "before the sponge is moved to the box": what is done to a thing."""
        return [
            hit
            for j, refs in (self.np_list(i) if not _PASSIVE.isdisjoint(self.texts[i:]) else ())
            for words in ("is", "are", "has been", "have been", "gets")
            if self.said(j, j + len(words.split())) == words and refs[0].determiner != "it"
            for hit in self._undergone(refs, j + len(words.split()))
        ]

    def _undergone(self, refs: tuple[Ref, ...], i: int) -> Found[Command]:
        """As in "(the sponge has been) put in the box", "(the cans are) tapped"."""
        return [
            (end, command)
            for j, verb in self.tag(i, "VERB")
            if verb in _UNDERGONE and (self.text(i) not in BASE_FORMS or self.text(i) == "put")
            for end, elements in [(j, ()), *self.elements(j)]
            for command in frame_command(verb, (spoken(refs), *elements))
        ]

    def _placed_there(self, refs: tuple[Ref, ...], i: int) -> Found[Command]:
        return [
            (end, _under(command))
            for end, elements in self.elements(i)
            if elements and any(e.kind in ("place", "matching") for e in elements)
            for command in frame_command("put", (spoken(refs), *elements))
        ]

    def _run_on(self, refs: tuple[Ref, ...], i: int) -> Found[Command]:
        """As in "red cube left bin", "put can bin": the container alone says where."""
        return [
            (j, Command("put", refs, Relation("in", where), bare=0.6))
            for j, where in (self._containers(i) if not any(ref.unknown for ref in refs) else ())
        ]

    def _containers(self, i: int) -> Found[tuple[Ref, ...]]:
        """Every way to read the one container that is named at `i`."""
        key = ("containers", i)
        if key not in self.memo:
            self.memo[key] = [(j, where) for j, where in self.np_list(i) if self._named_container(where)]
        return self.memo[key]

    def _named_container(self, refs: tuple[Ref, ...]) -> bool:
        plain = len(refs) == 1 and not (refs[0].plural or refs[0].number or refs[0].unknown or refs[0].other)
        named = refs[0].nouns or (id_parts(refs[0].names[0])[-1:] if refs[0].names else ())
        noun = NOUN_CLASS.get(named[0]) if plain and named else None
        # A box may be a thing to carry: only one that is told by its colour or its name is where others go.
        coloured_box = noun == "box" and bool(refs[0].colours or refs[0].names) and not refs[0].relations
        return noun in ("bin", "bowl", "drawer") or coloured_box


def _under(command: Command) -> Command:
    """As in "the red cube should be under the blue one": the blue one goes on it."""
    place = command.place
    if isinstance(place, Relation) and place.kind == "under" and len(command.objects) == len(place.refs) == 1:
        return replace(command, objects=place.refs, place=Relation("on", command.objects))
    return command


def spoken(refs: tuple[Ref, ...]) -> Element:
    """Return noun phrases as what a verb takes."""
    return Element("objects", refs)
