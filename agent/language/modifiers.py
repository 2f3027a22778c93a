"""Modifiers behind a noun: "... on the tray", "... that is not red", "... nearest to the bin", "... except the big one"."""

from __future__ import annotations

from robosandbox.agent.language.adjectives import CLAIMS
from robosandbox.agent.language.chart import Found
from robosandbox.agent.language.intent import IT, Rank, Ref, Relation, replace
from robosandbox.agent.language.measures import TAG_WORDS, measure_after, tagged
from robosandbox.agent.language.positions import Positions

HELD = Relation("held")
SHAPED = {"round": "ball", "spherical": "ball", "cylindrical": "cylinder"}
STATES = {
    "open": Relation("open"),
    "opened": Relation("open"),
    "closed": Relation("closed"),
    "shut": Relation("closed"),
    "empty": Relation("empty"),
    "vacant": Relation("empty"),
    "full": Relation("full"),
    "filled": Relation("full"),
    "stacked": Relation("stacked"),
    "unstacked": Relation("loose"),
    "freestanding": Relation("loose"),
}
_DENIED = {
    "empty": Relation("full"),
    "full": Relation("empty"),
    "filled": Relation("empty"),
    "stacked": Relation("loose"),
}
_ASIDE = frozenset({",", ".", ";", "!"})
_IT = frozenset({"it", "that", "this"})
_COLOUR_WORDS = frozenset({"colour", "color"})
_HAVING = frozenset({"has", "have", "is", "are", "with", "of", "in", "having", "shares"})
_MATCHES = frozenset({"matches", "match"})
_MATCHING = frozenset({"matching"})
_ALIKE: dict[tuple[str, ...], str] = {
    (*words.split(), colour, preposition): kind
    for colour in ("colour", "color")
    for kind, words, prepositions in (
        ("alike", "the same", ("as",)),
        ("alike", "same", ("as",)),
        ("unlike", "a different", ("from", "than", "to")),
        ("unlike", "another", ("from", "than")),
        ("unlike", "not the same", ("as",)),
    )
    for preposition in prepositions
}
_ALIKE_BEGINS = frozenset(words[0] for words in _ALIKE)
_COMPARED = frozenset({"big", "small", "tall", "short", "wide", "narrow", "near", "far"})
_SIZES = frozenset({"big", "small", "tall", "short", "wide", "narrow"})
_ALL_OF_THEM = tuple(
    tuple(phrase.split())
    for phrase in (
        "all of them",
        "both of them",
        "each of them",
        "every one of them",
        "each one",
        "every one",
        "all",
        "both",
    )
)
_WHOLE = frozenset(words[0] for words in _ALL_OF_THEM)
PLACE_RANKS = frozenset({"left", "right", "near", "far", "middle", "central", "top", "bottom"})


def coloured_too(ref: Ref, colours: tuple[str, ...]) -> Ref:
    """Return a description with a colour said of it besides: each must be true, as in "the red cube that is blue"."""
    if not ref.colours or {*colours} == {*ref.colours}:
        return replace(ref, colours=colours)
    shown = Ref(text=" or ".join(colours), determiner="a", colours=colours, nouns=("thing",))
    return replace(ref, told_to_be=(*ref.told_to_be, shown))


class Modifiers(Positions):
    """The rules for what follows a noun."""

    def _modified(self, i: int, ref: Ref, depth: int) -> Found[Ref]:
        found: Found[Ref] = [(i, ref)]
        if depth >= 3:
            return found
        for j, modified in self._modifier(i, ref):
            found += self._modified(j, modified, depth + 1)
        return found

    def _modifier(self, i: int, ref: Ref) -> Found[Ref]:
        found: Found[Ref] = []
        if i >= self.count or (self.tokens[i].kind == "mark" and self.text(i) != "," and self.text(i + 1) not in _IT):
            return found
        start = i + 1 if self.text(i) == "," else i
        if "UNIT" in self.present:
            found += [(j, replace(ref, measures=(*ref.measures, measure))) for j, measure in measure_after(self, i)]
        if not TAG_WORDS.isdisjoint(self.texts):
            found += [(j, replace(ref, measures=(*ref.measures, tag))) for j, tag in tagged(self, i)]
        here, after = self.tags[i], self.tags[start] if start < self.count else {}
        found += self._filled_with(i, ref)
        found += self._alike(i, ref)
        found += self._told_to_be(i, ref)
        for j, _ in here["OF_THEM"] if "OF_THEM" in here and not self._tells_where(i) else ():
            found.append((j, ref))
        for j, _ in here.get("HELD", ()):
            found.append((j, replace(ref, relations=(*ref.relations, HELD))))
        if self.text(i) in ("of", "from") and ref.one and ref.ranks:
            # "the larger of the two red blocks", "the larger from two red blocks"
            for j, whole in self.np(i + 1):
                counted = self.text(i) == "of" or (whole.number is not None and not ref.colours)
                if whole.plural and counted and not (whole.ranks or whole.determiner == "it"):
                    merged = replace(whole, determiner=ref.determiner, ranks=ref.ranks, plural=False, number=None)
                    merged = replace(merged, colours=ref.colours or whole.colours, shades=ref.shades or whole.shades)
                    found.append((j, merged))
            # "the taller of the can and the cube"
            compared = ref.determiner == "the" and {rank.key for rank in ref.ranks} <= _COMPARED and not ref.colours
            found += [
                (j, replace(ref, options=refs, one=False))
                for j, refs in (self.np_list(i + 1) if compared and self.text(i) == "of" else ())
                if len(refs) > 1
            ]
        if self.text(i) == "of" and any(rank.key in ("top", "bottom") for rank in ref.ranks):
            # "the top block of the stack"
            found += [
                (j, ref)
                for k in self.optional(i + 1, "THE")
                for j, (noun, _, many) in self.tag(k, "NOUN")
                if noun == "tower" and not many
            ]
        if ref.plural:
            found += [(j, ref) for j in self.all_of_them(i)]
        if ref.ranks:
            found += self._anchored(i, ref)
        for j, key in (*here.get("FROM", ()), *(after.get("FROM", ()) if start > i else ())):
            if ref.ranks and any(not rank.key for rank in ref.ranks):
                # "the last one on the right" is the rightmost; "the last one from the right" is not.
                index = {rank.nth for rank in ref.ranks if not rank.key}.pop()
                index = 1 if index == -1 and self.text(i) == "on" else index
                ranks = tuple(Rank(key, index) if not rank.key else rank for rank in ref.ranks)
                found.append((j, replace(ref, ranks=ranks)))
        if ref.plural and not ref.ranks:
            # "the cubes from left to right": no choice, an order.
            found += [
                (j, replace(ref, ranks=(Rank(key, 0),)))
                for j, key in self.tag(i, "FROM")
                if (self.text(j - 2) in ("to", "the") and j > i + 2) or self.text(j - 1) == "size"
            ]
        for j, excluded in self._exceptions(start, ref):
            best = excluded[0] if len(excluded) == 1 else None
            if (
                ref.text == "all"
                and not ref.nouns
                and best
                and best.ranks
                and best.nouns
                and best.ranks[0].key in _SIZES
            ):
                # "all but the biggest cube": of the cubes.
                found.append((j, replace(ref, nouns=best.nouns, without=(*ref.without, best))))
                continue
            found.append((j, replace(ref, without=(*ref.without, *excluded))))
        found += [
            (j, replace(ref, relations=(*ref.relations, Relation(side, (IT,))))) for j, side in here.get("ITS_SIDE", ())
        ]
        for k in self.optional(start, "IS"):
            if k == start and start > i:
                continue
            if self.text(i) in ("is", "are") and ref.text == "whichever":
                for m in self.optional(i + 1, "THE"):
                    for j, key in self.tag(m, "SUPER"):
                        whichever = replace(ref, determiner="the", ranks=(*ref.ranks, Rank(key)))
                        found += [*self._anchored(j, whichever), (j, whichever)]
            for m, key in self.tag(k, "SUPER") if not ref.ranks else []:
                if self.text(m) == "than":
                    found += self._compared(m + 1, key, ref)
            for j, relation in self.relation(k):
                if not relation.directional and relation.distance is None:
                    found.append((j, replace(ref, relations=(*ref.relations, relation))))
            # "from the right to the left" is one order.
            for j, rank in self._place_rank(k) if not any(rank.nth == 0 for rank in ref.ranks) else ():
                found.append((j, replace(ref, ranks=(*ref.ranks, rank))))
            for j, colour in self.tag(k, "COLOUR"):
                if k > i:
                    colours = [colour]
                    if self.text(j) == "or" and self.tag(j + 1, "COLOUR"):
                        j, second = self.tag(j + 1, "COLOUR")[0]
                        colours.append(second)
                    found.append((j, coloured_too(ref, tuple(colours))))
            if k > i:
                found += self._said_of(k, ref)
            if k > i and (not ref.nouns or ref.nouns == ("thing",)):
                # "everything that is a cube"
                for m in self.optional(k, "A"):
                    found += [
                        (j, replace(ref, nouns=(phrase,)))
                        for j, (noun, phrase, plural) in self.tag(m, "NOUN")
                        if noun not in ("one", "thing") and (m > k or plural)
                    ]
            for m, index in self.tag(k, "ORDINAL"):
                # "the cube second from the right"
                found += [(j, replace(ref, ranks=(*ref.ranks, Rank(key, index)))) for j, key in self.tag(m, "FROM")]
            for m in self.optional(k, "THE"):
                if k > i and self.text(m) in STATES:
                    found.append((m + 1, replace(ref, relations=(*ref.relations, STATES[self.text(m)]))))
                if k > i and self.text(m) in SHAPED and ref.nouns in ((), ("thing",)) and not ref.names:
                    found.append((m + 1, replace(ref, nouns=(SHAPED[self.text(m)],))))
                for j, key in self.tag(m, "SUPER"):
                    superlative = replace(ref, ranks=(*ref.ranks, Rank(key)))
                    anchored = self._anchored(j, superlative)
                    found += anchored
                    if not anchored and (k > i or key in PLACE_RANKS):
                        found.append((j, superlative))
        for k, _ in after.get("COLOURED", ()) if not ref.colours else ():
            # "the cube coloured red"
            found += [(j, replace(ref, colours=(colour,))) for j, colour in self.tag(k, "COLOUR")]
        if self.text(i) in ("with", "of", "in"):
            found += [(j, coloured_too(ref, (colour,))) for j, colour in self._of_colour(i + 1)]
        for k, _ in after.get("NOT_IS", ()):
            if self.text(k) in _DENIED:
                found.append((k + 1, replace(ref, relations=(*ref.relations, _DENIED[self.text(k)]))))
            found += [
                (j, replace(ref, without=(*ref.without, replace(kind, determiner="all"))))
                for j, kind in (self.np(k) if not self.tag(k, "COLOUR") else ())
                if kind.plural and kind.determiner == "bare" and kind.nouns and not (kind.colours or kind.ranks)
            ]
            if self.tag(k, "A"):
                found += self._neither(k, ref)
            if self.text(k) in SHAPED:
                noun, shapes = SHAPED[self.text(k)], (self.text(k),)
                shaped = Ref(text=self.said(k, k + 1), determiner="all", plural=True, nouns=(noun,), shapes=shapes)
                found.append((k + 1, replace(ref, without=(*ref.without, shaped))))
            if self.tag(k, "THE"):
                # "a ball that is not the tennis ball"
                found += [(j, replace(ref, without=(*ref.without, other))) for j, other in self.np(k)]
                # "neither the tallest nor the shortest"
                for j, other in self.np(k):
                    if self.text(j) in ("nor", "or") and not other.options:
                        both = replace(ref, without=(*ref.without, other))
                        found += [(m, replace(both, without=(*both.without, more))) for m, more in self.np(j + 1)]
            for j, colour in self.tag(k, "COLOUR"):
                negated = replace(ref, not_colours=(*ref.not_colours, colour))
                found.append((j, negated))
                while True:
                    # "not red, green or blue"
                    m = j + 1 if self.text(j) == "," else j
                    m = next((end for end, _ in self.tag(m, "NOR")), m)
                    if m == j or not self.tag(m, "COLOUR"):
                        break
                    j, second = self.tag(m, "COLOUR")[0]
                    negated = replace(negated, not_colours=(*negated.not_colours, second))
                    found.append((j, negated))
            for j, relation in self.relation(k):
                if not relation.directional and relation.refs:
                    elsewhere = Ref(text=self.said(k, j), determiner="all", plural=True, relations=(relation,))
                    found.append((j, replace(ref, without=(*ref.without, elsewhere))))
        return found

    def _told_to_be(self, i: int, ref: Ref) -> Found[Ref]:
        """As in "the orange thing, it is a car"."""
        told = self.text(i) in _ASIDE and self.text(i + 1) in _IT and self.text(i + 2) == "is"
        found: Found[Ref] = []
        for j, what in self.np(i + 3) if told and not ref.plural and ref.determiner != "all" else ():
            named = (what.nouns or what.names) and what.determiner in ("the", "a") and what.nouns != ("thing",)
            ends = j >= self.count or self.tokens[j].kind == "mark" or self.text(j) in ("and", "then", "but")
            ends = ends or "DIR" in self.tags[j]
            if named and ends and not (what.unknown or what.plural or what.options or what.relations or what.other):
                full = replace(ref, told_to_be=(*ref.told_to_be, what))
                # "..., it is a car, in the basket"
                found += [(j, full), (j + 1, full)] if self.text(j) == "," else [(j, full)]
        return found

    def _said_of(self, i: int, ref: Ref) -> Found[Ref]:
        """As in "everything wooden", "whatever is metal": by the name where that has the word, else as it is claimed."""
        word = self.text(i)
        if word not in CLAIMS:
            return []
        if word in self.words.parts:
            return [(i + 1, replace(ref, names=(*ref.names, word)))]
        return [(i + 1, replace(ref, claims=(*ref.claims, word)))]

    def _neither(self, i: int, ref: Ref) -> Found[Ref]:
        """As in "that is not a mug", "that is neither a mug nor a can"."""
        found: Found[Ref] = []
        for j, kind in self.np(i):
            less = replace(ref, without=(*ref.without, replace(kind, determiner="all", plural=True)))
            found.append((j, less))
            if self.text(j) in ("nor", "or"):
                found += self._neither(j + 1, less)
            elif self.text(j) == ",":
                # "that is not a cube, a can or a ball"
                found += [
                    (k, fewer)
                    for k, fewer in self._neither(j + 1, less)
                    if len(fewer.without) > len(less.without) + 1 or self.text(j + 1) in ("nor", "or")
                ]
        return found

    def _tells_where(self, i: int) -> bool:
        """As in "on top of both", "I need the lemon here and the lime in the bowl": words that say no more than which."""
        return self.said(i - 1, i + 2) == "top of both" or self.said(i, i + 2) == "here and"

    def _filled_with(self, i: int, ref: Ref) -> Found[Ref]:
        """As in "the mug with the beans in it", "the bin that has no ball in it", "the bowl with nothing in it"."""
        k = i + 1 if self.text(i) in ("that", "which") else i
        if self.text(k) not in (("has", "have", "contains", "holds") if k > i else ("with", "containing", "holding")):
            return []
        plain = self.text(k) in ("contains", "holds", "containing", "holding")
        if self.text(k + 1) in ("nothing", "none"):
            found = [(k + 2, replace(ref, relations=(*ref.relations, Relation("empty"))))]
        elif self.text(k + 1) in ("something", "stuff", "anything", "things"):
            found = [(k + 2, replace(ref, relations=(*ref.relations, Relation("full"))))]
        else:
            lacks = self.text(k + 1) == "no"
            found = [
                (j, replace(ref, relations=(*ref.relations, Relation("lacks" if lacks else "holds", (inner,)))))
                for j, inner in self.np(k + 2 if lacks else k + 1)
                if not inner.unknown
            ]
        ends = {"in it": 2, "inside it": 2, "inside of it": 3, "in there": 2, "in them": 2, "inside": 1}
        return [(j + n, full) for j, full in found for said, n in ends.items() if self.said(j, j + n) == said] + (
            found if plain else []
        )

    def _alike(self, i: int, ref: Ref) -> Found[Ref]:
        """As in "the bin that has the same colour as the ball", "the block that matches the left bowl"."""
        that = self.text(i) in ("that", "which")
        k = i + that + (self.text(i + that) in _HAVING)
        starts = [(k + 1, "alike")] if k == i + that and self.text(k) in (_MATCHES if that else _MATCHING) else []
        for words, kind in _ALIKE.items() if self.text(k) in _ALIKE_BEGINS else ():
            if tuple(map(self.text, range(k, k + len(words)))) == words:
                starts.append((k + len(words), kind))
        found: Found[Ref] = []
        for start, kind in starts:
            for j, other in self.np(start):
                if other.unknown or other.plural or other.determiner in ("a", "all") or self.text(j) in _COLOUR_WORDS:
                    continue
                alike = replace(ref, relations=(*ref.relations, Relation(kind, (other,))))
                found += [(j + (self.text(j) in ("has", "is")), alike)]
        return found

    def _compared(self, i: int, key: str, ref: Ref) -> Found[Ref]:
        """As in "taller than the can", "bigger than the others"."""
        found: Found[Ref] = []
        for j in self.optional(i, "ALL", "THE", "A"):
            rest = [end for tag in ("OTHER", "REST") for end, _ in self.tag(j, tag)]
            found += [(end, replace(ref, ranks=(*ref.ranks, Rank(key)))) for end in rest]
        for j, anchor in self.np(i):
            if _rest_of(anchor, ref):
                found.append((j, replace(ref, ranks=(*ref.ranks, Rank(key)))))
            if not (anchor.other or anchor.plural or anchor.unknown):
                than = Relation("than", (anchor,), order=key)
                found.append((j, replace(ref, relations=(*ref.relations, than))))
        return found

    def all_of_them(self, i: int) -> list[int]:
        """As in "the cubes, all of them,": nothing new, but for how many there are."""
        start = i + 1 if self.text(i) == "," else i
        if self.text(start) not in _WHOLE:
            return []
        ends = [
            start + len(words)
            for words in _ALL_OF_THEM
            if tuple(map(self.text, range(start, start + len(words)))) == words
        ]
        return [end + 1 if start > i and self.text(end) == "," else end for end in ends]

    def _of_colour(self, i: int) -> Found[str]:
        """As in "with a green colour", "of colour pink"; "in red" could be a place."""
        found: Found[str] = []
        for j in self.optional(i, "THE", "A"):
            for k, colour in self.tag(j, "COLOUR"):
                found += [(k + 1, colour)] if self.text(k) in _COLOUR_WORDS else []
            if self.text(j) in _COLOUR_WORDS:
                found += self.tag(j + 1, "COLOUR")
        return found

    def _exceptions(self, i: int, ref: Ref) -> Found[tuple[Ref, ...]]:
        if not (ref.plural or ref.determiner in ("all", "a") or "not" in (self.text(i), self.text(i + 1))):
            return []
        return [
            (end, self._but(i, j, refs))
            for j, _ in self.tag(i, "EXCEPT")
            for end, refs in self.np_list(j)
            if not any(map(says_nothing, refs))
        ]

    def _but(self, i: int, j: int, refs: tuple[Ref, ...]) -> tuple[Ref, ...]:
        """Return what "but" alone leaves out with that word: it may as well begin something else."""
        alone = j == i + 1 and self.text(i) == "but"
        return tuple(replace(ref, text=f"but {ref.text}") for ref in refs) if alone else refs

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
        # "closer to the bin than the other one"
        than = [
            (k, near)
            for j, near in found
            if self.text(j) == "than"
            for k, rest in self.np(j + 1)
            if _rest_of(rest, ref)
        ]
        return [*than, *found]

    def _place_rank(self, i: int) -> Found[Rank]:
        """As in "on the left", "in the middle", "at the back": a place that singles one of several out."""
        found: Found[Rank] = []
        for j, region in self.region(i):
            if region.name == "middle":
                of_table = any(end == j for end, _ in self.tag(j - 1, "TABLE"))
                found.append((j, Rank("central" if of_table else "middle")))
            elif len(region.sides) == 1 and not self._told_apart(j, region):
                # "in the right corner on the far side" is one place.
                found.append((j, Rank(region.sides[0])))
        here = self.tags[i] if i < self.count else {}
        for j, direction in here.get("DIR", ()):
            if "its" in self.texts[i:j]:
                # "the one to its right" is no rightmost one.
                continue
            side = {"left": "left", "right": "right"}.get(direction)
            if side and j > i + 1:
                found.append((j, Rank(side)))
        if self.text(i) in ("on", "at", "to"):
            for k in self.optional(i + 1, "THE"):
                found += [(j, Rank(key)) for j, key in self.tag(k, "SUPER") if key in PLACE_RANKS and k > i + 1]
        if self.text(i) == "in" and self.text(i + 1) == "front":
            found.append((i + 2, Rank("near")))
        for key, tag in (("top", "TOP"), ("bottom", "BOTTOM")):
            for j, _ in here.get(tag, ()):
                if j > i + 1:
                    found.append((j, Rank(key)))
                    if self.text(j) == "of":
                        for k in self.optional(j + 1, "THE"):
                            found += [(end, Rank(key)) for end, (noun, _, _) in self.tag(k, "NOUN") if noun == "tower"]
        return found


def _rest_of(other: Ref, ref: Ref) -> bool:
    """Say whether "the other cubes" are the rest of those of which "the red cube" is one."""
    noun = other.nouns in ((), ref.nouns) and other.names in ((), ref.names)
    return other.other and noun and other.colours in ((), ref.colours) and not (other.ranks or other.relations)


def says_nothing(ref: Ref) -> bool:
    """As in "all but the one | on the right": which one is left out?"""
    return replace(ref, text="", plural=False) == Ref(text="", one=True)
