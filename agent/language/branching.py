"""Branches and loops: "if ..., otherwise ...", "while", "until", "for each"."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace as changed
from functools import cached_property

from robosandbox.agent.language.amendments import Amendments
from robosandbox.agent.language.antecedents import about, echoed, told_of
from robosandbox.agent.language.chart import Found, distinct, rule
from robosandbox.agent.language.intent import Command, replace
from robosandbox.agent.language.logic import (
    Bound,
    Condition,
    ForEach,
    If,
    Is,
    Not,
    Steps,
    There,
    UntilLeft,
    While,
    commands_of,
    controlled,
    stripped,
)
from robosandbox.agent.language.readings import Part

_MARKERS: tuple[tuple[tuple[str, ...], str, bool], ...] = tuple(
    (tuple(words.split()), kind, denied)
    for words, kind, denied in (
        ("if", "if", False),
        ("only if", "if", False),
        ("in case", "if", False),
        ("provided that", "if", False),
        ("unless", "if", True),
        ("while", "while", False),
        ("as long as", "while", False),
        ("so long as", "while", False),
        ("until", "while", True),
        ("till", "while", True),
    )
)
_BEGINS = frozenset(words[0] for words, _, _ in _MARKERS) | {"for", "with"}
_OTHERWISE: tuple[tuple[tuple[str, ...], str], ...] = tuple(
    (tuple(phrase.split()), told)
    for told, phrases in (
        ("", ("otherwise", "or else", "else")),
        ("so", ("in which case", "in that case")),
        (
            "not",
            (
                "if not",
                "if that is not so",
                "if that is not the case",
                "if it is not so",
                "if it is not",
                "failing that",
                *(
                    f"if {there}{none}"
                    for there in ("there is", "there are", "you do", "you see")
                    for none in (" not", " not one", " not any", " none", " not see one", " not see it")
                ),
            ),
        ),
        (
            "so",
            (
                "if it is",
                "if that is so",
                "if that is the case",
                "if it is so",
                "if there is",
                "if there is one",
                "if there are",
                "if so",
            ),
        ),
    )
    for phrase in phrases
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
_APART = frozenset({".", ";", "!"})
_RATHER = frozenset({"instead", "already", "rather"})
_AGAIN = frozenset({"keep", "continue"})
_LOOPS = frozenset({"put", "stack", "pick", "tap", "pour", "open", "close", "home", "control"})
"""Verbs that may be done until something is so; how far a push goes is told beforehand."""


class Branching(Amendments, ABC):
    """The rules for what is done under conditions and again and again."""

    @abstractmethod
    def part(self, i: int, /) -> Found[tuple[Part, ...]]:
        """Return the parts of a sentence that start at `i`; `Grammar` knows how."""

    @cached_property
    def depends(self) -> bool:
        """Whether anything in the sentence may depend on something."""
        return not _BEGINS.isdisjoint(self.texts)

    @rule
    def control(self, i: int) -> Found[Command]:
        """What depends on something, or is done with each of several things."""
        if not self.depends or i >= self.count:
            return []
        found: Found[Command] = []
        for start in self.optional(i, "THEN", "PREAMBLE"):
            found += self._conditioned(self._skip(start) if start > i else i)
            found += self._for_each(start)
        found += self._trailing(i)
        return distinct(found)

    def _marked(self, i: int) -> list[tuple[int, str, bool]]:
        """Return what a condition at `i` is opened with: where it starts, "if" or "while", and whether it denies."""
        return [
            (i + len(words), kind, denied)
            for words, kind, denied in _MARKERS
            if self.text(i) == words[0] and tuple(map(self.text, range(i, i + len(words)))) == words
        ]

    def _conditioned(self, i: int) -> Found[Command]:
        """As in "if the drawer is open, close it, otherwise tap the can"."""
        found: Found[Command] = []
        for k, kind, denied in self._marked(i):
            for j, condition in self.condition(k):
                if not self.closed_off(j):
                    continue
                told: Condition = Not(condition) if denied else condition
                begin = self._skip(j)
                begin = self._skip(begin + 1) if self.text(begin) == "then" else begin
                for end, body in self._bodies(begin, asked=begin > j):
                    body = told_of(body, told)
                    if not body:
                        continue
                    if kind == "while" and _may_go_on(body):
                        found.append((end, controlled(While(told, body))))
                    if kind == "while" and (_may_go_on(body) or self.text(k - 2) != "long"):
                        continue
                    form = If(told, body, unless=denied)
                    found.append((end, controlled(form)))
                    found += self._with_otherwise(end, form)
        return found

    def _for_each(self, i: int) -> Found[Command]:
        """As in "for each can, tap it and put it in the bin"."""
        found: Found[Command] = []
        for j, what in self.np(i + 1) if self.text(i) in ("for", "with") else ():
            if what.determiner != "all" or what.unknown or what.other:
                continue
            begin = self._skip(j)
            for end, body in self._bodies(begin, asked=True) if begin > j else ():
                about = [ref for step in body for each in commands_of(step) for ref in each.objects]
                if about and about[0].determiner == "it":
                    found.append((end, controlled(ForEach(what, body))))
        return found

    def _trailing(self, i: int) -> Found[Command]:
        """As in "tap the can unless it is red", "put cans in the bin until two are left"."""
        found: Found[Command] = []
        again = self.text(i) in _AGAIN and self.text(i + 1).endswith("ing")
        for j, done in self._bodies(i + again, asked=True):
            if any(step.control for step in done):
                continue
            k = self._skip(j)
            k += self.text(k) == "but"
            for start, kind, denied in self._marked(k):
                if kind == "while" and denied:
                    found += self._left(start, done)
                for end, said in self.condition(start):
                    condition = about(said, done) if self.closed_off(end) else None
                    if condition is None:
                        continue
                    told: Condition = Not(condition) if denied else condition
                    if kind == "while":
                        found += [(end, controlled(While(told, done)))] if _may_go_on(done) else []
                    elif not again:
                        apart = i == 0 or self.text(i - 1) in _APART
                        form = If(told, done, unless=denied)
                        found.append((end, controlled(form)))
                        found += self._with_otherwise(end, form) if apart and len(done) == 1 else []
        return found

    def _left(self, i: int, done: Steps) -> Found[Command]:
        """As in "until two are left", "until only the red ball is left", "until there are none left on the table"."""
        last = done[-1]
        if len(done) > 1 or len(last.objects) != 1 or not last.objects[0].plural or last.verb != "put":
            return []
        found: Found[Command] = []
        k = i + 2 if self.said(i, i + 2) in ("there are", "there is") else i
        for j, ref, bound in self._some(k):
            alike = ref.determiner == "it" or (ref.nouns == last.objects[0].nouns and not ref.relations)
            found += self._ends_left(i, j, UntilLeft(last, changed(bound, loose=False), None, "")) if alike else []
        for j, ref in self.np(k):
            if ref.determiner == "the" and not (ref.plural or ref.unknown or ref.relations):
                found += self._ends_left(i, j, UntilLeft(last, Bound(1), ref, ""))
        return found

    def _ends_left(self, i: int, j: int, form: UntilLeft) -> Found[Command]:
        k = j + (self.text(j) in ("is", "are"))
        if self.text(k) not in ("left", "remaining", "remain", "remains", "over"):
            return []
        k += 1
        ends = [k] + [m for m, relation in self.relation(k) if relation.kind == "on" and not relation.refs]
        return [(end, controlled(changed(form, text=self.said(i, end)))) for end in ends]

    def _bodies(self, i: int, *, asked: bool = False) -> Found[Steps]:
        """Return the orders from `i` on, each longer by one: joined by commas, "and" and "then"."""
        found: Found[Steps] = []
        for j, part in self._ordered(i) if asked else self._begun(i):
            found.append((j, part))
            for k in self._joints(j):
                if _APART.isdisjoint(self.texts[j:k]):
                    found += [(end, (*part, *rest)) for end, rest in self._later(k)]
        return self.capped(found)

    def _begun(self, i: int) -> Found[Steps]:
        """An order right after a condition with no mark between: it begins with its verb."""
        return [(j, (command,)) for j, command in self._verb_first(i)]

    @rule
    def _later(self, i: int) -> Found[Steps]:
        return self._bodies(i, asked=True) if not self._alternative(i) else []

    @rule
    def _ordered(self, i: int) -> Found[Steps]:
        """The orders of one part of the sentence, and what depends on something within it."""
        found = [(j, _commands(part)) for j, part in self.part(i) if _plainly_done(part)]
        if self.text(i) in _BEGINS:
            found += [(j, (command,)) for j, command in self.control(i)]
        return found

    # What is done otherwise.

    def _alternative(self, i: int) -> list[tuple[int, str]]:
        """Return where an alternative starts whose joining words are at `i`, and what it says of the condition before it.

        That is "" for "otherwise", "not" for "if it is not", "so" for "if it is", or the state it is in.
        """
        found: list[tuple[int, str]] = []
        for words, told in _OTHERWISE:
            end = i + len(words)
            if self.text(i) != words[0] or tuple(self.texts[i:end]) != words:
                continue
            if words == ("if", "it", "is") and self.text(end) in _STATES:
                told, end = _STATES[self.text(end)], end + 1
            if told in ("", "not") or self.text(end) == "," or self._orders(end) or words[0] == "in":
                start = self._skip(end)
                found.append((start + (self.text(start) == "then"), told))
        return found

    def _orders(self, i: int) -> bool:
        return i < self.count and bool({"VERB", "PREAMBLE"} & {*self.tags[i]})

    def _excludes(self, told: str, form: If) -> bool:
        """Say whether what an alternative says holds just where the condition does not."""
        if told in ("", "not"):
            return not (told and form.unless)
        condition, denied = stripped(form.condition)
        if isinstance(condition, There) and condition.bound.loose:
            return False
        if told == "so":
            return denied
        kinds = [relation.kind for relation in condition.so.relations] if isinstance(condition, Is) else []
        return kinds == [told if denied else _OPPOSITE.get(told)]

    def _with_otherwise(self, j: int, form: If) -> Found[Command]:
        """Return what is done under a condition, up to `j`, together with what is done otherwise."""
        found: Found[Command] = []
        k = self._skip(j)
        for p in (k, k + 1) if self.text(k) in ("and", "but") else (k,):
            for start, told in self._alternative(p):
                if not self._excludes(told, form):
                    continue
                if told and self._leaves_it(start):
                    found.append((self.count, controlled(form)))
                    continue
                for end, other in self._instead(start, form):
                    other = echoed(other, form)
                    found += [(end, controlled(changed(form, otherwise=other)))] if other else []
        return found

    def in_its_place(self, done: tuple[Part, ...], rest: tuple[Part, ...], k: int) -> tuple[Part, ...]:
        """As in "tap the can, but if it is red, tap the cup": in place of what was told before, and decided before it.

        Args:
            done: What was told before.
            rest: What follows from `k` on.
            k: Where it begins.

        Returns:
            That reading; nothing where it cannot be meant.
        """
        form = rest[0].control if isinstance(rest[0], Command) else None
        instead = not _RATHER.isdisjoint(self.texts[k:])
        told = self.text(k - 1) == "but" or instead
        if not isinstance(form, If) or form.otherwise or not told or not _plainly_done(done):
            return ()
        condition = about(form.condition, _commands(done))
        if condition is None:
            return ()
        form = changed(form, condition=condition, otherwise=_commands(done), apart=not instead)
        return (controlled(form), *rest[1:])

    def _leaves_it(self, i: int) -> bool:
        """Say whether nothing is to be done otherwise: "if it is open, leave it alone"."""
        return any(
            tuple(self.texts[i : i + len(words)]) == words and self._skip(i + len(words)) >= self.count
            for words in _LEFT_ALONE
        )

    def _instead(self, i: int, form: If) -> Found[Steps]:
        """Return the readings of an alternative at `i`: orders of its own, or another thing or place for the same."""
        found = self._bodies(i, asked=True)
        last = form.then[-1]
        if not found and len(form.then) == 1 and not last.control:
            for j, parts in self._gapped((last,), i):
                if len(parts) == 2 and _plainly_done(parts[1:]):
                    found.append((j, _commands(parts[1:])))
            for j, place in self._place(i) if last.place else []:
                found.append((j, (replace(last, place=place),)))
            for j, refs in self.np_list(i) if not found else ():
                found.append((j, (replace(last, objects=refs),)))
        return found


def _commands(part: tuple[Part, ...]) -> Steps:
    return tuple(each for each in part if isinstance(each, Command))


def _plainly_done(part: tuple[Part, ...]) -> bool:
    """Say whether a part is made of orders alone."""
    return all(isinstance(each, Command) and each.verb != "nothing" for each in part)


def _may_go_on(body: Steps) -> bool:
    """Say whether orders may be given again and again; how often several things at once would be done is open."""
    orders = [each for step in body for each in commands_of(step)]
    several = any(ref.plural and ref.determiner != "it" for each in orders for ref in each.objects)
    return not several and all(each.verb in _LOOPS for each in orders)
