"""Towers told level by level: "red at the bottom, then green, and blue on top", "from top to bottom: a, b and c"."""

from __future__ import annotations

from abc import ABC
from functools import cached_property

from robosandbox.agent.language.adjectives import FEELINGS
from robosandbox.agent.language.chart import Found, rule
from robosandbox.agent.language.intent import At, Command, Place, Rank, Ref, Region, Relation, replace
from robosandbox.agent.language.word_order import WordOrder

Levels = tuple[tuple[str, Ref], ...]
Head = tuple[tuple[Ref, ...], Place | None, bool]
_TELLING = frozenset({"TOP", "BOTTOM", "MIDDLE", "UP_ORDER", "DOWN_ORDER"})
_UPON = frozenset(
    f"{on} {it}" for on in ("on", "on top of", "above", "over", "upon") for it in ("it", "that", "this")
) | {"above"}
_BELOW = frozenset(
    f"{under} {it}" for under in ("below", "under", "underneath", "beneath") for it in ("it", "that", "this")
)
_OPENERS = frozenset({",", ":", ";", ".", "with", "where", "having"})
_LINKS = frozenset(
    {"being", "is", "goes", "going", "as", "right", "sits", "comes", "stands", "to", "be", "should", "put", ":"}
)
_JOINTS = frozenset({",", ";", "and", "then", "finally", "next", "with", "lastly"})
_ENDS = (" bottom", " top", " middle", " lowest", " highest", " below", " above", " uppermost")
_STANDING = frozenset({"on", "beside", "left", "right", "front", "back", "between"})
_HIGH = frozenset({"high", "tall", "level", "storey", "story", "tier", "layer"})
_MOST_JOINTS = 4  # Number of joining words between two levels. Chosen.
_LOOKS = FEELINGS | {"neat", "tidy", "proper", "simple"}
# Strain, a number of units: naming the levels of a tower says more than a list of things with places. Chosen.
_PLAIN = -0.8


class Towers(WordOrder, ABC):
    """The rules for towers whose levels are told one by one."""

    @cached_property
    def tells_levels(self) -> bool:
        """Whether a word is said that may tell a level."""
        return not _TELLING.isdisjoint(self.present)

    def told_tower(self, i: int) -> Found[Command]:
        """As in "a tower on the mat: red lowest, then blue, then white", "pile up the cans, the red one on top"."""
        if not self.tells_levels:
            return []
        found: Found[Command] = []
        for k, (whole, place, by_size), count in self._heads(i):
            opened = k
            while self.text(opened) in _OPENERS and opened < k + 3:
                opened += 1
            joined = bool(whole) and self.text(opened) == "and"
            if joined:
                # "stack the blocks and put the eraser on top"
                opened += 1
                while self.text(opened) in ("then", "put", "place"):
                    opened += 1
            for j, levels in self._levels(opened):
                told = tuple((level, ref) for level, ref in levels if not (whole and _others(ref)))
                # "..., the green one" after a list goes on with it.
                begun = told and (
                    told[0][0] != "next"
                    or (not joined and opened > k and len(whole) < 2 and not any(ref.names for ref in whole))
                )
                if not begun or not self._ends_here(j) or all(level == "next" for level, _ in told):
                    continue
                if by_size:
                    found += [(j, command) for command in _by_size(whole, place, told)]
                    continue
                made_of = whole
                if (count and (made_of or count != len(told))) or (not made_of and not _all_named(told)):
                    continue
                objects = made_of or tuple(ref for _, ref in told)
                plain = _PLAIN * len(told) * (1 if made_of else 2)
                found.append((j, Command("stack", objects, place, (), told, bare=plain)))
        return found

    def _ends_here(self, j: int) -> bool:
        return self._skip(j) >= self.count or bool(self._joints_at(j))

    def _heads(self, i: int) -> list[tuple[int, Head, int]]:
        """Return where the levels may begin, what the tower is made of and where it stands, and how many levels it has."""
        found: list[tuple[int, Head, int]] = []
        verbs = [(j, verb) for j, verb in self.tag(i, "VERB") if verb in ("build", "stack")]
        for j, verb in verbs:
            if verb == "stack":
                for k, refs in self.np_list(j):
                    several = len(refs) > 1 or any(ref.plural for ref in refs)
                    if several and not any(ref.unknown or ref.text.endswith(_ENDS) for ref in refs):
                        found += [(end, head, 0) for end, head in self._heading(k, refs)]
                    if all(ref.determiner == "it" for ref in refs):
                        # "stack these from top to bottom: red, green, blue": what is listed.
                        found += [(end, head, 0) for end, head in self._heading(k, ())]
        built = [j + (self.text(j) in ("me", "us")) for j, verb in verbs if verb == "build"]
        for j in built or self.optional(i, "DESIRE"):
            for start in map(self._past_looks, self.optional(j, "A")):
                counts = [(m + (self.text(m) in _HIGH), int(n)) for m, n in self.tag(start, "NUM") if n >= 2]
                for k, count in [*counts, (start, 0)]:
                    for m, (noun, _, plural) in self.tag(k, "NOUN"):
                        if noun == "tower" and not plural:
                            found += [(end, head, count) for end, head in self._heading(m, ())]
                            # "a tower of three: ..."
                            numbers = self.tag(m + 1, "NUM") if self.text(m) == "of" and not count else []
                            found += [
                                (end, head, int(n))
                                for e, n in numbers
                                if self.text(e) in (":", ",")
                                for end, head in self._heading(e, ())
                            ]
        return found

    def _past_looks(self, i: int) -> int:
        """Return where what says how a tower is to look ends: "a nice little" tower."""
        while i < self.count and (self.text(i) in _LOOKS or "SIZE" in self.tags[i]):
            i += 1
        return i

    def _heading(self, i: int, whole: tuple[Ref, ...]) -> Found[Head]:
        """What stands between the word "tower" and its levels: of what, on what, by size."""
        found: Found[Head] = [(i, (whole, None, False))]
        for j, where in self._place(i):
            refs = where.refs if isinstance(where, Relation) else ()
            stands = isinstance(where, (At, Region)) or (
                isinstance(where, Relation) and where.kind in _STANDING and refs
            )
            if stands and not any(ref.unknown or ref.text.endswith(_ENDS) for ref in refs):
                found.append((j, (whole, where, False)))
                rest = self._heading(j, whole) if not whole else []
                found += [
                    (end, (made_of, where, False)) for end, (made_of, none, _) in rest if none is None and end > j
                ]
        if not whole:
            for j, _ in self.tag(i, "MATERIAL"):
                for k, refs in self.np_list(j):
                    if not any(ref.unknown or ref.text.endswith(_ENDS) for ref in refs) and (
                        len(refs) > 1 or any(ref.plural for ref in refs)
                    ):
                        found += self._heading(k, refs)
        sized = [j for tag in ("BY_SIZE", "BY_OTHER") for j, _ in self.tag(i, tag) if self.text(j - 1) == "size"]
        found += [(j, (whole, None, True)) for j in sized if whole]
        return found

    @rule
    def _levels(self, i: int) -> Found[Levels]:
        found: Found[Levels] = []
        for tag, first in (("UP_ORDER", "bottom"), ("DOWN_ORDER", "top")):
            for k, _ in self.tag(i, tag):
                start = k + 1 if self.text(k) in (":", ",") else k
                for j, refs in self.np_list(start):
                    if len(refs) > 1 and not any(ref.unknown or ref.text.endswith(_ENDS) for ref in refs):
                        found.append((j, ((first, refs[0]), *[("next", ref) for ref in refs[1:]])))
        for j, level in self._level(i):
            found.append((j, (level,)))
            k = j
            while self.text(k) in _JOINTS and k < j + _MOST_JOINTS:
                k += 1
            if k > j:
                found += [(end, (level, *others)) for end, others in self._levels(k)]
        return found

    def _level(self, i: int) -> Found[tuple[str, Ref]]:
        found: Found[tuple[str, Ref]] = []
        for k, mark in self._marks(i):
            # "at the bottom green", "on top of that the red one"
            start = k
            while self.text(start) in _LINKS and start < k + 2:
                start += 1
            found += [(j, (mark, ref)) for j, ref in self._storey(start)]
        for j, ref in self._storey(i):
            for k in range(j, j + 4):
                found += [(end, (mark, ref)) for end, mark in self._marks(k)]
                if self.text(k) not in _LINKS:
                    break
            found.append((j, ("next", ref)))
        return found

    def _storey(self, i: int) -> Found[Ref]:
        return [
            (j, ref)
            for j, ref in (*self.np(i), *self._numeral(i))
            if not (ref.unknown or ref.options or ref.relations or ref.determiner == "it" or ref.text.endswith(_ENDS))
            and (not ref.plural or ref.other)
        ]

    def _marks(self, i: int) -> Found[str]:
        found: Found[str] = []
        for n in (1, 2, 3, 4):
            said = self.said(i, i + n).lower()
            found += [(i + n, "next")] if said in _UPON else [(i + n, "below")] if said in _BELOW else []
        if not found or found[-1][0] == i + 1:
            for tag, level in (("TOP", "top"), ("BOTTOM", "bottom"), ("MIDDLE", "middle")):
                found += [(j, level) for j, _ in self.tag(i, tag)]
        return found


def _others(ref: Ref) -> bool:
    return ref.other and (ref.plural or ref.determiner == "all")


def _all_named(levels: Levels) -> bool:
    """Say whether the levels are all there is: two at least, and not just the biggest and the smallest of many."""
    extremes = [len(ref.ranks) == 1 and ref.ranks[0].strict and not (ref.colours or ref.names) for _, ref in levels]
    return len(levels) > 1 and not any(_others(ref) for _, ref in levels) and not all(extremes)


def _by_size(whole: tuple[Ref, ...], place: Place | None, levels: Levels) -> list[Command]:
    """As in "the cans by size, the tallest at the bottom"."""
    level, ref = levels[0]
    key = ref.ranks[0].key if len(ref.ranks) == 1 and not (ref.colours or ref.names) else ""
    if len(whole) != 1 or len(levels) != 1 or level not in ("top", "bottom") or not key:
        return []
    ordered = replace(whole[0], ranks=(*whole[0].ranks, Rank(key, 0)))
    return [Command("stack", (ordered,), place, (), "up" if level == "bottom" else "down", bare=_PLAIN)]
