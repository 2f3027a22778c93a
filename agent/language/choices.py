"""Choices: "the can or the ball, whichever is closer", "the red, the blue or the green one"."""

from __future__ import annotations

from abc import ABC

from robosandbox.agent.language.chart import Found, rule
from robosandbox.agent.language.intent import Rank, Ref, replace
from robosandbox.agent.language.nouns import Nouns


class Choices(Nouns, ABC):
    """The rules for one of several things."""

    def _alternatives(self, i: int, found: Found[Ref]) -> Found[Ref]:
        """As in "the red cube or the green one, whichever is closer", "either cube or ball"."""
        made: Found[Ref] = []
        if self.text(i) == "either":
            made += [(j, ref) for j, ref in self.np(i + 1) if ref.options]
        for j, first in found:
            k = j + 1 if self.text(j) == "," else j
            if self.text(k) != "or" or first.determiner == "all" or first.plural or first.options:
                continue
            k += 2 if self.text(k + 1) == "else" else 1
            for end, second in self.np(k):
                if second.plural or second.determiner == "all" or (second.ranks and second.options):
                    continue
                others = second.options or (second,)
                if first.one and not first.nouns and not first.names:
                    head = replace(first, nouns=others[0].nouns, one=others[0].one)
                else:
                    head = first
                    others = tuple(
                        replace(o, nouns=first.nouns, one=False) if o.one and not o.nouns else o for o in others
                    )
                made.append((end, Ref(text="", determiner="a", options=(head, *others))))
        if self.text(i) in ("whichever", "whatever"):
            # "whichever of the red and blue cubes is larger"
            start = i + 2 if self.text(i + 1) == "of" else i + 3 if self.said(i + 1, i + 3) == "one of" else 0
            for j, refs in self.np_list(start) if start else []:
                ranks = self._whichever_is(j) if len(refs) > 1 else []
                made += [(end, Ref(text="", determiner="the", options=refs, ranks=(rank,))) for end, rank in ranks]
        chosen = [
            (end, replace(ref, determiner="the", ranks=(rank,)))
            for j, ref in made
            if not ref.ranks
            for end, rank in self.whichever(j)
        ]
        return [(end, replace(ref, text=self.said(i, end))) for end, ref in (*chosen, *made)]

    @rule
    def whichever(self, i: int) -> Found[Rank]:
        """As in "whichever is closer", "whichever one is the biggest"."""
        start = i + 1 if self.text(i) == "," else i
        if self.text(start) not in ("whichever", "whatever"):
            return []
        start += 2 if self.text(start + 1) == "one" else 1
        start += 2 if self.said(start, start + 2) in ("of them", "of these") else 0
        return self._whichever_is(start)

    def _whichever_is(self, i: int) -> Found[Rank]:
        found: Found[Rank] = []
        if self.text(i) not in ("is", "are", "stands", "sits", "lies"):
            return found
        for start in self.optional(i + 1, "THE"):
            for j, key in self.tag(start, "SUPER"):
                thing = Ref(text="", ranks=(Rank(key),))
                found += [(end, ref.ranks[-1]) for end, ref in self._anchored(j, thing)]
                found.append((j, Rank(key)))
        return found

    def _any_of(self, first: Ref, others: tuple[Ref, ...], text: str) -> list[tuple[Ref, ...]]:
        """As in "the can, the ball or the cube", which is one of the three; "everything red, blue or green" is all of it."""
        lead, *more = others
        if more or first.options or first.ranks:
            return []
        options = lead.options
        if not (first.plural or first.determiner == "all"):
            return [(replace(lead, options=(first, *options), text=text),)]
        shades = tuple(c for o in options for c in o.colours if not (o.nouns or o.names))
        if first.colours and len(shades) == len(options):
            return [(replace(first, colours=(*first.colours, *shades), text=text),)]
        return []

    def _either(self, i: int) -> Found[tuple[Ref, ...]]:
        """As in "the white or the green one", of which neither is meant."""
        found: Found[tuple[Ref, ...]] = []
        for j, ref in self.np(i):
            found.append((j, (ref,)))
            if self.text(j) in ("or", "nor"):
                found += [(end, (ref, *others)) for end, others in self._either(j + 1)]
        return found
