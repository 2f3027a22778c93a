"""Noun phrases: "the second smallest red block on the tray", every way to read it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from robosandbox.agent.language.chart import Chart, Found, distinct, rule
from robosandbox.agent.language.intent import Determiner, Rank, Ref, Region, Relation
from robosandbox.agent.language.speech import CONDITIONS, GRAMMAR_WORDS, QUESTIONS
from robosandbox.agent.language.verbs import UNSUPPORTED_VERBS
from robosandbox.agent.language.wordlist import word_set

HELD = Relation("held")


class Phrasing(Chart):
    """The rules for noun phrases and positions."""

    # Noun phrases.

    @rule
    def np(self, i: int) -> Found[Ref]:
        """One noun phrase, with and without what follows the noun."""
        found: Found[Ref] = []
        for j, which in self.tag(i, "PRON"):
            them = which == "them"
            base = Ref(text=self.said(i, j), determiner="it", plural=them)
            found.append((j, base))
            if self.text(j) in ("all", "both"):
                found.append((j + 1, replace(base, plural=True, count=2 if self.text(j) == "both" else None)))
        found += self._everything(i)
        for j, _ in self.tag(i, "SOMETHING"):
            for k, ref in self._adjectives(j, Ref(text="", determiner="a", nouns=("thing",)), 0):
                found += self._modified(k, replace(ref, text=self.said(i, k)), 0)
        for j, base in self._determiners(i):
            for k, ref in self._head(j, base):
                for end, full in self._modified(k, ref, 0):
                    found.append((end, replace(full, text=self.said(i, end))))
        if self.text(i) in ("whatever", "whichever", "what") and self.text(i + 1) == "is":
            # "whatever is closest to the bin"
            thing = Ref(text="", determiner="the", nouns=("thing",))
            for j, ref in self._modifier(i + 1, thing):
                found.append((j, replace(ref, text=self.said(i, j))))
        for j, _ in self.tag(i, "HELD_THING"):
            found.append((j, Ref(text=self.said(i, j), nouns=("thing",), relations=(HELD,))))
        if self.text(i) == "not":
            for j, _ in self.np(i + 1):
                if self.text(j) == "but":
                    found += self.np(j + 1)
        for j, ref in list(found):
            k = j + 1 if self.text(j) == "," else j
            for m, _ in self.tag(k, "INSTEAD"):
                for end, other in self.np(m):
                    # "a bowl but not the blue one" leaves that one out; "the red cube, not the blue one" says it twice.
                    chosen = ref.determiner in ("a", "all") or ref.plural
                    found.append((end, replace(ref, without=(*ref.without, other)) if chosen else ref))
        known = {end for end, ref in found if not ref.unknown}
        return distinct([(end, ref) for end, ref in found if not ref.unknown or end not in known])

    @rule
    def np_list(self, i: int) -> Found[tuple[Ref, ...]]:
        """Noun phrases joined by commas and "and"."""
        found: Found[tuple[Ref, ...]] = []
        for j, colours in self._shared_noun(i):
            found.append((j, colours))
        for j, first in self.np(i):
            found.append((j, (first,)))
            k = self._joint(j)
            if k:
                found += [(end, (first, *others)) for end, others in self.np_list(k) if len(others) < 10]
        for j, refs in list(found):
            for k in self._corrected(j):
                for end, better in self.np_list(k):
                    if better[0].one and not better[0].nouns:
                        better = (replace(better[0], nouns=refs[-1].nouns, one=False), *better[1:])
                    found.insert(0, (end, (*refs[:-1], *better)))
        return distinct(found)

    def _corrected(self, j: int) -> list[int]:
        """As in "the red cube, no wait, sorry, the blue one": where the better words start."""
        k = j
        while self.text(k) in (",", ".", ";", "!"):
            k += 1
        ends = [m for m, _ in self.tag(k, "CORRECTION") if k > j or m > k + 1]
        for _ in range(3):
            ends = [m + 1 if self.text(m) in (",", ".") else m for m in ends]
            further = [n for m in ends for n, _ in self.tag(m, "CORRECTION")]
            if not further:
                break
            ends += further
        return list(dict.fromkeys(ends))

    def _joint(self, j: int) -> int:
        """Return where the next item of a list starts, 0 if no list goes on at `j`."""
        k = j
        if self.text(k) == "first" and self.text(k + 1) in (",", "then"):
            k += 1
        if self.text(k) == ",":
            k += 1
        if self.text(k) in ("and", "plus"):
            k += 1
        elif self.text(k) == "as" and self.text(k + 1) == "well" and self.text(k + 2) == "as":
            k += 3
        if self.text(k) in ("then", "also", "finally") and k > j:
            k += 1
        return k if k > j else 0

    def _shared_noun(self, i: int) -> Found[tuple[Ref, ...]]:
        """As in "the red and blue cubes": colours that share one noun."""
        found: Found[tuple[Ref, ...]] = []
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
                shared = replace(ref, count=None)
                # "the red and blue cubes": one of each is the plainer reading when there is one of each.
                refs = tuple(replace(shared, colours=(c,), text=f"{c} {self.said(k, end)}") for c in colours)
                if base.count in (None, len(colours)):
                    found.append((end, refs))
        return found

    def _everything(self, i: int) -> Found[Ref]:
        found: Found[Ref] = []
        for j, _ in self.tag(i, "EVERYTHING"):
            base = Ref(text=self.said(i, j), determiner="all", plural=True)
            for k, ref in self._adjectives(j, base, 0):
                found += self._modified(k, ref, 0)
        for j, _ in self.tag(i, "EVERYTHING_ELSE"):
            found += self._modified(j, Ref(text=self.said(i, j), determiner="all", plural=True, other=True), 0)
        return [(j, replace(ref, text=self.said(i, j))) for j, ref in found]

    def _determiners(self, i: int) -> Found[Ref]:
        found: Found[Ref] = []

        def add(j: int, determiner: Determiner, **more: Any) -> None:
            found.append((j, Ref(text="", determiner=determiner, **more)))

        add(i, "bare")
        kinds: tuple[tuple[str, Determiner], ...] = (("THE", "the"), ("A", "a"), ("ALL", "all"))
        for tag, determiner in kinds:
            for j, _ in self.tag(i, tag):
                found.append((j, Ref(text=self.text(i), determiner=determiner)))
                for k, number in self._count(j):
                    add(k, determiner, count=number, plural=number > 1)
                for k, _ in self.tag(j, "OTHER") if self.text(i) != "each" else []:
                    add(k, "the" if determiner != "all" else "all", other=True)
                    for m, number in self._count(k):
                        add(m, "the", other=True, count=number, plural=number > 1)
        for j, _ in self.tag(i, "BOTH"):
            add(j, "all", count=2, plural=True)
            for k, _ in self.tag(j, "OTHER"):
                add(k, "all", count=2, plural=True, other=True)
        for j, number in self._count(i):
            add(j, "bare", count=number, plural=number > 1)
            if self.text(j) == "of":
                # "two of the balls": any two.
                for k in self.optional(j + 1, "THE"):
                    if k > j + 1:
                        add(k, "a", count=number, plural=number > 1)
        for j, _ in self.tag(i, "ONE_OF"):
            for k in self.optional(j, "THE"):
                for m in (k, *(end for end, _ in self._count(k))):
                    add(m, "a", count=1)
        if self.text(i) == "another":
            add(i + 1, "a", other=True)
        return found

    def _count(self, i: int) -> Found[int]:
        token = self.tokens[i] if i < len(self.tokens) else None
        if token and token.kind == "number":
            return [(i + 1, int(token.number))] if token.number == int(token.number) and 0 < token.number < 100 else []
        return [(j, int(n)) for j, n in self.tag(i, "NUM") if n >= 2 and n == int(n) and self.text(i) != "a"]

    def _head(self, i: int, base: Ref) -> Found[Ref]:
        """Adjectives, then a noun, an id, or nothing where the adjectives say enough."""
        found: Found[Ref] = []
        for j, _ in self.tag(i, "REST"):
            if base.determiner in ("the", "all"):
                ref = replace(base, determiner="all", plural=True, other=True)
                found.append((j, ref))
                if self.text(j) == "of":
                    for k in self.optional(j + 1, "THE"):
                        found += self._noun(k, ref)
        for j, ref in self._adjectives(i, base, 0):
            found += self._noun(j, ref)
            # "the left" alone is a place, not a thing.
            ranked = any(rank.key not in _PLACE_RANKS or rank.index != 1 for rank in ref.ranks)
            bare = ranked or ref.colours or ref.not_colours or ref.unknown
            pointed = base.other or base.determiner == "all" or (base.count and base.determiner != "bare")
            if (j > i and bare) or (j == i and pointed and i > 0):
                found.append((j, replace(ref, one=True)))
        return found

    def _adjectives(self, i: int, ref: Ref, depth: int) -> Found[Ref]:
        found: Found[Ref] = [(i, ref)]
        if depth > 5:
            return found
        start = i
        if depth and self.text(i) in (",", "and") and not any(rank.strict for rank in ref.ranks):
            start = i + 1
        step: Found[Ref] = []
        for j, colour in self.tag(start, "COLOUR") if not (start > i and ref.colours) else []:
            for k in self.optional(j, "COLOURED"):
                step.append((k, replace(ref, colours=(*ref.colours, colour))))
        for j, shade in self.tag(start, "SHADE"):
            step.append((j, replace(ref, shades=(*ref.shades, shade))))
        for j, size in self.tag(start, "SIZE"):
            step.append((j, replace(ref, ranks=(*ref.ranks, Rank(size, strict=False)))))
        for j, key in self.tag(start, "SUPER"):
            step.append((j, replace(ref, ranks=(*ref.ranks, Rank(key)))))
        for j, key in self.tag(start, "POS"):
            step.append((j, replace(ref, ranks=(*ref.ranks, Rank(key)))))
        for j, index in self.tag(start, "ORDINAL"):
            step.append((j, replace(ref, ranks=(*ref.ranks, Rank("", index)))))
            for tag in ("SUPER", "FROM"):
                for k, key in self.tag(j, tag):
                    step.append((k, replace(ref, ranks=(*ref.ranks, Rank(key, index)))))
        for j, _ in self.tag(start, "NON"):
            for k, colour in self.tag(j, "COLOUR"):
                step.append((k, replace(ref, not_colours=(*ref.not_colours, colour))))
        for j, _ in self.tag(start, "OTHER"):
            step.append((j, replace(ref, other=True)))
        if start < len(self.tokens) and self._is_strange(start):
            step.append((start + 1, replace(ref, unknown=(*ref.unknown, self.tokens[start].raw))))
        for j, nexts in step:
            found += self._adjectives(j, nexts, depth + 1)
        return found

    def _noun(self, i: int, ref: Ref) -> Found[Ref]:
        found: Found[Ref] = []
        if i >= len(self.tokens):
            return found
        token = self.tokens[i]
        if token.kind == "id":
            found.append((i + 1, replace(ref, names=(token.text,))))
        for j, (noun, phrase, plural) in self.tag(i, "NOUN"):
            many = (ref.plural or plural) and ref.count != 1
            named = replace(ref, nouns=(phrase,) if noun != "one" else (), one=noun == "one", plural=many)
            found += self._suffixed(j, named)
            if self.text(j) in ("or", "and") and plural:
                for k, (_, other, also) in self.tag(j + 1, "NOUN"):
                    if also:
                        found.append((k, replace(named, nouns=(phrase, other))))
        for j, (noun, plural) in self.tag(i, "ABSENT"):
            found += self._suffixed(j, replace(ref, nouns=(noun,), plural=ref.plural or plural))
        for spoken, name in self.words.spoken:
            end = i + len(spoken)
            if tuple(map(self._part, range(i, min(end, len(self.tokens))))) == spoken:
                found.append((end, replace(ref, names=(name,))))
        j = i
        parts: list[str] = []
        while j < len(self.tokens) and self._is_name(j) and len(parts) < 4:
            parts.append(_singular(self.tokens[j].text, self.words.parts))
            j += 1
            plural = ref.plural or self.tokens[j - 1].text not in self.words.parts
            # In "push it to the left" nobody names left_box.
            if not all(part in _SIDES for part in parts):
                found += self._suffixed(j, replace(ref, names=tuple(parts), plural=plural))
            for k, (_, phrase, many) in self.tag(j, "NOUN"):
                found += self._suffixed(k, replace(ref, names=tuple(parts), nouns=(phrase,), plural=ref.plural or many))
        if self._is_strange(i):
            found.append((i + 1, replace(ref, unknown=(*ref.unknown, token.raw))))
        return found

    def _part(self, i: int) -> str:
        """Return a word as an id would have it: numbers in digits."""
        token = self.tokens[i]
        if token.kind == "number":
            return str(int(token.number)) if token.number.is_integer() else token.text
        return next(
            (str(int(n)) for _, n in self.tag(i, "NUM") if n >= 1 and token.text not in ("a", "an")), token.text
        )

    def _is_strange(self, i: int) -> bool:
        """Say whether nobody knows the word: it may name a thing that is not there."""
        token = self.tokens[i]
        known = token.text in self.words.parts or token.text in _FUNCTION_WORDS or token.text in UNSUPPORTED_VERBS
        return token.kind == "word" and len(token.text) > 1 and not self.tags[i] and not known

    def _is_name(self, i: int) -> bool:
        token = self.tokens[i]
        if token.kind != "word" or len(token.text) < 2:
            return False
        single = _singular(token.text, self.words.parts)
        return single in self.words.parts and not any(tag in self.tags[i] for tag in _NOT_NAMES)

    def _suffixed(self, j: int, ref: Ref) -> Found[Ref]:
        """As in "block b", "cube number 2": a letter or number that ends an id."""
        found = [(j, ref)]
        k = j + 1 if self.text(j) in ("number", "no", "#") else j
        if self.text(k) == "." and k > j:
            k += 1
        if k < len(self.tokens):
            token = self.tokens[k]
            part = str(int(token.number)) if token.kind == "number" and token.number.is_integer() else token.text
            for _, number in self.tag(k, "NUM"):
                part = str(int(number)) if number.is_integer() and token.text != "a" else part
            if part in self.words.parts and (len(part) == 1 or part.isdigit()):
                found.insert(0, (k + 1, replace(ref, names=(*ref.names, part))))
        for m, _ in self.tag(j, "CALLED"):
            if m < len(self.tokens) and (self.tokens[m].kind == "id" or self.text(m) in self.words.parts):
                found.append((m + 1, replace(ref, names=(*ref.names, self.text(m)))))
        return found

    # What follows the noun.

    def _modified(self, i: int, ref: Ref, depth: int) -> Found[Ref]:
        found: Found[Ref] = [(i, ref)]
        if depth >= 3:
            return found
        for j, modified in self._modifier(i, ref):
            found += self._modified(j, modified, depth + 1)
        return found

    def _modifier(self, i: int, ref: Ref) -> Found[Ref]:
        found: Found[Ref] = []
        start = i + 1 if self.text(i) == "," else i
        for j, _ in self.tag(i, "OF_THEM"):
            found.append((j, ref))
        for j, _ in self.tag(i, "HELD"):
            found.append((j, replace(ref, relations=(*ref.relations, HELD))))
        if self.text(i) == "of" and ref.one and ref.ranks:
            # "the larger of the two red blocks"
            for j, whole in self.np(i + 1):
                if whole.plural and not whole.ranks:
                    merged = replace(whole, determiner=ref.determiner, ranks=ref.ranks, plural=False, count=None)
                    found.append((j, merged))
        if ref.ranks:
            found += self._anchored(i, ref)
        for j, key in self.tag(i, "FROM"):
            if ref.ranks and any(not rank.key for rank in ref.ranks):
                # "the last one on the right" is the rightmost; "the last one from the right" is not.
                index = {rank.index for rank in ref.ranks if not rank.key}.pop()
                index = 1 if index == -1 and self.text(i) == "on" else index
                ranks = tuple(Rank(key, index) if not rank.key else rank for rank in ref.ranks)
                found.append((j, replace(ref, ranks=ranks)))
        if ref.plural and not ref.ranks:
            # "the cubes from left to right": no choice, an order.
            found += [
                (j, replace(ref, ranks=(Rank(key, 0),)))
                for j, key in self.tag(i, "FROM")
                if self.text(j - 2) in ("to", "the") and j > i + 2
            ]
        for j, excluded in self._exceptions(start, ref):
            found.append((j, replace(ref, without=(*ref.without, *excluded))))
        for k in self.optional(start, "IS"):
            if k == start and start > i:
                continue
            if self.text(i) in ("is", "are") and ref.text == "whichever":
                for m in self.optional(i + 1, "THE"):
                    for j, key in self.tag(m, "SUPER"):
                        whichever = replace(ref, determiner="the", ranks=(*ref.ranks, Rank(key)))
                        found += [*self._anchored(j, whichever), (j, whichever)]
            for j, relation in self.relation(k):
                if not relation.directional and relation.distance is None:
                    found.append((j, replace(ref, relations=(*ref.relations, relation))))
            for j, rank in self._place_rank(k):
                found.append((j, replace(ref, ranks=(*ref.ranks, rank))))
            for j, colour in self.tag(k, "COLOUR"):
                if k > i:
                    colours = [colour]
                    if self.text(j) == "or" and self.tag(j + 1, "COLOUR"):
                        j, second = self.tag(j + 1, "COLOUR")[0]
                        colours.append(second)
                    found.append((j, replace(ref, colours=tuple(colours))))
            for m in self.optional(k, "THE"):
                for j, key in self.tag(m, "SUPER"):
                    superlative = replace(ref, ranks=(*ref.ranks, Rank(key)))
                    anchored = self._anchored(j, superlative)
                    found += anchored
                    if not anchored and (k > i or key in _PLACE_RANKS):
                        found.append((j, superlative))
        for k, _ in self.tag(start, "NOT_IS"):
            if self.tag(k, "A"):
                found += [
                    (j, replace(ref, without=(*ref.without, replace(kind, determiner="all", plural=True))))
                    for j, kind in self.np(k)
                ]
            if self.tag(k, "THE"):
                # "a ball that is not the tennis ball"
                found += [(j, replace(ref, without=(*ref.without, other))) for j, other in self.np(k)]
            for j, colour in self.tag(k, "COLOUR"):
                negated = replace(ref, not_colours=(*ref.not_colours, colour))
                found.append((j, negated))
                for m, _ in self.tag(j, "NOR"):
                    for end, second in self.tag(m, "COLOUR"):
                        found.append((end, replace(negated, not_colours=(*negated.not_colours, second))))
            for j, relation in self.relation(k):
                if not relation.directional and relation.refs:
                    elsewhere = Ref(text=self.said(k, j), determiner="all", plural=True, relations=(relation,))
                    found.append((j, replace(ref, without=(*ref.without, elsewhere))))
        return found

    def _exceptions(self, i: int, ref: Ref) -> Found[tuple[Ref, ...]]:
        if not (ref.plural or ref.determiner in ("all", "a") or "not" in (self.text(i), self.text(i + 1))):
            return []
        return [found for j, _ in self.tag(i, "EXCEPT") for found in self.np_list(j)]

    def _anchored(self, i: int, ref: Ref) -> Found[Ref]:
        """As in "nearest to the bin", also "the nearest cube to the bin"."""
        last = ref.ranks[-1]
        if last.key not in ("near", "far") or last.anchor:
            return []
        starts = [i, i + 1] if self.text(i) in ("to", "from", "by", "away") else [i]
        if self.text(i) == "away" and self.text(i + 1) == "from":
            starts = [i + 2]
        found: Found[Ref] = []
        for start in starts:
            for j, _ in self.tag(start, "ROBOT"):
                found.append((j, ref))
            for j, anchor in self.np(start):
                if start > i or self.tag(start, "THE") or anchor.names:
                    found.append((j, replace(ref, ranks=(*ref.ranks[:-1], replace(last, anchor=anchor)))))
        return found

    def _place_rank(self, i: int) -> Found[Rank]:
        """As in "on the left", "in the middle", "at the back": a place that singles one of several out."""
        found: Found[Rank] = []
        for j, region in self.region(i):
            if region.name == "middle":
                found.append((j, Rank("middle")))
            elif len(region.sides) == 1:
                found.append((j, Rank(region.sides[0])))
        for j, direction in self.tag(i, "DIR"):
            side = {"left": "left", "right": "right"}.get(direction)
            if side and j > i + 1:
                found.append((j, Rank(side)))
        if self.text(i) in ("on", "at", "to"):
            for k in self.optional(i + 1, "THE"):
                found += [(j, Rank(key)) for j, key in self.tag(k, "SUPER") if key in _PLACE_RANKS and k > i + 1]
        if self.text(i) == "in" and self.text(i + 1) == "front":
            found.append((i + 2, Rank("near")))
        for key, tag in (("top", "TOP"), ("bottom", "BOTTOM")):
            for j, _ in self.tag(i, tag):
                if j > i + 1:
                    found.append((j, Rank(key)))
                    if self.text(j) == "of":
                        for k in self.optional(j + 1, "THE"):
                            found += [(end, Rank(key)) for end, (noun, _, _) in self.tag(k, "NOUN") if noun == "tower"]
        return found

    # Positions.

    @rule
    def relation(self, i: int) -> Found[Relation]:
        """As in "to the left of the can", "into the bin", "between the two cubes", "on the table"."""
        found: Found[Relation] = []
        for tag, directional in (("REL", False), ("TO", True), ("SOURCE", False)):
            for j, kind in self.tag(i, tag):
                kind = kind or "from"
                for k in self.optional(j, "THE"):
                    for m, _ in self.tag(k, "TABLE"):
                        if kind in ("on", "from", "to"):
                            found.append((m, Relation("on" if kind == "to" else kind, (), None, directional)))
                for k, refs in self.np_list(j):
                    single = len(refs) == 1
                    if kind == "between":
                        if len(refs) == 2 or (single and (refs[0].plural or refs[0].count == 2)):
                            found.append((k, Relation(kind, refs)))
                    elif single:
                        found.append((k, Relation(kind, refs, None, directional)))
        return found

    @rule
    def region(self, i: int) -> Found[Region]:
        """As in "in the far left corner of the table", "on the right", "at the edge"."""
        found: Found[Region] = []
        if self.text(i) not in _REGION_PREPOSITIONS:
            return found
        start = i + 1
        if self.text(start) in ("to", "in", "near", "by", "at", "on", "over"):
            start += 1
        for j in self.optional(start, "THE", "A"):
            if self.text(start) in ("its", "their"):
                continue
            k, sides = j, list[str]()
            while self.text(k) in _REGION_SIDES or (self.text(k) == "hand" and sides):
                if self.text(k) != "hand":
                    sides.append(_REGION_SIDES[self.text(k)])
                k += 1
                if self.text(k) == "most":
                    k += 1
            names = _REGION_NAMES.get(self.text(k))
            if names:
                region = Region(names, tuple(dict.fromkeys(sides)))
                found += [(end, region) for end in self._of_table(k + 1)]
            if (
                sides
                and j > start
                and self.text(i) not in ("to", "towards", "toward", "into")
                and self.text(k - 1) not in ("top", "bottom", "upper", "lower")
            ):
                found += [(end, Region("side", tuple(dict.fromkeys(sides)))) for end in self._of_table(k)]
        return found

    def _of_table(self, i: int) -> list[int]:
        ends = [i]
        if self.text(i) in ("of", "on", "in"):
            ends = [end for j in self.optional(i + 1, "THE") for end, _ in self.tag(j, "TABLE")] + ends
        return ends


_NOT_NAMES = word_set(
    """
    REL TO SOURCE THE A ALL BOTH PRON THEN BEFORE AFTER NOT_IS EXCEPT AVOID TABLE COLOUR NOUN ABSENT
    """
)
_SIDES = word_set("left right front back rear top bottom middle centre center near far upper lower inner outer")
_PLACE_RANKS = frozenset({"left", "right", "near", "far", "middle", "top", "bottom"})
_FUNCTION_WORDS = GRAMMAR_WORDS | QUESTIONS | CONDITIONS
_REGION_PREPOSITIONS = word_set("in on at to into onto near by towards toward over")
_REGION_SIDES = {
    "left": "left", "right": "right", "front": "near", "near": "near", "nearest": "near", "closest": "near", "close": "near", "bottom": "near",
    "lower": "near", "back": "far", "far": "far", "rear": "far", "top": "far", "upper": "far", "farthest": "far",
    "furthest": "far", "leftmost": "left", "rightmost": "right", "lefthand": "left", "righthand": "right",
}  # fmt: skip
_REGION_NAMES = {
    "corner": "corner", "edge": "edge", "border": "edge", "rim": "edge", "side": "side", "half": "side", "end": "side", "part": "side",
    "area": "side", "section": "side", "middle": "middle", "center": "middle", "centre": "middle", "midpoint": "middle",
}  # fmt: skip


def _singular(word: str, parts: frozenset[str]) -> str:
    if word in parts:
        return word
    for ending, with_ in (("ies", "y"), ("es", ""), ("s", "")):
        if word.endswith(ending) and word[: -len(ending)] + with_ in parts:
            return word[: -len(ending)] + with_
    return word
