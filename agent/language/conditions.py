"""Conditions about what is there and how it is: "if there are more cans than cubes", "unless nothing is on the cube"."""

from __future__ import annotations

from abc import ABC
from dataclasses import replace as changed
from typing import Literal

from robosandbox.agent.language.antecedents import THERE, THING
from robosandbox.agent.language.chart import Found, distinct, rule
from robosandbox.agent.language.intent import IT, Ref, Relation, replace
from robosandbox.agent.language.logic import Alike, Bound, Condition, Is, More, Not, Several, There
from robosandbox.agent.language.modifiers import HELD, STATES
from robosandbox.agent.language.towers import Towers
from robosandbox.agent.language.wordlist import word_set

_STILL = word_set("still already currently now then yet")
_POSTURES = word_set("standing sitting lying resting placed stacked left")
_AROUND = word_set("anywhere around left here remaining")
_REMAINING = _AROUND | {"is", "are"}
_HOLDS = word_set("has have contains contain holds hold")
_HANDS = word_set("gripper hand fingers claw")
_SEEN: tuple[tuple[tuple[str, ...], bool], ...] = tuple(
    (tuple(phrase.split()), denied)
    for phrases, denied in (
        ("there are not|there is not|you do not see|you do not find|you can not see|you can not find", True),
        ("there is|there are|you see|you find|you spot|you notice|you can see|you can find|you can spot", False),
    )
    for phrase in phrases.split("|")
)
_INSIDE: dict[str, tuple[str, ...]] = {
    "in": ("in it", "inside it", "in there", "in them", "inside"),
    "on": ("on it", "on top of it", "on them", "on top"),
}
_BOUNDS: tuple[tuple[tuple[str, ...], int, int | None], ...] = tuple(
    (tuple(words.split()), least, most)
    for words, least, most in (
        ("at least", 0, None),
        ("no fewer than", 0, None),
        ("no less than", 0, None),
        ("more than", 1, None),
        ("over", 1, None),
        ("at most", -1, 0),
        ("no more than", -1, 0),
        ("fewer than", -1, -1),
        ("less than", -1, -1),
        ("under", -1, -1),
        ("exactly", 0, 0),
        ("precisely", 0, 0),
        ("only", 0, 0),
        ("just", 0, 0),
    )
)
"""What comes before a number, and what it adds to it for the least and the most; -1 for the least is none."""
_MORE: tuple[tuple[str, str, Literal["more", "fewer", "as many"]], ...] = (
    ("more", "than", "more"),
    ("fewer", "than", "fewer"),
    ("less", "than", "fewer"),
    ("as many", "as", "as many"),
)
_SAME = tuple(
    tuple(words.split())
    for words in ("of the same colour", "of the same color", "the same colour", "the same color", "of one colour")
)
_FREE = word_set("free clear")
_LIMITS = frozenset(words[0] for words, _, most in _BOUNDS if most == 0 and len(words) == 1)
"""Words that say a number is all: "exactly one" is no mere one."""


def _number(word: str) -> int | None:
    return {"one": 1, "zero": 0, "none": 0, "a": 1, "an": 1}.get(word)


class Conditions(Towers, ABC):
    """The rules for conditions."""

    @rule
    def condition(self, i: int) -> Found[Condition]:
        """Return what is told to be so or not from `i` on: one condition, or several of which all or any hold."""
        either = self.text(i) == "either"
        found: Found[Condition] = [] if either else self._single(i)
        for j, first in self._single(i + either):
            k = j + (self.text(j) == "," and self.text(j + 1) in ("and", "or"))
            word = self.text(k)
            if word not in ("and", "or") or (either and word == "and"):
                continue
            more = self.condition(k + 1)
            if isinstance(first, There):
                # "if there are two cubes and one can"
                more = more + [
                    (m, There(ref, bound, first.text))
                    for m, ref, bound in self._some(k + 1)
                    # "a can and a ball on the tray": is the can there, too?
                    if ref.relations == first.what.relations
                ]
            for end, other in more:
                parts = other.of if isinstance(other, Several) and other.every == (word == "and") else (other,)
                if not any(isinstance(part, Several) for part in parts):
                    found.append((end, Several((first, *parts), word == "and", self.said(i, end))))
        return distinct(found)

    def _single(self, i: int) -> Found[Condition]:
        found: Found[Condition] = []
        for words, denied in _SEEN:
            if self.text(i) == words[0] and tuple(map(self.text, range(i, i + len(words)))) == words:
                k = self._still(i + len(words))
                found += [(j, Not(there) if denied else there) for j, there in self._existing(i, k)]
                found += self._compared_counts(i, k)
                if self.text(k) in ("neither", "no"):
                    found += self._none_of(i, k + 1)
        if self.text(i) == "neither":
            found += self._none_of(i, i + 1)
        for j, ref, bound in self._some(i):
            # "nothing is on the cube", "two balls are in the tray", "any cube is red"
            for end, so in self._predicates(i, self._still(j + 1), ref) if self.text(j) in ("is", "are") else ():
                told = so.so
                plain = all(r.refs and not r.directional for r in told.relations) and not (told.nouns or told.ranks)
                if plain and ref.determiner != "it":
                    full = replace(
                        ref, relations=(*ref.relations, *told.relations), colours=(*ref.colours, *told.colours)
                    )
                    found += self._there(i, end, full, bound)
        found += self._having(i)
        found += self._in_hand(i)
        found += self._states(i)
        return [(j, condition) for j, condition in found if j > i]

    def _still(self, i: int) -> int:
        while self.text(i) in _STILL:
            i += 1
        return i

    # How many.

    def _amount(self, i: int) -> Found[Bound]:
        """As in "at least two", "no", "more than ten", "three or more"."""
        found: Found[Bound] = [(i + 1, Bound(0, 0))] if self.text(i) in ("no", "none", "zero") else []
        found += [(i + 1, Bound())] if self.text(i) in ("any", "some") else []
        for words, least, most in _BOUNDS:
            if tuple(map(self.text, range(i, i + len(words)))) == words:
                for j, number in self._whole_number(i + len(words)):
                    found.append(
                        (j, Bound(max(number + least, 0) if least >= 0 else 0, most if most is None else number + most))
                    )
        for j, number in self._whole_number(i) if self.text(i) not in ("a", "an", "none", "zero") else []:
            if self.text(j) == "or" and self.text(j + 1) in ("more", "fewer", "less"):
                more = self.text(j + 1) == "more"
                found.append((j + 2, Bound(number) if more else Bound(0, number)))
            found.append((j, Bound(number, loose=True)))
        return found

    def _whole_number(self, i: int) -> Found[int]:
        number = _number(self.text(i))
        return self._count(i) or ([(i + 1, number)] if number is not None else [])

    def _some(self, i: int) -> list[tuple[int, Ref, Bound]]:
        """As in "a ball", "nothing", "no ball", "more than two cans on the tray", "two of them"."""
        if self.text(i) in ("nothing", "something", "anything"):
            bound = Bound(0, 0) if self.text(i) == "nothing" else Bound()
            k = self._still(i + 1)
            k += self.text(k) in ("else", "more")
            k += self.text(k) in _POSTURES
            return [(k, replace(THING, text=self.said(i, k)), bound)] + [
                (j, replace(THING, text=self.said(i, j), relations=(relation,)), bound)
                for j, relation in self.relation(k)
                if relation.refs and not relation.directional
            ]
        found: list[tuple[int, Ref, Bound]] = []
        for k, bound in self._amount(i):
            of_them = k + 2 if self.said(k, k + 2) in ("of them", "of those", "of these") else k
            if of_them > k or k >= self.count or self.tokens[k].kind == "mark" or self.text(k) in _REMAINING:
                found.append((of_them, replace(IT, text="them", plural=True), bound))
            # "one of the bins", "none of the cubes": how many of them no longer is a bare number.
            found += [
                (j, replace(ref, determiner="a", text=self.said(i, j)), changed(bound, loose=False))
                for j, ref in (self.np(k + 1) if self.text(k) == "of" else ())
                if ref.plural and ref.determiner in ("the", "all") and ref.number is None and _plainly(ref)
            ]
            found += [
                (j, replace(ref, text=self.said(i, j)), bound)
                for j, ref in self.np(k)
                if ref.determiner == "bare" and ref.number is None and _plainly(ref)
            ]
        found += [
            (j, ref, Bound())
            for j, ref in (self.np(i) if self.text(i) not in _LIMITS else ())
            if (ref.determiner == "a" or (ref.determiner == "bare" and ref.plural and ref.number is None))
            and _plainly(ref)
        ]
        return found

    def _existing(self, i: int, k: int) -> Found[Condition]:
        """What is there, told from `k` on after "there is" at `i`."""
        found: Found[Condition] = []
        for j, ref, bound in self._some(k):
            for end in (j, j + 1) if self.text(j) in _AROUND else (j,):
                found += self._there(i, end, ref, bound)
            # "if there are any cubes left on the table"
            for end, relation in self.relation(j + 1) if self.text(j) in _AROUND and not ref.relations else ():
                found += [] if relation.directional else self._there(i, end, replace(ref, relations=(relation,)), bound)
        return found

    def _there(self, i: int, end: int, ref: Ref, bound: Bound) -> Found[Condition]:
        if ref.nouns == THING.nouns and not ref.colours and not ref.relations:
            # "if there is nothing": where?
            return []
        if ref.determiner != "it":
            ref = replace(ref, determiner="a", number=None)
        return [(end, There(ref, bound, self._without_not(i, end)))]

    def _none_of(self, i: int, k: int) -> Found[Condition]:
        """As in "there is neither a banana nor an apple"."""
        if self.text(k - 1) != "neither":
            return []
        found: Found[Condition] = []
        for j, first, bound in self._some(k):
            if self.text(j) == "nor" and bound == Bound():
                for end, second, _ in self._some(j + 1):
                    told = self.said(i, end)
                    refs = [replace(ref, determiner="a", number=None) for ref in (first, second)]
                    found.append((end, Several(tuple(There(ref, Bound(0, 0), told) for ref in refs), True, told)))
        return found

    def _compared_counts(self, i: int, k: int) -> Found[Condition]:
        """As in "more red cubes than blue ones", "as many cans as balls"."""
        found: Found[Condition] = []
        for words, than, sign in _MORE:
            begin = k + len(words.split())
            for j, one in self.np(begin) if self.said(k, begin) == words else ():
                for end, other in self.np(j + 1) if self.text(j) == than and one.plural else ():
                    if other.one and not (other.nouns or other.names):
                        other = replace(other, nouns=one.nouns, names=one.names, one=False)
                    if other.plural and _plainly(one) and _plainly(other):
                        found.append((end, More(one, other, sign, self.said(i, end))))
        return found

    def _having(self, i: int) -> Found[Condition]:
        """As in "the tray has nothing in it", "the cube has something on top", "the bowl contains two balls"."""
        found: Found[Condition] = []
        for j, holder in self.np(i) if not _HOLDS.isdisjoint(self.texts) else ():
            j = self._still(j)
            denied = self.text(j) in ("does", "do") and self.text(j + 1) == "not"
            j += 2 * denied
            if self.text(j) not in _HOLDS or holder.unknown or holder.plural:
                continue
            for k, ref, bound in self._some(self._still(j + 1)):
                ends = [(k, "in")] if self.text(j) not in ("has", "have") else []
                ends += [
                    (k + len(words), kind)
                    for kind, phrases in _INSIDE.items()
                    for words in map(str.split, phrases)
                    if self.texts[k : k + len(words)] == words
                ]
                for end, kind in ends if not ref.relations and ref.determiner != "it" else ():
                    inside = replace(ref, relations=(Relation(kind, (holder,)),))
                    there = self._there(i, end, inside, bound)
                    found += [(m, Not(each) if denied else each) for m, each in there]
        return found

    def _in_hand(self, i: int) -> Found[Condition]:
        """As in "you are holding something", "your hand is empty"."""
        found: Found[Condition] = []
        if self.said(i, i + 3) in ("you are holding", "you do hold") or self.said(i, i + 2) == "you hold":
            k = i + 3 if self.text(i + 1) != "hold" else i + 2
            denied = self.text(k) == "not"
            for j, ref, bound in self._some(k + denied):
                what = replace(ref, relations=(*ref.relations, HELD), determiner="a")
                some = There(what, bound, self._without_not(i, j))
                found.append((j, Not(some) if denied else some))
            for j, ref in self.np(k + denied):
                if ref.determiner == "the" and not ref.plural:
                    found.append((j, self._being(i, j, ref, relations=(HELD,))))
        start = i + (self.text(i) in ("your", "the"))
        if self.text(start) in _HANDS and self.text(start + 1) == "is" and self.text(start + 2) in ("empty", "free"):
            held = replace(THING, relations=(HELD,))
            found.append((start + 3, There(held, Bound(0, 0), self.said(i, start + 3))))
        return found

    # How it is.

    def _states(self, i: int) -> Found[Condition]:
        """As in "the drawer is open", "the cans are not in the bin", "the ball is closer to the bin than the cube"."""
        found: Found[Condition] = []
        if self.text(i) == "they" and self.text(i + 1) == "are":
            found += [(j, Alike((replace(IT, plural=True),), self.said(i, j))) for j in self._same(i + 2)]
        for j, refs in self.np_list(i):
            if self.text(j) not in ("is", "are") or any(ref.unknown or ref.determiner == "a" for ref in refs):
                continue
            k = self._still(j + 1)
            denied = self.text(k) == "not" or self.said(k, k + 2) == "no longer"
            k += 2 if self.text(k) == "no" else denied
            k = self._still(k)
            first, others = refs[0], refs[1:]
            k += self.text(k) in ("all", "both") and (bool(others) or first.plural)
            if others or first.plural:
                found += [(end, Alike(refs, self.said(i, end))) for end in self._same(k)]
            for end, so in self._predicates(i, k, first):
                conditions = [so, *(Is(ref, so.so, so.text, so.among) for ref in others)]
                whole: Condition = Several(tuple(conditions), True, self._without_not(i, end)) if others else so
                found.append((end, Not(whole) if denied else whole))
        return found

    def _same(self, k: int) -> list[int]:
        return [k + len(words) for words in _SAME if tuple(map(self.text, range(k, k + len(words)))) == words]

    def _predicates(self, i: int, k: int, ref: Ref) -> Found[Is]:
        found: Found[Is] = []
        for m, colour in self.tag(k, "COLOUR"):
            found.append((m, self._being(i, m, ref, colours=(colour,))))
            for n, other in self.tag(m + 1, "COLOUR") if self.text(m) == "or" else ():
                found.append((n, self._being(i, n, ref, colours=(colour, other))))
        states = [(k + 1, STATES[self.text(k)])] if self.text(k) in STATES else []
        states += [(k + 1, Relation("bare"))] if self.text(k) in _FREE else []
        states += [(k + 1, THERE)] if self.text(k) == "there" else []
        states += [(m, HELD) for m, _ in self.tag(k, "HELD")]
        states += [
            (m, relation)
            for start in ((k, k + 1) if self.text(k) in _POSTURES else (k,))
            for m, relation in self.relation(start)
            if not relation.directional
        ]
        states += self._exceeds(k)
        found += [(m, self._being(i, m, ref, relations=(relation,))) for m, relation in states]
        for m, kind in self.np(k):
            plain = kind.determiner == "a" and kind.nouns and not (kind.relations or kind.unknown or kind.ranks)
            singled = kind.determiner == "the" and kind.ranks and not kind.unknown
            if (plain or singled) and not ref.plural:
                found.append((m, Is(ref, kind, self._without_not(i, m))))
        return found

    def _being(
        self, i: int, end: int, ref: Ref, *, colours: tuple[str, ...] = (), relations: tuple[Relation, ...] = ()
    ) -> Is:
        return Is(ref, Ref(text="", colours=colours, relations=relations), self._without_not(i, end))

    def _exceeds(self, k: int) -> Found[Relation]:
        """As in "taller than the can", "farther away than the cube", "closer to the bin than the ball"."""
        found: Found[Relation] = []
        for m, key in self.tag(k, "SUPER"):
            m += self.text(m) == "away"
            anchors: list[tuple[int, tuple[Ref, ...]]] = [(m, ())]
            if key in ("near", "far") and self.text(m) in ("to", "from"):
                anchors = [(end, ()) for end, _ in self.tag(m + 1, "ROBOT")] or [
                    (end, (anchor,)) for end, anchor in self.np(m + 1) if not anchor.plural
                ]
            for end, anchor in anchors:
                for n, other in self.np(end + 1) if self.text(end) == "than" else ():
                    if not (other.plural or other.unknown):
                        n += self.text(n) == "is" and self.text(n + 1) not in STATES
                        found.append((n, Relation("than", (other, *anchor), order=key)))
        return found

    def _without_not(self, i: int, end: int) -> str:
        """Return what is said to be so, or denied."""
        return " ".join(text for text in self.texts[i:end] if text != "not")

    def closed_off(self, j: int) -> bool:
        """Say whether a condition may end at `j`: at a mark, "then", or where an order begins."""
        return (
            self._skip(j) > j
            or self.text(j) == "then"
            or (j < self.count and not {"VERB", "PREAMBLE"}.isdisjoint(self.tags[j]))
            or j >= self.count
        )


def _plainly(ref: Ref) -> bool:
    """Say whether a description is one of a kind of thing, with nothing that singles one out."""
    named = ref.nouns or ref.names or ref.colours
    return bool(named) and not (ref.unknown or ref.options or ref.claims or ref.other or ref.ranks)
