"""Lists of noun phrases: "the can, the cup and the ball", "the red and blue cubes", "bottles 1 to 3"."""

from __future__ import annotations

from functools import cached_property

from robosandbox.agent.language.chart import Found, distinct, rule
from robosandbox.agent.language.intent import Rank, Ref, replace
from robosandbox.agent.language.phrases import Phrases, means, of_its_kind

_BEFORE_PLACES = frozenset({"on", "in", "to", "of", "into", "onto", "beside", "behind", "by", "near"})


class Phrasing(Phrases):
    """The rules for noun phrases in a row."""

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
            if any("and" in said and self._says(j, said) for said, _ in self._stems(j)):
                # "the yellow and white mug" is one, called so.
                continue
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


def _another(ref: Ref, wrong: Ref) -> Ref:
    """As in "grab the battery on the left, no, the other one": other than the one on the left."""
    kind = wrong.nouns or wrong.names
    plain = ref.determiner == "the" and ref.one and not (ref.plural or ref.unknown or ref.nouns or ref.names)
    if not plain or not kind or wrong.determiner != "the" or wrong.plural or wrong.other:
        return of_its_kind(ref, wrong)
    return replace(of_its_kind(ref, wrong), other=False, without=(*ref.without, wrong))


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
