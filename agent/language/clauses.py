"""Clauses: a verb and what surrounds it, in whatever order people say it, as a chart of elements."""

from __future__ import annotations

from typing import Any

from robosandbox.agent.language.chart import Found, rule
from robosandbox.agent.language.intent import (
    At,
    Command,
    Element,
    Matching,
    Ref,
    Region,
    Relation,
)
from robosandbox.agent.language.modifiers import says_nothing
from robosandbox.agent.language.whereabouts import Whereabouts

MAX_ELEMENTS = 6  # Number of elements of a clause. Chosen: a verb takes up to four.


Elements = tuple[Element, ...]
_ARRANGED: tuple[tuple[str, str, str | None], ...] = (
    ("UP_ORDER", "order", "up"),
    ("DOWN_ORDER", "order", "down"),
    ("BY_COLOUR", "colour", None),
    ("BY_OTHER", "other_sort", None),
    ("BY_SIZE", "by_size", None),
)
"""Tags of words for an order, and the elements that they are."""
_ORDERED = frozenset(tag for tag, _, _ in _ARRANGED)
_SEQUENCES = frozenset({"FROM", "BY_SIZE", "SMALL_FIRST", "SUPER", "SIZE"})
_SAME_HUE = frozenset({"MATCHING", "SAME_COLOUR", "MISMATCHED", "OTHER_COLOUR"})
_LEVELS = frozenset({"TOP", "BOTTOM", "MIDDLE"})
_RUNS = frozenset({"to", "starting", "beginning", "order", "going"})
LIFTS = frozenset({"up", "off", "off the table", "up off the table", "up from the table", "off of the table"})


class Clauses(Whereabouts):
    """The rules for what can follow, or precede, a verb."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.rests: dict[int, list[tuple[int, int, Found[Elements]]]] = {}
        self.height: int = 0
        """How many elements the longest of the sequences has that are being made."""

    @rule
    def element(self, i: int) -> Found[Element]:
        """Anything that can stand beside a verb."""
        found: Found[Element] = []
        if i >= self.count or self.tokens[i].kind == "mark":
            return found
        found += [(j, Element("objects", refs)) for j, refs in self.np_list(i)]
        found += [(j, Element("place", place)) for j, place in self._place(i)]
        found += [(j, Element("direction", value)) for j, value in self._direction(i)]
        if self.tells_distance:
            found += [(j, Element("distance", value)) for j, value in self.distance(i)]
            if self.text(i) == "of":
                # "push it of 5 cm forward"
                found += [(j, Element("distance", value)) for j, value in self.distance(i + 1) if self.tag(j, "DIR")]
        here = self.tags[i]
        found += [(j, Element("particle", value)) for j, value in here.get("PART", ())]
        found += [(j, Element("times", value)) for j, value in self._times(i)]
        if "TABLE" in self.present and ("THE" in here or "TABLE" in here):
            found += [(j, Element("table")) for k in self.optional(i, "THE") for j, _ in self.tag(k, "TABLE")]
        for tag, kind, value in _ARRANGED if not _ORDERED.isdisjoint(here) else ():
            found += [(j, Element(kind, value)) for j, _ in self.tag(i, tag)]
        found += [(j, Element("sequence", key)) for j, key in self._sequence(i)]
        found += [(j, Element("turns", turns)) for j, turns in self.turns(i)]
        found += [(j, Element("order_end", value)) for j, value in self._order_end(i)]
        if "FLOOR" in self.present:
            found += [(j, Element("floor")) for j in self._after_preposition(i, "FLOOR")]
        if "HOME" in self.present:
            found += [(j, Element("home")) for j in self._home(i)]
        for k, _ in here.get("EXCEPT", ()):
            found += [
                (j, Element("except", self._but(i, k, refs)))
                for j, refs in self.np_list(k)
                if (self.text(k) != "first" or j > k + 1) and not any(map(says_nothing, refs))
            ]
        if not _SAME_HUE.isdisjoint(self.present):
            found += [(j, Element("matching", noun)) for j, noun in self._matching(i)]
        if self.text(i) == "for":
            found += [(j, Element("in_exchange", refs)) for j, refs in self.np_list(i + 1)]
        for k, _ in here.get("MATERIAL", ()):
            found += [(j, Element("material", refs)) for j, refs in self.np_list(k)]
        contents = self.optional(i, "THE", "A", "ALL") if "CONTENTS" in self.present else []
        for j, _ in [hit for k in contents for hit in self.tag(k, "CONTENTS")]:
            for k in ([j + 1] if self.text(j) in ("from", "of", "in", "inside") else []) + [j]:
                found.append((k, Element("contents")))
        if self.said(i, i + 2) in ("along with", "together with"):
            found += [(j, Element("also", refs)) for j, refs in self.np_list(i + 2)]
        if self.text(i) in ("whichever", "whatever"):
            found += [(j, Element("choice", rank)) for j, rank in self.whichever(i)]
        if self.text(i) in ("me", "us"):
            found.append((i + 1, Element("person")))
        if self.text(i) in ("to", "towards", "toward", "over") and self.text(i + 1) in ("me", "us"):
            found.append((i + 2, Element("person")))
        return found

    def elements(self, i: int) -> Found[Elements]:
        """Sequences of elements, the longer reach first."""
        return self._rest(i, 0)

    def _sequences(self, i: int, depth: int) -> Found[Elements]:
        found: Found[Elements] = [(i, ())]
        if depth >= MAX_ELEMENTS:
            self.height = MAX_ELEMENTS if self.element(i) else 0
            return found
        for j, first in self.element(i):
            start = j + 1 if self.text(j) in (",", ":") else j
            if first.kind == "order_end":
                # "blue at the bottom, then green, and red on top"
                while self.text(start) in ("then", "and"):
                    start += 1
            if first.kind == "objects" and self.text(start) in ("and", "then"):
                # "... then the green one, and the red one on top"
                level = start + 2 if self.said(start, start + 2) == "and then" else start + 1
                for end, rest in self._rest(level, depth + 1):
                    if rest and rest[0].kind == "order_end":
                        found.append((end, (first, *rest)))
            if self.text(start) == "and" and _leaves(first):
                # "off the table and into the crate"
                found += [
                    (end, (first, *rest))
                    for end, rest in self._rest(start + 1, depth + 1)
                    if rest and rest[0].kind == "place" and _arrives(rest[0].value)
                ]
            for end, rest in self._rest(start, depth + 1):
                # Two noun phrases in a row need a comma between them.
                if (rest or start == j) and not (rest and start == j and first.kind == rest[0].kind == "objects"):
                    found.append((end, (first, *rest)))
            if start != j:
                found.append((j, (first,)))
        self.spend(len(found))
        found = [item for item in found if _go_together(item[1])]
        found.sort(key=lambda item: (-item[0], len(item[1])))
        return found

    def _rest(self, i: int, depth: int) -> Found[Elements]:
        """Sequences that begin with element `depth` of a clause: the same at every depth where none is cut short."""
        known = self.rests.setdefault(i, [])
        hit = next((hit for hit in known if hit[0] == depth or max(hit[0], depth) + hit[1] <= MAX_ELEMENTS), None)
        if hit is None:
            above, self.height = self.height, 0
            found = self._of_each_make(self._sequences(i, depth))
            hit = depth, self.height, found
            self.height = above
            known.append(hit)
        self.height = max(self.height, hit[1] + 1)
        return hit[2]

    def _of_each_make(self, found: Found[Elements]) -> Found[Elements]:
        """Keep readings of each length as `capped` does, and the first of each sequence of kinds.

        The many senses of a long noun phrase must not push out those in which its end says where something goes.
        """
        kept = self.capped(found)
        if len(kept) == len(found):
            return kept
        made = {(end, *(kind for kind, _ in elements)) for end, elements in kept}
        for end, elements in found:
            make = (end, *(kind for kind, _ in elements))
            if make not in made:
                made.add(make)
                kept.append((end, elements))
        return kept

    def _times(self, i: int) -> Found[int]:
        found = [(j, int(n)) for j, n in self.tag(i, "TIMES")]
        if self._is_number(i) and self.text(i + 1) in ("times", "x", "time"):
            found.append((i + 2, int(min(self.tokens[i].number, 99))))
        return found

    def _order_end(self, i: int) -> Found[tuple[str, Ref]]:
        """As in "with the red one on top", "red at the bottom"."""
        found: Found[tuple[str, Ref]] = []
        if _LEVELS.isdisjoint(self.present):
            return found
        start = i + 1 if self.text(i) in ("with", "having", "keeping", "leaving") else i
        for j, ref in self.np(start):
            k = j + 1 if self.text(j) in ("being", "goes", "going", "is", "as") else j
            for tag, value in (("TOP", "top"), ("BOTTOM", "bottom"), ("MIDDLE", "middle")):
                found += [(end, (value, ref)) for end, _ in self.tag(k, tag) if end > k]
        return found

    def _sequence(self, i: int) -> Found[str]:
        """As in "smallest first", "starting with the biggest", "from right to left": by what they are ordered."""
        if _SEQUENCES.isdisjoint(self.present):
            return []
        found: Found[str] = [
            (j, key) for j, key in self.tag(i, "FROM") if not _RUNS.isdisjoint(self.texts[i:j]) and self.text(i) != "on"
        ]
        if self.text(i) not in ("in", "with"):
            found += [(j, "big") for j, _ in self.tag(i, "BY_SIZE")] + [
                (j, "small") for j, _ in self.tag(i, "SMALL_FIRST")
            ]
        opened = self.text(i) in ("starting", "beginning", "start") and self.text(i + 1) in ("with", "from")
        for start in self.optional(i + 2 if opened else i, "THE"):
            small = self.tag(start, "SIZE") if self.text(start - 1) == "the" else []
            for j, key in (*self.tag(start, "SUPER"), *small):
                k = j + 1 if self.text(j) in ("one", "ones") else j
                if self.text(k) == "first" or (opened and not (small and k == j)):
                    found.append((k + 1 if self.text(k) == "first" else k, key))
        return found

    def _after_preposition(self, i: int, tag: str) -> list[int]:
        j = i
        while self.text(j) in ("on", "to", "onto", "in", "off", "down", "the", "of", "from", "over"):
            j += 1
        return [end for end, _ in self.tag(j, tag)] if j > i else []

    def _home(self, i: int) -> list[int]:
        j = i
        while self.text(j) in ("to", "in", "at", "into", "the", "your", "its", "back", "a", "a", "my"):
            j += 1
        # "then the rest" is about the others.
        return [end for end, _ in self.tag(j, "HOME") if self.said(j - 1, end) != "the rest"]

    def _matching(self, i: int) -> Found[Matching]:
        """As in "into the matching bin", "in the bin of the same colour"."""
        j = i
        while self.text(j) in (
            "in",
            "into",
            "to",
            "inside",
            "the",
            "their",
            "its",
            "on",
            "onto",
            "a",
            "each",
            "respective",
        ):
            j += 1
        if j == i:
            return []
        found: Found[Matching] = []
        for tag, other in (("MATCHING", False), ("MISMATCHED", True)):
            for k, _ in self.tag(j, tag):
                for m in self.optional(k, "COLOUR"):
                    found += [(end, Matching(phrase, other)) for end, (_, phrase, _) in self.tag(m, "NOUN")]
        for k, (noun, phrase, _) in self.tag(j, "NOUN"):
            if noun in ("bin", "bowl", "box"):
                found += [(self._as_it(end), Matching(phrase)) for end, _ in self.tag(k, "SAME_COLOUR")]
                found += [(end, Matching(phrase, other=True)) for end, _ in self.tag(k, "OTHER_COLOUR")]
        return found

    def _as_it(self, i: int) -> int:
        """As in "of the same colour as it"."""
        itself = self.text(i) == "as" and self.text(i + 1) in ("it", "them", "itself", "themselves", "that")
        return i + 2 if itself else i


def _go_together(elements: Elements) -> bool:
    """Say whether one verb can have these: no more than two lists of things, or three places, and not two of both."""
    lists = places = 0
    for element in elements:
        if element.kind == "objects":
            lists += 1
        elif element.kind == "place":
            places += 1
    return lists <= 2 and places <= 3 and (lists < 2 or places < 2)


def _leaves(element: Element) -> bool:
    if element.kind == "particle":
        return element.value in LIFTS
    return element.kind == "place" and isinstance(element.value, Relation) and element.value.kind == "from"


def _arrives(place: Any) -> bool:
    return isinstance(place, Relation) and place.directional


__all__ = ["At", "Clauses", "Command", "Element", "Elements", "Region"]
