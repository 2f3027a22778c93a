"""Noun phrases: "the second smallest red block on the tray", alone and in lists, every way to read them."""

from __future__ import annotations

from abc import ABC

from robosandbox.agent.language.chart import Found, distinct, rule
from robosandbox.agent.language.choices import Choices
from robosandbox.agent.language.intent import Rank, Ref, replace
from robosandbox.agent.language.modifiers import says_nothing
from robosandbox.agent.language.tokens import WAITED_FOR, id_parts

_ALL_THINGS = frozenset({"EVERYTHING", "EVERYTHING_ELSE"})


class Phrases(Choices, ABC):
    """The rules for whole noun phrases."""

    @rule
    def np(self, i: int) -> Found[Ref]:
        """One noun phrase, with and without what follows the noun."""
        found: Found[Ref] = []
        if i >= self.count or self.tokens[i].kind == "mark":
            return found
        here = self.tags[i]
        for j, which in here.get("PRON", ()):
            them = which == "them"
            two = 2 if {"both", "two"} & {*self.texts[i:j]} else None
            base = Ref(text=self.said(i, j), determiner="it", plural=them, number=two)
            found.append((j, base))
            if self.text(j) in ("all", "both"):
                found.append((j + 1, replace(base, plural=True, number=2 if self.text(j) == "both" else None)))
        found += self._everything(i)
        for j, _ in here.get("SOMETHING", ()):
            for k, ref in self._adjectives(j, Ref(text="", determiner="a", nouns=("thing",)), 0):
                found += self._modified(k, replace(ref, text=self.said(i, k)), 0)
        for j, base in self._determiners(i):
            if j == i and self.opens_none(i):
                continue
            for k, ref in self._head(j, base):
                if ref.share and not self.text(k - 1).endswith("s"):
                    # "half the cake" is no number of things.
                    continue
                for end, full in self._modified(k, ref, 0):
                    found.append((end, replace(full, text=self.said(i, end))))
        is_ = i + 2 if self.text(i + 1) in ("thing", "object") else i + 1
        if self.text(i) in ("whatever", "whichever", "what") and self.text(is_) == "is":
            # "whatever is closest to the bin", "whichever thing is red"
            thing = Ref(text="", determiner="the", nouns=("thing",))
            modified = [*self._modifier(is_ + 1, thing), *self._said_of(is_ + 1, thing)]
            if self.text(is_ + 1) == "not":
                modified = [*modified, *self._modifier(is_, replace(thing, text="what"))]
            for j, ref in modified:
                # "whatever is closest" is one thing, "whatever is not blue" all such things.
                each = ref if ref.ranks else replace(ref, determiner="all", plural=True)
                found.append((j, replace(each, text=self.said(i, j))))
        if self.text(i) in ("all", "everything") and self.text(i + 1) == "what":
            found += self.np(i + 1)
        telling = self.text(i) in ("what", "whatever") or (self.text(i) == "whichever" and is_ > i + 1)
        for j, colour in self.tag(is_ + 1, "COLOUR") if telling and self.text(is_) == "is" else []:
            found.append(
                (j, Ref(text=self.said(i, j), determiner="all", nouns=("thing",), colours=(colour,), plural=True))
            )
        if self.text(i) in ("number", "no") and self._suffix(i + 1):
            # "all vials except number two"
            found.append((i + 2, Ref(text=self.said(i, i + 2), names=(self._suffix(i + 1),))))
        found += self._broken_off(i) if "CORRECTION" in self.present else []
        found += self._alternatives(i, found)
        if self.text(i) == "not":
            for j, first in self.np(i + 1):
                k = j + 1 if self.text(j) == "," else j
                k += self.text(k) == "but"
                for end, ref in self.np(k) if k > j else ():
                    if (
                        ref.one
                        and not ref.nouns
                        and ref.determiner == "the"
                        and self.text(end - 1) not in self.words.ids
                    ):
                        # "not the red cup, the blue one"; "not the apple, the orange" is no orange apple.
                        kind = first.names if len(first.names) == 1 and first.names[0].isalpha() else ()
                        found.append((end, replace(ref, nouns=first.nouns, names=kind, one=not (first.nouns or kind))))
                    elif self.text(k - 1) == "but" or (single(first) and single(ref) and first.nouns == ref.nouns):
                        # "not the red cube, the yellow cube"
                        found.append((end, ref))
        for j, ref in list(found):
            k = j + 1 if self.text(j) == "," else j
            for m, _ in self.tag(k, "INSTEAD"):
                # "in the bowl, not into the cup"
                m += k > j and self.text(m) in _INTO and self.text(i - 1) in _INTO
                for end, others in self._either(m):
                    if any(o.unknown or o.text.endswith("all of them") or says_nothing(o) for o in others):
                        # "that box, not the usual one": who knows which that is?
                        continue
                    # "a bowl but not the blue one" leaves that one out; "the red cube, not the blue one" says it twice.
                    plain = not (ref.colours or ref.ranks or ref.relations or ref.names)
                    chosen = ref.determiner in ("a", "all") or ref.plural or (plain and len(others) > 1)
                    full = replace(ref, without=(*ref.without, *others)) if chosen else replace(ref, instead=others)
                    if self.said(m - 2, m) == "but not":
                        full = replace(full, text=self.said(i, end))
                    found.append((end, full))
                    if k > j and self.text(end) == ",":
                        # "the pink ball, not the green one, goes in the bowl"
                        found.append((end + 1, full))
        found += self._apposed(found)
        if self.text(i) in ("whichever", "whatever"):
            # "whichever die is farther from you"
            for j, ref in self._head(i + 1, Ref(text="")):
                whose = ref.nouns and not (ref.ranks or ref.unknown) and self.text(j) == "is"
                for end, better in self._modifier(j + 1, ref) if whose else ():
                    found.append((end, replace(better, text=self.said(i, end))))
                for start in self.optional(j + 1, "THE") if whose else ():
                    for end, key in self.tag(start, "SUPER"):
                        which = replace(ref, ranks=(Rank(key),), text=self.said(i, end))
                        found += [(m, replace(r, text=self.said(i, m))) for m, r in self._anchored(end, which)]
                        found.append((end, which))
        known = {end for end, ref in found if not ref.unknown}
        return distinct([(end, ref) for end, ref in found if not ref.unknown or end not in known])

    def _broken_off(self, i: int) -> Found[Ref]:
        """As in "the left, no wait, right bin": an adjective that was taken back."""
        found: Found[Ref] = []
        for j, _ in self.tag(i, "THE"):
            for k in [end for tag in ("POS", "SUPER", "SIZE", "COLOUR") for end, _ in self.tag(j, tag)]:
                for m in self._corrected(k):
                    for end, ref in self.np(m):
                        again = ref.determiner == "the" and self.text(i - 1) not in ("to", "on", "from", "at", "by")
                        told = not ref.one and not ref.unknown and (ref.ranks or ref.colours)
                        if told and (again or ref.determiner == "bare"):
                            found.append((end, replace(ref, determiner="the", text=self.said(m, end))))
        return found

    def _apposed(self, found: Found[Ref]) -> Found[Ref]:
        """As in "the ball, the pink one": the second says which."""
        apposed: Found[Ref] = []
        for j, ref in found:
            if ref.determiner == "a" and ref.nouns and self.text(j) == ",":
                # "a pen, any pen"
                apposed += [
                    (k, ref) for k, other in self.np(j + 1) if other.determiner == "a" and other.nouns == ref.nouns
                ]
            if ref.determiner == "a" and ref.number == 1 and ref.nouns and self.text(j) == ",":
                # "one of the cups, the empty one"
                apposed += [
                    (k, replace(one, nouns=ref.nouns, one=False, other=ref.other, text=self.said(j + 1, k)))
                    for k, one in (self.np(j + 1) if self.tag(j + 1, "THE") else ())
                    if one.one and not (one.nouns or one.plural or one.other or one.number or says_nothing(one))
                ]
            told = ref.ranks or ref.shades or ref.colours
            if ref.one and not ref.nouns and told and not ref.plural and self.text(j) == ",":
                # "the smallest one, the dice"
                apposed += [
                    (k + (self.text(k) == ","), replace(named, text=ref.text, plural=False))
                    for k, named in (self.np(j + 1) if self.tag(j + 1, "THE") else ())
                    if (named.nouns or named.names)
                    and not (named.ranks or named.options or named.number)
                    and self.text(k) not in ("and", "or")
                ]
            which = ref.determiner == "the" and ref.nouns and not (ref.plural or ref.colours or ref.ranks or ref.names)
            if not which or self.text(j) not in (",", ".") or not self.tag(j + 1, "THE"):
                continue
            for k, better in self.np(j + 1):
                closer = better.one and not (better.nouns or better.plural or better.other or better.number)
                # "left of the bowl, the rightmost right" names another thing.
                closer = closer and bool(better.colours or self.text(k - 1) == "one")
                if closer and better.colours + better.ranks and self.text(k) not in ("and", "or"):
                    merged = replace(better, nouns=ref.nouns, names=ref.names, one=False, text=ref.text)
                    merged = replace(merged, relations=(*ref.relations, *better.relations))
                    apposed += [(k, merged)] + ([(k + 1, merged)] if self.text(k) in (",", ".") else [])
        return apposed

    def _of_kind_corrected(self, better: Ref, wrong: Ref) -> Ref:
        """As in "the small red vial, no, the large one": of the kind that was named, if there are others of it."""
        alike = of_its_kind(better, wrong)
        several = sum(id_parts(name)[-1:] == alike.names for name in self.words.ids) > 1
        return alike if several and not wrong.nouns else replace(better, nouns=wrong.nouns, one=False)

    def _corrected(self, j: int) -> list[int]:
        """As in "the red cube, no wait, sorry, the blue one": where the better words start."""
        if "CORRECTION" not in self.present:
            return []
        k = j
        while self.text(k) in (",", ".", ";", "!"):
            k += 1
        ends = [m for m, _ in self.tag(k, "CORRECTION") if k > j or m > k + 1 or self.text(k) == "sorry"]
        # "..., the brown one I mean, and then go home" goes on.
        ends = [m for m in ends if not (self.text(m - 1) in ("mean", "meant") and self._goes_on(m))]
        # "..., no picking up the can" forbids; it corrects nothing.
        ends = [m for m in ends if not (self.text(m - 1) == "no" and self.text(m).endswith("ing"))]
        # "no olives" forbids, too, and "wait for me", "wait, then ..." asks for something.
        ends = [m for m in ends if not (self.text(m - 1) == "no" and any(ref.plural for _, ref in self._bare(m)))]
        ends = [m for m in ends if not self._waits(m)]
        for _ in range(3):
            ends = [m + 1 if self.text(m) in (",", ".") else m for m in ends]
            # "no, not the thread, the thimble"
            ends += [
                end + (self.text(end) in (",", "but"))
                for m in ends
                if self.text(m) == "not"
                for end, _ in self.np(m + 1)
            ]
            further = [n for m in ends for n, _ in self.tag(m, "CORRECTION")]
            if not further:
                break
            ends += further
        # What "not" denies is no better than what was said.
        return [m for m in dict.fromkeys(ends) if not (self.text(m) == "not" and self.np(m + 1))]

    def _waits(self, m: int) -> bool:
        after = m + 1 if self.text(m) in (",", ";", ".") else m
        return self.text(after) == "then" or (self.text(m - 1) == "wait" and self.text(after) in (*WAITED_FOR, "and"))

    def _bare(self, m: int) -> Found[Ref]:
        return [(end, ref) for end, ref in self.np(m) if ref.determiner == "bare"]

    def _goes_on(self, m: int) -> bool:
        k = m + 1 if self.text(m) in (",", ".", ";", "!") else m
        return k >= len(self.tokens) or (self.text(k) in ("and", "then") and bool(self.tag(k, "THEN")))

    def _denied(self, k: int) -> Ref | None:
        """Return what was said to be wrong just before `k`: "not the butter, ..."."""
        before = k - 1 if self.text(k - 1) in (",", "but") else k
        for m in range(max(0, k - 8), k):
            if self.text(m) == "not":
                return next((ref for end, ref in self.np(m + 1) if end == before), None)
        return None

    def _joint(self, j: int) -> int:
        """Return where the next item of a list starts, 0 if no list goes on at `j`."""
        k = j
        if self.text(k) == "first" and self.text(k + 1) in (",", "then", "and"):
            k += 1
        if self.text(k) == ",":
            k += 1
        if self.text(k) in ("and", "plus"):
            k += 1
        elif self.text(k) in ("together", "along") and self.text(k + 1) == "with":
            k += 2
        if self.text(k) in ("then", "also", "finally", "afterwards") and (k > j or self.text(k) == "then"):
            k += 1
        return k if k > j else 0

    def _everything(self, i: int) -> Found[Ref]:
        found: Found[Ref] = []
        if i >= self.count or _ALL_THINGS.isdisjoint(self.tags[i]):
            return found
        for j, _ in self.tag(i, "EVERYTHING"):
            base = Ref(text=self.said(i, j), determiner="all", plural=True)
            for k, ref in (*self._adjectives(j, base, 0), *self._said_of(j, base)):
                found += self._modified(k, ref, 0)
        for j, _ in self.tag(i, "EVERYTHING_ELSE"):
            found += self._modified(j, Ref(text=self.said(i, j), determiner="all", plural=True, other=True), 0)
        return [(j, replace(ref, text=self.said(i, j))) for j, ref in found]


_INTO = frozenset({"in", "into", "on", "onto", "to", "inside"})


def means(denied: Ref, ref: Ref) -> bool:
    """Say whether "the ball", or "the red one", takes up "the red ball"."""
    own = {part for name in ref.names for part in id_parts(name)}
    keys = {rank.key for rank in denied.ranks}
    told = {*denied.colours} <= {*ref.colours, *own} and keys <= {*(rank.key for rank in ref.ranks), *own}
    if denied.one and not (denied.nouns or denied.names):
        return told and bool(denied.colours or keys)
    return told and denied.nouns == ref.nouns and denied.names == ref.names


def of_its_kind(ref: Ref, other: Ref) -> Ref:
    """Return a description with "one" standing for what another names: "the right one" of "the left bin"."""
    if not ref.one or ref.nouns or ref.names:
        return ref
    names = id_parts(other.names[-1])[-1:] if other.names and not other.nouns else ()
    return replace(ref, nouns=other.nouns, names=names, one=False)


def single(ref: Ref) -> bool:
    """Say whether a description is of one definite thing."""
    return ref.determiner == "the" and not (ref.plural or ref.unknown or ref.options or ref.other)
