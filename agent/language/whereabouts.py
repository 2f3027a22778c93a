"""Places, ways, distances and coordinates beside a verb."""

from __future__ import annotations

from functools import cached_property
from typing import Any

from robosandbox.agent.language.chart import Found, rule
from robosandbox.agent.language.intent import IT, At, ByRobot, Original, Relation, Spot, Table
from robosandbox.agent.language.turns import TakingTurns
from robosandbox.agent.language.wordlist import word_set

_COORDINATE_WORDS = word_set(
    """
    at to the position coordinates coordinate point location spot of table on in into onto world pos xy ( x,y
    place
    """
)
_INTO_IT = frozenset({"put", "place", "drop", "toss", "throw", "set", "lay", "stick", "pop"})
_SPOT_WHERE = frozenset(f"the {spot} where" for spot in ("spot", "place", "position", "location"))
_POINTING = word_set("over up down back right out from in on here")
_MORE = frozenset({"more", "further", "farther", "extra"})
_MEASURING = frozenset({"UNIT", "AMOUNT"})
_SAME_AGAIN = frozenset({"same amount", "same distance", "same again"})
_NEARER = frozenset({"closer", "nearer"})
_STANDS = frozenset({"is", "was", "stands", "stood", "sits", "sat", "lies", "lay"})
_AT_PRESENT = frozenset(
    {"now", "currently", "standing", "before", "right now", "standing now", "originally", "earlier"}
)
_TO = frozenset({"to", "towards", "toward", "the"})


class Axis(str):
    """A direction named by its axis: a negative distance along it is one the other way."""


class Whereabouts(TakingTurns):
    """The rules for places, ways and distances."""

    @cached_property
    def _tells_before(self) -> bool:
        return not self.present.isdisjoint({"AFTER", "BEFORE"})

    @cached_property
    def depends_on(self) -> bool:
        """Whether the sentence has a condition."""
        return not {"if", "unless"}.isdisjoint(self.texts)

    def _place(self, i: int) -> Found[Any]:
        found: Found[Any] = []
        if "ROBOT" in self.present:
            found += self._by_robot(i, None)
            found += [hit for j, metres in self.distance(i) for hit in self._by_robot(j, metres)]
        for j, relation in self.relation(i):
            found.append((j, Table() if relation.kind == "on" and not relation.refs else relation))
        for j, metres in self.distance(i):
            for start in ([j + 1] if self.text(j) in ("away",) else []) + [j]:
                for k, relation in self.relation(start):
                    if relation.kind in ("left", "right", "front", "back", "from", "away"):
                        found.append((k, Relation(relation.kind, relation.refs, metres)))
        text = self.text(i)
        if text in ("inside", "within"):
            found.append((i + 1, Relation("in", (IT,))))
        if text in ("in", "into", "inside") and self.text(i + 1) == "there":
            found.append((i + 2, Relation("in", (IT,))))
        there = self._put_there(i) if text == "there" else ""
        if there == "on" and not self.depends_on:
            # "put the honey on the beans, then put the jam there": on the beans, or on the honey?
            there = ""
        if text == "there" and (self._tells_before or there):
            # "put the stone in the tub after you put the bulb there", "..., then take the bulb and put it there"
            found.append((i + 1, Relation(there or "in", (IT,))))
        if text == "in" and (i + 1 == len(self.tokens) or self.tokens[i + 1].kind == "mark" or self.tag(i + 1, "THEN")):
            # "open the drawer, put the can in and close it"
            found.append((i + 1, Relation("in", (IT,))))
        if text == "in" and self.text(i - 1) in _INTO_IT and self.tag(i + 1, "THE"):
            # "open the drawer, put in the can and the cup"
            found.append((i + 1, Relation("in", (IT,))))
        here = self.tags[i] if i < self.count else {}
        found += [(j, Relation(side, (IT,))) for j, side in here.get("ITS_SIDE", ())]
        if text == "on" and self.text(i + 1) == "top" and self.text(i + 2) != "of":
            found.append((i + 2, Relation("on", (IT,))))
        for start, _ in here.get("SO_THAT", ()):
            found += self._place(start)
        if text == "not":
            # "not in the red bin but in the blue one"
            for j, _ in self._place(i + 1):
                k = j + 1 if self.text(j) == "," else j
                found += self._place(k + 1) if self.text(k) == "but" else []
        found += self.region(i)
        found += self._coordinates(i)
        found += [(j, Original(text == "where")) for j, _ in here.get("ORIGINAL", ())]
        where = i + 1 if text == "where" else i + 2 if self.said(i, i + 2) == "to where" else i
        if text in ("in", "on", "to", "at", "into") and self.said(i + 1, i + 4) in _SPOT_WHERE:
            where = i + 4
        if text in ("in", "on", "to", "at", "into", "onto"):
            # "on the place of the ginger"
            for k in self.optional(i + 1, "THE"):
                if self.text(k) in ("place", "spot", "position") and self.text(k + 1) == "of" and k > i + 1:
                    found += [(j, Spot((ref,))) for j, ref in self.np(k + 2) if not (ref.plural or ref.unknown)]
        for j, ref in self.np(where) if where > i and not self.tag(where, "PRON") else ():
            # "to where the wrench is now"
            if self.text(j) in _STANDS and not (ref.plural or ref.unknown):
                ends = [k for k in (j + 2, j + 3) if self.said(j + 1, k) in _AT_PRESENT]
                found += [(k, Spot((ref,))) for k in (*ends, j + 1)]
        for j, _ in here.get("FREE", ()):
            for k in self._of_table(j):
                found.append((k, Table()))
        if text in ("to", "on", "onto", "back") and self.text(i + 1) in ("the", "on", "to", "onto"):
            k = i + 3 if self.text(i + 2) == "the" else i + 2
            found += [(j, Table()) for j, _ in self.tag(k, "TABLE")]
        return found

    def _put_there(self, i: int) -> str:
        """Return the kind of the place told last before a "there" that ends an order to put something; "" for no such."""
        verb = next((k for k in range(i - 1, max(i - 6, 0), -1) if "VERB" in self.tags[k]), 0)
        ends = i + 1 >= self.count or self.tokens[i + 1].kind == "mark" or bool(self.tag(i + 1, "THEN"))
        if not (ends and verb and self.text(verb) in _INTO_IT and self.text(i - 1) not in _POINTING):
            return ""
        told = next((hits for k in range(verb - 1, 0, -1) for hits in [self.relation(k)] if hits), [])
        kinds = {relation.kind if relation.refs else "" for _, relation in told}
        return kinds.pop() if kinds in ({"in"}, {"on"}) else ""

    def _coordinates(self, i: int) -> Found[At]:
        j = i
        while self.text(j) in _COORDINATE_WORDS:
            j += 1
        values: list[float] = []
        labelled: dict[str, float] = {}
        k = j
        while len(values) + len(labelled) < 3:
            axis = ""
            if self.text(k) in ("x", "y", "z") and (
                k > j or i < k or self.text(k + 1) in ("=", ":", "is") or self._is_number(k + 1)
            ):
                axis = self.text(k)
                k += 1
                while self.text(k) in ("=", ":", "is", "of", "at"):
                    k += 1
            if not self._is_number(k):
                break
            value = self.tokens[k].number
            k += 1
            units = self.tag(k, "UNIT")
            if units and self.text(k) != "in":
                k, scale = units[0]
                value *= scale
            if axis:
                labelled[axis] = value
            else:
                values.append(value)
            if len(values) + len(labelled) < 2:
                while self.text(k) in (",", "and", ";", "by", "/"):
                    k += 1
            elif self.text(k) == "," and (self._is_number(k + 1) or self.text(k + 1) == "z"):
                return []
        if self.text(k) == "," and i > 0 and self.tokens[i - 1].raw == "(":
            k += 1
        if set(labelled) == {"x", "y"} and not values:
            return [(k, At(labelled["x"], labelled["y"]))]
        if len(values) == 2 and not labelled and j > i:
            return [(k, At(values[0], values[1]))]
        return []

    def _is_number(self, i: int) -> bool:
        return i < len(self.tokens) and self.tokens[i].kind == "number"

    @cached_property
    def tells_distance(self) -> bool:
        """Whether a number, a unit or an amount is said, so that a distance may be."""
        told = not _MEASURING.isdisjoint(self.present) or "same" in self.texts
        counted = (k for k, tags in enumerate(self.tags) if "NUM" in tags and self.texts[k] not in ("a", "an"))
        return told or next(counted, None) is not None or any(token.kind == "number" for token in self.tokens)

    @rule
    def distance(self, i: int) -> Found[float]:
        """As in "by about 10 cm", "two inches", "half a metre", "a bit"."""
        found: Found[float] = []
        if i >= self.count or not self.tells_distance:
            return found
        start = i + 1 if self.text(i) == "by" else i
        if self.text(start) in ("the", "that") and self.said(start + 1, start + 3) in _SAME_AGAIN:
            # "left by 50 mm, then forward by the same amount"
            before = [hits for k in range(i - 1, -1, -1) for hits in [self.distance(k)] if hits]
            found += [(start + 3, value) for _, value in before[0][:1]] if before else []
        for start in self.optional(i, "ABOUT"):
            found += [(j, value) for j, value in self.tag(start, "AMOUNT")]
            numbers: list[tuple[int, float]] = []
            if self._is_number(start):
                numbers.append((start + 1, self.tokens[start].number))
                if self.text(start + 1) == "/" and self._is_number(start + 2) and self.tokens[start + 2].number:
                    numbers.append((start + 3, self.tokens[start].number / self.tokens[start + 2].number))
            numbers += self.tag(start, "NUM")
            for j, number in [*numbers]:
                # "five or so cm", "5 to 10 cm", "between 5 and 10 cm"
                if self.said(j, j + 2) == "or so":
                    numbers.append((j + 2, number))
                lower = self.text(j) in ("to", "-") or (self.text(j) == "and" and self.text(start - 1) == "between")
                upper = self.tokens[j + 1].number if lower and self._is_number(j + 1) else 0.0
                if abs(upper) > number:
                    numbers.append((j + 2, (number + abs(upper)) / 2))
            if self.text(start) == "between":
                found += [(k, value) for k, value in self.distance(start + 1) if self._is_number(start + 1)]
            for j, number in numbers:
                if self._is_number(j - 1) and 0 < number < 1 and not self.tag(j, "UNIT"):
                    found.append((j, number))
                if self.text(j) == "in" and self._ends_amount(j + 1):
                    found.append((j + 1, number * 0.0254))
                for m in self._corrected(j):
                    # "5, no, 10 cm"
                    found += [(k, value) for k, value in self.distance(m) if self._is_number(m)]
                for k, unit in self.tag(j, "UNIT"):
                    for m in self._corrected(k):
                        found += [(end, value) for end, value in self.distance(m) if self._is_number(m)]
                    found.append((k, number * unit))
                    found += [(k + 1, number * unit)] if self.text(k) in _MORE else []
                    found += [(k + 2, number * unit)] if self.said(k, k + 2) == "or so" else []
                    if self.text(k) == "and":
                        found += [(k + 3, (number + 0.5) * unit)] if self.said(k, k + 3) == "and a half" else []
        return found

    def _bare_number(self, i: int) -> float | None:
        """Return the metres of a number without a unit, which has the unit said last before it."""
        if not self._is_number(i):
            return None
        units = [unit for j in range(i) for _, unit in self.tag(j, "UNIT")]
        return self.tokens[i].number * units[-1] if units else None

    def _ends_amount(self, i: int) -> bool:
        """Say whether "2 in" before `i` can only be inches."""
        closed = i >= len(self.tokens) or self.tokens[i].kind == "mark" or bool(self.tag(i, "THEN"))
        return closed or any(self.text(i) == side or end > i + 1 for end, side in self.tag(i, "DIR"))

    def _by_robot(self, i: int, metres: float | None) -> Found[ByRobot]:
        """As in "in front of the robot", "half a metre left of your base", "close to you"."""
        return [
            (end, ByRobot(side, metres))
            for j, side in self.tag(i, "REL")
            if side in ("front", "left", "right") or (side == "beside" and metres is None)
            for k, _ in self.tag(j, "ROBOT")
            for end in ([k + 1] if self.text(k) == "base" else [k])
        ]

    def _direction(self, i: int) -> Found[str]:
        found: Found[str] = [
            (j, Axis(value) if {"x", "y"} & {self.text(k) for k in range(i, j)} else value)
            for j, value in self.tag(i, "DIR")
            if not (j == i + 1 and self.text(i) in _NEARER and self.text(j) in _TO)
        ]
        if self.text(i) in ("straight", "directly", "further", "farther", "back"):
            # "back to the right", but not "back left".
            found += [(j, value) for j, value in self.tag(i + 1, "DIR") if self.text(i) != "back" or j > i + 2]
        return found
