"""Noun phrases: "the second smallest red block on the tray", alone and in lists, every way to read them."""

from __future__ import annotations

from functools import cached_property

from robosandbox.agent.language.chart import Found, distinct, rule
from robosandbox.agent.language.choices import Choices
from robosandbox.agent.language.intent import Rank, Ref, Relation, replace
from robosandbox.agent.language.modifiers import HELD, says_nothing
from robosandbox.agent.language.tokens import WAITED_FOR, id_parts

_ALL_THINGS = frozenset({"EVERYTHING", "EVERYTHING_ELSE"})
_BEFORE_PLACES = frozenset({"on", "in", "to", "of", "into", "onto", "beside", "behind", "by", "near"})


class Phrasing(Choices):
    """The rules for whole noun phrases."""

    @cached_property
    def second_last_colour(self) -> int:
        """From where on fewer than two colours are said; -1 where there are not two."""
        return ([-1, -1, *(k for k in range(self.count) if "COLOUR" in self.tags[k])])[-2]

    @cached_property
    def second_last_place(self) -> int:
        """From where on fewer than two places in an order are said; -1 where there are not two."""
        placed = (k for k in range(self.count) if not self.tags[k].keys().isdisjoint(("POS", "SUPER")))
        return ([-1, -1, *placed])[-2]

    @cached_property
    def second_last_suffix(self) -> int:
        """From where on fewer than two letters or numbers of ids are said; -1 where there are not two."""
        return ([-1, -1, *(k for k in range(self.count) if self._suffix(k))])[-2]

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
        if self.said(i, i + 2) in ("the following", "the following things", "the following items"):
            found.append((i + 2, Ref(text="the following", determiner="it", plural=True)))
        telling = self.text(i) in ("what", "whatever") or (self.text(i) == "whichever" and is_ > i + 1)
        for j, colour in self.tag(is_ + 1, "COLOUR") if telling and self.text(is_) == "is" else []:
            found.append(
                (j, Ref(text=self.said(i, j), determiner="all", nouns=("thing",), colours=(colour,), plural=True))
            )
        if self.said(i, i + 2) == "the same":
            # "the same bin as the can"
            for j, (_, phrase, plural) in self.tag(i + 2, "NOUN"):
                for k, inner in self.np(j + 1) if self.text(j) == "as" and not plural else []:
                    where = Relation("holds", (inner,))
                    found.append((k, Ref(text=self.said(i, k), nouns=(phrase,), relations=(where,))))
        if self.text(i) in ("number", "no") and self._suffix(i + 1):
            # "all vials except number two"
            found.append((i + 2, Ref(text=self.said(i, i + 2), names=(self._suffix(i + 1),))))
        for j, _ in here.get("HELD_THING", ()):
            found.append((j, Ref(text=self.said(i, j), nouns=("thing",), relations=(HELD,))))
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

    @rule
    def np_list(self, i: int) -> Found[tuple[Ref, ...]]:
        """Noun phrases joined by commas and "and"."""
        found: Found[tuple[Ref, ...]] = []
        if i >= self.count or self.tokens[i].kind == "mark":
            return found
        found += self._shared_noun(i)
        paired = self._shared_places(i)
        found += paired
        pairs = {end for end, _ in paired}
        found += self._numbered(i)
        if self.text(i) == "not" and self.text(i + 1) in ("only", "just", "merely", "simply"):
            # "not only the can but the ball as well"
            for j, first in self.np(i + 2):
                k = j + 1 if self.text(j) == "," else j
                found += [(end, (first, other)) for end, other in self.np(k + 1)] if self.text(k) == "but" else []
        if self.text(i) == "first":
            # "put first the red cube, then the blue one in the bin"
            found += [(j, refs) for j, refs in self.np_list(i + 1) if len(refs) > 1]
        if self.text(i) == "both":
            # "both the can and the ball"
            found += [
                (j, refs) for j, refs in self.np_list(i + 1) if len(refs) == 2 and not any(r.plural for r in refs)
            ]
        senses: set[tuple[int, Ref]] = set()
        for j, first in self.np(i):
            found.append((j, (first,)))
            k = self._joint(j)
            one = first.number == 1 and first.determiner == "a" and self.text(k - 1) == "," and self.tag(k, "THE")
            if self.text(k) == "whichever" or (one and any(r.one and not r.nouns for _, r in self.np(k))):
                # "one of the cups, whichever is on the tray", "one of the cups, the empty one" is one cup.
                continue
            # A word may be a noun and a name: alone it is tried as both, in a list as what it is first.
            sense = (j, replace(first, nouns=(), names=(), one=False))
            if k and sense not in senses:
                senses.add(sense)
                again = self.text(j) == "," and self.text(k) in ("all", "both", "each", "every")
                for end, others in self.np_list(k):
                    lead = others[0]
                    level = any(rank.key in ("top", "bottom") for rank in lead.ranks)
                    if level and first.plural and {"one", "ones"} & {*lead.text.split()} and self.text(k - 1) == ",":
                        # "all the blocks, the big ones at the bottom": a tower's, and no others.
                        continue
                    member = lead.one and lead.ranks and not (lead.nouns or lead.names) and first.number
                    if member and first.plural and len(others) == 1 and self.text(k - 1) == ",":
                        # "stack the two blocks, the smaller one on the bigger one": that is one of them.
                        continue
                    if end in pairs and first.one and not first.nouns:
                        # "the leftmost and rightmost cubes": no thing of any kind and cubes.
                        continue
                    if any(o.options for o in others) and self.text(k - 1) not in ("and", "plus", "then", "with"):
                        found += [(end, refs) for refs in self._any_of(first, others, self.said(i, end))]
                        continue
                    if first.determiner == "a" and lead.text.startswith("any ") and lead.nouns == first.nouns:
                        # "a block, any block"
                        continue
                    then = "then" in self.texts[j:k]
                    if (then or (self.text(k - 1) == "," and len(others) == 1)) and self.tag(end, "TIMES"):
                        # "tap the can, then the ball twice": the ball only.
                        continue
                    if then and (self.text(i - 1) == "and" or (first.plural and _member(others[-1], first))):
                        # "... and the pear, then the plum in the bowl", "the cans, then the red one again"
                        continue
                    which = self._which(first, others) if self.text(k - 1) == "," else None
                    if which:
                        # "one cube, the red one", "two cubes, the red and the blue one": those.
                        found += [(end, which)] + ([(end + 1, which)] if self.text(end) == "," else [])
                        continue
                    # "the cubes, all of them" adds nothing, nor "the ball and the bone, all in the bin".
                    if len(others) < 10 and not (again and not (lead.nouns or lead.colours or lead.names)):
                        found.append((end, (first, *others)))
        found = [
            (j, _sharing(refs)) if self.text(j - 1) not in ("one", "ones") or len(refs) < 2 else (j, refs)
            for j, refs in found
        ]
        for j, refs in list(found):
            for k in self._corrected(j):
                denied = self._denied(k)
                if denied is not None and not means(denied, refs[-1]):
                    # "..., no, not the yellow block, the orange one": it is another one that was wrong.
                    continue
                for end, better in self.np_list(k):
                    if self.text(k) == "first" and end == k + 1 and not self._closes(end):
                        # "tap the can, no, first tap the ball" starts anew, and names nothing that is first.
                        continue
                    placed = better[-1].relations or self.text(end) in (*_BEFORE_PLACES, "next")
                    other = better[0].one and better[0].ranks and not refs[-1].ranks
                    # "the left cube in the bin, no, the right one": it is the cube that was wrong.
                    if (placed or other) and self.text(i - 1) in _BEFORE_PLACES:
                        # "put a on b, no, c on b": both are said anew.
                        continue
                    if refs[-1].relations and len(better) > 1:
                        # "the fig in the bag, no, the nut, and the bun in the box": the nut is what goes in the bag.
                        continue
                    for lead in better[:1]:
                        every = lead.determiner == "all" and lead.text.startswith("all") and not lead.names
                        if every and not (lead.nouns or refs[-1].plural or refs[-1].determiner == "all"):
                            # "in the bag, no, all but the lime": not all of the bag.
                            better = ()
                        elif lead.other and self.text(i - 1) not in _BEFORE_PLACES:
                            better = (_another(lead, refs[-1]), *better[1:])
                        elif (lead.one or every) and not lead.nouns:
                            better = (self._of_kind_corrected(lead, refs[-1]), *better[1:])
                    # "the salt and the pepper, no, just the pepper": what was said already is said to be meant alone.
                    again = {ref.text for ref in better} <= {ref.text for ref in refs}
                    if better and not (again and len(better) == len(refs)):
                        found.insert(0, (end, better if again else (*refs[:-1], *better)))
        return distinct(found)

    def _closes(self, i: int) -> bool:
        return i >= self.count or self.tokens[i].kind == "mark" or self.text(i) in ("and", *_BEFORE_PLACES)

    def _which(self, first: Ref, others: tuple[Ref, ...]) -> tuple[Ref, ...] | None:
        """Return the things that a list tells which of any are meant, None if it names further ones."""
        count = first.number or (1 if first.determiner == "a" and not first.plural else 0)
        definite = all(ref.determiner == "the" and not (ref.plural or ref.number) for ref in others)
        alike = all(
            (ref.one and not ref.nouns and (ref.colours or ref.ranks or ref.shades))
            or (ref.nouns and ref.nouns == first.nouns)
            for ref in others
        )
        told = (
            first.determiner in ("a", "bare") and first.nouns and not (first.colours or first.ranks or first.relations)
        )
        if not (told and definite and alike and count == len(others)):
            return None
        return tuple(ref if ref.nouns else replace(ref, nouns=first.nouns, one=False) for ref in others)

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
        elif self.text(k) == "as" and self.text(k + 1) == "well" and self.text(k + 2) == "as":
            k += 3
        elif self.text(k) in ("together", "along") and self.text(k + 1) == "with":
            k += 2
        if self.text(k) in ("then", "also", "finally", "afterwards") and (k > j or self.text(k) == "then"):
            k += 1
        return k if k > j else 0

    def _shared_places(self, i: int) -> Found[tuple[Ref, ...]]:
        """As in "the left and right bins", "the leftmost and the rightmost cube": places in an order that share one noun."""
        found: Found[tuple[Ref, ...]] = []
        if i > self.second_last_place:
            return found
        for j, base in self._determiners(i):
            for k, key in self._placed(j) if base.determiner in ("the", "bare") and not base.other else ():
                joint = self._joint(k)
                for start in self.optional(joint, "THE") if joint else ():
                    for m, other in self._placed(start):
                        for end, ref in self._noun(m, base) if other != key else ():
                            if ref.unknown or ref.one or base.number not in (None, 2):
                                continue
                            each = replace(ref, determiner="the", number=None, plural=False)
                            both = tuple(
                                replace(each, ranks=(Rank(rank),), text=f"{said} {self.said(m, end)}")
                                for rank, said in ((key, self.said(j, k)), (other, self.said(start, m)))
                            )
                            found.append((end, both))
        return found

    def _placed(self, i: int) -> Found[str]:
        """As in "left", "topmost": a place in an order."""
        return [*self.tag(i, "POS"), *self.tag(i, "SUPER")]

    def _shared_noun(self, i: int) -> Found[tuple[Ref, ...]]:
        """As in "the red and blue cubes": colours that share one noun."""
        found: Found[tuple[Ref, ...]] = []
        if i > self.second_last_colour:
            return found
        for j, base in self._determiners(i):
            colours: list[str] = []
            k = j
            while True:
                hits = self.tag(k, "COLOUR")
                if not hits:
                    break
                k, colour = hits[0]
                colours.append(colour)
                joint = self._joint(k)
                joint = self.optional(joint, "THE")[0] if joint else 0
                if not joint or not self.tag(joint, "COLOUR"):
                    break
                k = joint
            if len(colours) < 2:
                continue
            for end, ref in self._noun(k, base):
                shared = replace(ref, number=None)
                # "the red and blue cubes": one of each is the plainer reading when there is one of each.
                refs = tuple(replace(shared, colours=(c,), text=f"{c} {self.said(k, end)}") for c in colours)
                if base.number in (None, len(colours)):
                    found.append((end, refs))
        return found

    def _numbered(self, i: int) -> Found[tuple[Ref, ...]]:
        """As in "parts A and C", "bottles 1, 2 and 3": letters or numbers that share one noun."""
        found: Found[tuple[Ref, ...]] = []
        if i > self.second_last_suffix:
            return found
        described = [hit for j, base in self._determiners(i) for hit in self._adjectives(j, base, 0)]
        for j, base in described:
            for k, noun in self._noun(j, base):
                refs: list[Ref] = []
                m = k
                while m and self._suffix(m) and (noun.names or noun.nouns) and not noun.unknown:
                    name = self._suffix(m)
                    text = self.said(j, k) + " " + self.said(m, m + 1)
                    refs.append(replace(noun, names=(*noun.names, name), plural=False, number=None, text=text))
                    if self.text(m + 1) in ("to", "through", "thru", "till", "-") and self._suffix(m + 2):
                        # "parcels 1 to 3"
                        last = self._suffix(m + 2)
                        if name.isdigit() and last.isdigit() and 0 < int(last) - int(name) < 10:
                            named = [str(n) for n in range(int(name) + 1, int(last) + 1)]
                            refs += [
                                replace(refs[-1], names=(*noun.names, n), text=f"{self.said(j, k)} {n}") for n in named
                            ]
                            m += 2
                        elif noun.plural and name.isalpha() and last.isalpha() and 0 < ord(last) - ord(name) < 10:
                            # "parts A to C": each of them must be there.
                            named = [chr(n) for n in range(ord(name) + 1, ord(last) + 1)]
                            refs += [
                                replace(refs[-1], names=(*noun.names, n), text=f"{self.said(j, k)} {n}") for n in named
                            ]
                            m += 2
                    if len(refs) > 1 and base.number in (None, len(refs)):
                        found.append((m + 1, tuple(refs)))
                    m = self._joint(m + 1)
        return found

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


def _another(ref: Ref, wrong: Ref) -> Ref:
    """As in "grab the battery on the left, no, the other one": other than the one on the left."""
    kind = wrong.nouns or wrong.names
    plain = ref.determiner == "the" and ref.one and not (ref.plural or ref.unknown or ref.nouns or ref.names)
    if not plain or not kind or wrong.determiner != "the" or wrong.plural or wrong.other:
        return of_its_kind(ref, wrong)
    return replace(of_its_kind(ref, wrong), other=False, without=(*ref.without, wrong))


def single(ref: Ref) -> bool:
    """Say whether a description is of one definite thing."""
    return ref.determiner == "the" and not (ref.plural or ref.unknown or ref.options or ref.other)


def _sharing(refs: tuple[Ref, ...]) -> tuple[Ref, ...]:
    """As in "the first and the last vial, from the left": a noun and an order that serve for all of a list."""
    if len(refs) < 2:
        return refs
    shared = list(refs)
    for k in range(len(refs) - 2, -1, -1):
        ref, after = shared[k], shared[k + 1]
        bare = ref.one and not (ref.nouns or ref.names or ref.other) and not ref.text.endswith(("one", "ones"))
        if bare and ref.ranks and not after.nouns and after.names and not any(name.isdigit() for name in after.names):
            shared[k] = replace(ref, names=after.names, one=False)
        if (
            bare
            and ref.determiner == "the"
            and after.nouns
            and after.determiner in ("the", "bare")
            and not after.plural
        ):
            shared[k] = replace(ref, nouns=after.nouns, one=False)
        keys = {rank.key for rank in after.ranks if rank.key in ("left", "right", "near", "far", "top", "bottom")}
        if len(keys) == 1 and any(not rank.key for rank in ref.ranks):
            key = keys.pop()
            ranks = tuple(replace(rank, key=rank.key or key) for rank in ref.ranks)
            shared[k] = replace(shared[k], ranks=ranks)
    return tuple(shared)


def _member(ref: Ref, whole: Ref) -> bool:
    """Say whether one thing may be one of several."""
    return not ref.plural and (
        (ref.text.endswith("one") and not ref.nouns) or (bool(ref.nouns) and ref.nouns == whole.nouns)
    )
