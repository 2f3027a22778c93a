"""What is done otherwise: "if the can is green, tap it, otherwise tap the bowl"."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property

from robosandbox.agent.language.amendments import Amendments
from robosandbox.agent.language.chart import Found
from robosandbox.agent.language.intent import Command, Ref, Relation, replace
from robosandbox.agent.language.readings import Part

_ALWAYS = ("otherwise", "or else", "else")
_IF_NOT = (
    "if not",
    "if it is not",
    "if that is not so",
    "if that is not the case",
    "if it is not so",
    "if there is not",
    "if there is not one",
    "if there is not any",
    "if there are not",
    "if there are not any",
    "if there is none",
    "if there are none",
    "if you do not",
    "if you do not see one",
    "if you do not see it",
    "if you see none",
    "failing that",
)
_IF_SO = (
    "if it is",
    "if that is so",
    "if that is the case",
    "if it is so",
    "if there is",
    "if there is one",
    "if there are",
    "if so",
)
_STATES = {"open": "open", "closed": "closed", "shut": "closed", "empty": "empty"}
_OPPOSITE = {"open": "closed", "closed": "open"}
"""What is not empty need not be full."""
_LEFT_ALONE = tuple(
    tuple(phrase.split())
    for phrase in (
        *(
            f"{leave} {it}{there}"
            for leave in ("leave", "keep")
            for it in ("it", "them", "everything")
            for there in (" alone", " be", " as it is", " like that", " that way", " where it is", " there")
        ),
        "leave it",
        "do nothing",
        "do not do anything",
    )
)
_PLAIN = tuple(tuple(phrase.split()) for phrase in _ALWAYS)
_DENIALS = tuple(tuple(phrase.split()) for phrase in _IF_NOT)
_AFFIRMED = tuple(tuple(phrase.split()) for phrase in _IF_SO)
_OPENS = frozenset({"otherwise", "else", "not", "none", "failing"})
_APART = frozenset({".", ";", "!"})
_AND = frozenset({"and", "but"})
Steps = tuple[Command, ...]


class Alternatives(Amendments, ABC):
    """The rules for what is done where a condition does not hold."""

    @abstractmethod
    def part(self, i: int, /) -> Found[tuple[Part, ...]]:
        """Return the parts of a sentence that start at `i`; `Grammar` knows how."""

    @cached_property
    def _otherwise(self) -> tuple[tuple[int, int, str], ...]:
        """Where an alternative is joined, where it starts, and what it says of the condition before it.

        That is "" for "otherwise", "not" for "if it is not", "so" for "if it is", or the state it is in.
        """
        found: list[tuple[int, int, str]] = []
        if _OPENS.isdisjoint(self.texts) and self.texts.count("if") < 2:
            return ()
        for p in range(1, self.count):
            for phrases, told in ((_PLAIN, ""), (_DENIALS, "not"), (_AFFIRMED, "so")):
                for words in phrases:
                    end = p + len(words)
                    if tuple(self.texts[p:end]) == words:
                        state = told
                        if words == ("if", "it", "is") and self.text(end) in _STATES:
                            state, end = _STATES[self.text(end)], end + 1
                        if not state or self.texts[end : end + 1] == [","] or self._orders(end):
                            start = self._skip(end)
                            found.append((p, start + (self.text(start) == "then"), state))
        return tuple(found)

    def _excludes(self, told: str, first: Command) -> bool:
        """Say whether what an alternative says holds just where the condition of a command does not."""
        if told in ("", "not"):
            return not (told and first.unless)
        condition = first.condition
        if condition is None or condition.number:
            return False
        if told == "so":
            return first.unless
        kinds = [relation.kind for relation in condition.relations]
        wanted = told if first.unless else _OPPOSITE.get(told)
        return first.subject is not None and kinds[-1:] == [wanted]

    def _leaves_it(self, i: int) -> bool:
        """Say whether nothing is to be done otherwise: "if it is open, leave it alone"."""
        return any(
            tuple(self.texts[i : i + len(words)]) == words and self._skip(i + len(words)) >= self.count
            for words in _LEFT_ALONE
        )

    def _orders(self, i: int) -> bool:
        return i < self.count and bool({"VERB", "PREAMBLE"} & {*self.tags[i]})

    def either(self, i: int) -> Found[tuple[Part, ...]]:
        """Return the readings from `i` to the end that begin with a command under a condition, and tell what is done otherwise."""
        found: Found[tuple[Part, ...]] = []
        for p, start, told in self._otherwise:
            for done in self._until(i, p) if p > i else []:
                first = done[0]
                fronted = any(self.text(k) in ("if", "unless") for k in self.optional(i, "THEN", "PREAMBLE"))
                apart = i == 0 or self.text(i - 1) in _APART
                if first.condition is None or any(c.condition or c.branches for c in done[1:]):
                    continue
                if not self._excludes(told, first) or not (fronted or (apart and len(done) == 1)):
                    continue
                if told and self._leaves_it(start):
                    found.append((self.count, done))
                    continue
                for end, other in self._instead(start, done):
                    other = _echoed(other, done)
                    if not other:
                        continue
                    made = Command("either", branches=(done, other))
                    if self._skip(end) >= self.count:
                        found.append((self.count, (made,)))
                    found += [
                        (self.count, (made, *rest))
                        for k in self._joints(end)
                        if not self._and_on(end, k)
                        for m, rest in self._parts(k)
                        if rest and m >= self.count and not _same_again(rest)
                    ]
        return found

    def _and_on(self, end: int, k: int) -> bool:
        """Say whether what is joined at `k` belongs to the alternative: "otherwise tap the bowl and go home"."""
        between = {*self.texts[end:k]}
        return not between & _APART and "then" not in between and bool(between & _AND)

    def _until(self, i: int, p: int) -> list[Steps]:
        """Return the readings of the commands from `i` to the joint of an alternative at `p`."""
        found: list[Steps] = []
        for j, part in self.part(i):
            if j > p or not _plainly_done(part):
                continue
            k = self._skip(j)
            if p in (j, k, k + (self.text(k) in _AND)):
                found.append(_commands(part))
            else:
                found += [(*_commands(part), *rest) for k in self._joints(j) if k < p for rest in self._until(k, p)]
        return found

    def _instead(self, i: int, done: Steps) -> Found[Steps]:
        """Return the readings of an alternative at `i`: orders of its own, or another thing or place for the same."""
        found: Found[Steps] = []
        for j, part in self.part(i):
            if not _plainly_done(part):
                continue
            found.append((j, _commands(part)))
            for k in self._joints(j):
                if not {*self.texts[j:k]} & _APART:
                    found += [(end, (*_commands(part), *rest)) for end, rest in self._instead(k, done)]
        last = replace(done[-1], condition=None, unless=False, subject=None)
        if not found and len(done) == 1:
            for j, parts in self._gapped((last,), i):
                if len(parts) == 2 and _plainly_done(parts[1:]):
                    found.append((j, _commands(parts[1:])))
            for j, place in self._place(i) if last.place else []:
                found.append((j, (replace(last, place=place),)))
        return found


def _commands(part: tuple[Part, ...]) -> Steps:
    return tuple(each for each in part if isinstance(each, Command))


def _plainly_done(part: tuple[Part, ...]) -> bool:
    """Say whether a part is made of orders alone."""
    return all(isinstance(each, Command) and each.verb != "nothing" for each in part)


def _same_again(rest: tuple[Part, ...]) -> bool:
    """As in "... and do the same with the can": the same as what?"""
    return isinstance(rest[0], Command) and rest[0].negated == "same"


def _echoed(other: Steps, done: Steps) -> Steps:
    """Return an alternative in which "it" and "one" are what they mean where the condition holds; nothing where that is open."""
    first, model = other[0], done[0]
    named = model.objects
    place, there = first.place, model.place
    if any(ref.other for ref in first.objects):
        return ()
    if first.objects and first.objects[0].determiner == "it":
        about = model.subject
        plural = len(named) > 1 or any(ref.plural for ref in named)
        if not named or named[0].determiner == "it" or first.objects[0].plural != plural or len(first.objects) > 1:
            return ()
        if about is not None and about != named[0] and first.verb != model.verb:
            # "if the drawer is open, put the key in it, otherwise open it"
            if first.verb not in ("open", "close"):
                return ()
            named = (about,)
        first = replace(first, objects=named)
    else:
        like = named[0] if len(named) == 1 else None
        objects = tuple(
            replace(ref, nouns=like.nouns, names=like.names, one=False)
            if ref.one and not (ref.nouns or ref.names) and like is not None
            else ref
            for ref in first.objects
        )
        first = replace(first, objects=objects)
    if isinstance(place, Relation) and any(ref.determiner == "it" for ref in place.refs):
        anchor = model.subject or _looked_at(model)
        told = there.refs if isinstance(there, Relation) and len(there.refs) == 1 else ()
        told = told if told and told[0].determiner != "it" else (anchor,) if anchor else ()
        if len(place.refs) > 1 or not told or told == first.objects:
            return ()
        first = replace(first, place=replace(place, refs=told))
    return (first, *other[1:])


def _looked_at(model: Command) -> Ref | None:
    """Return the one thing that a condition says is on or in something: that something."""
    relations = model.condition.relations if model.condition else ()
    refs = [ref for relation in relations for ref in relation.refs]
    return refs[0] if len(refs) == 1 else None
