"""Order of objects: "all the cubes in the bin, the blue one first", "starting with the can", "ending with the cup"."""

from __future__ import annotations

from functools import cached_property

from robosandbox.agent.language.chart import Found, rule
from robosandbox.agent.language.intent import Command, Ref, replace
from robosandbox.agent.language.lists import Phrasing

Turns = tuple[tuple[str, Ref], ...]
_TOLD = frozenset(
    {"first", "last", "starting", "beginning", "ending", "finishing", "concluding", "start", "begin", "end", "finish", "order",
     "before", "after"}
)  # fmt: skip
_OPENERS = {
    "first": frozenset(
        f"{verb} {joint}"
        for verb in ("starting", "beginning", "start", "begin", "starting off", "start off")
        for joint in ("with", "from")
    ),
    "last": frozenset(
        f"{verb} {joint}"
        for verb in ("ending", "finishing", "concluding", "end", "finish", "finishing off", "finish off", "finish up", "ending up")
        for joint in ("with", "on")
    ),
}  # fmt: skip
_KEPT = frozenset({"leaving", "keeping", "saving", "leave", "keep", "save"})
_TILL_LAST = frozenset(
    f"{till} {end}"
    for till in ("till", "until", "for", "to")
    for end in ("last", "the last", "the end", "the very end")
)
_LASTS = frozenset(
    {"last", "last of all", "at the end", "at the very end", "in the end", "as the last one", "as the last"}
)
_FIRSTS = frozenset({"first", "first of all", "as the first one", "as the first"})
_THERE = ("in there", "in", "there")
_SECOND = frozenset({"second", "next", "third", "fourth"})
_NEXT = frozenset({"then", "next", "followed by", "and then", "then comes", "after that", "and after that"})


class TakingTurns(Phrasing):
    """The rules for who of several comes first, next and last."""

    @cached_property
    def tells_turns(self) -> bool:
        """Whether a word is said that may tell whose turn it is."""
        return not _TOLD.isdisjoint(self.texts)

    @rule
    def turns(self, i: int) -> Found[Turns]:
        """As in "blue first, then red, then the others", "starting with the can", "leaving the cup till last"."""
        if not self.tells_turns:
            return []
        found: Found[Turns] = []
        start = i + 1 if self.text(i) in ("but", "with", "and") else i
        start = start + 2 if self.said(start, start + 2) in ("making sure", "make sure") else start
        for which, openers in _OPENERS.items():
            for j in (start + 2, start + 3):
                if self.said(start, j).lower() in openers:
                    found += [hit for k, ref in self._taker(j) for hit in self._first_or_last(k, which, ref)]
        if self.text(start) in _KEPT:
            found += [
                (end, (("last", ref),))
                for j, ref in self._taker(start + 1)
                for end in (j + 2, j + 3, j + 4)
                if self.said(j, end).lower() in _TILL_LAST
            ]
        # "..., the tall can first" is about the can, and not about "the tall" before it.
        apart = start > i or self.text(i - 1) in ("and", "but", "then") or (i > 0 and self.tokens[i - 1].kind == "mark")
        for j, ref in self._taker(start) if apart else ():
            for k in self._gone(j):
                for end in range(k + 1, k + 5):
                    said = self.said(k, end).lower()
                    found += self._first_or_last(end, "first", ref) if said in _FIRSTS else []
                    found += [(end, (("last", ref),))] if said in _LASTS else []
        return found + self._both_ends(found)

    def _gone(self, i: int) -> list[int]:
        """Return where "goes", "should go in" and "goes in there" end, and `i` itself."""
        ends = self.optional(i, "COPULA")
        return [
            k + len(there.split())
            for k in ends
            if k > i
            for there in _THERE
            if self.said(k, k + len(there.split())) == there
        ] + ends

    def _both_ends(self, found: Found[Turns]) -> Found[Turns]:
        """As in "starting with the red one and ending with the blue one"."""
        both: Found[Turns] = []
        for j, turns in found:
            k = j + 1 if self.text(j) in (",", "and") else j
            k += self.text(j) == "," and self.text(k) == "and"
            for end, others in self.turns(k) if k > j else ():
                if turns[0][0] == "first" and {which for which, _ in others} == {"last"}:
                    both.append((end, (*turns, *others)))
        return both

    def _first_or_last(self, i: int, which: str, ref: Ref) -> Found[Turns]:
        found: Found[Turns] = [(i, ((which, ref),))]
        if which == "first":
            found += [(j, (("first", ref), *(("first", other) for other in others))) for j, others in self._then(i)]
        return found

    @rule
    def _then(self, i: int) -> Found[tuple[Ref, ...]]:
        """As in ", then the red one, then the others": who comes next; nobody is told by "the others"."""
        k = i + 1 if self.text(i) in (",", ";") else i
        ends = [end for end in range(k + 1, k + 4) if self.said(k, end).lower() in _NEXT]
        found: Found[tuple[Ref, ...]] = []
        for start in ends or ([k] if k > i else []):
            for j, ref in self._taker(start):
                then = j + 1 if self.text(j) in _SECOND else j
                if then == j and not ends:
                    continue
                told = () if ref.other else (ref,)
                found.append((then, told))
                found += [(end, (*told, *others)) for end, others in self._then(then)] if told else []
        return found

    def _taker(self, i: int) -> Found[Ref]:
        return [
            (j, ref)
            for j, ref in (*self.np(i), *self._numeral(i))
            if not (ref.unknown or ref.options or ref.determiner == "it" or ref.relations or ref.without or ref.instead)
        ]


def taking_turns(commands: list[Command], turns: Turns) -> list[Command]:
    """Return the commands about several things with their order, without those about one."""
    return [
        replace(command, order=turns)
        for command in commands
        if command.order is None
        and command.objects
        and (len(command.objects) > 1 or any(ref.plural or ref.determiner == "all" for ref in command.objects))
    ]


def turns_of(command: Command) -> Turns:
    """Return who comes first and last of the things of a command; nothing for the levels of a tower."""
    order = command.order if isinstance(command.order, tuple) else ()
    return order if order and order[0][0] in ("first", "last") else ()
