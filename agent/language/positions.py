"""Positions: "to the left of the can", "in the far corner of the table", every way to read them."""

from __future__ import annotations

from abc import ABC, abstractmethod

from robosandbox.agent.language.chart import Chart, Found, rule
from robosandbox.agent.language.intent import Rank, Ref, Region, Relation
from robosandbox.agent.language.wordlist import word_set


class Positions(Chart, ABC):
    """The rules for positions relative to things and for parts of the table."""

    @abstractmethod
    def np(self, i: int, /) -> Found[Ref]:
        """One noun phrase; `Phrasing` knows how."""

    @abstractmethod
    def np_list(self, i: int, /) -> Found[tuple[Ref, ...]]:
        """Noun phrases joined by commas and "and"; `Phrasing` knows how."""

    @rule
    def relation(self, i: int) -> Found[Relation]:
        """As in "to the left of the can", "into the bin", "between the two cubes", "on the table"."""
        found: Found[Relation] = []
        if i >= self.count or _PLACING.isdisjoint(self.tags[i]):
            return found
        for tag, directional in (("REL", False), ("TO", True), ("SOURCE", False)):
            for j, kind in self.tag(i, tag):
                kind = kind or "from"
                for k in self.optional(j, "THE"):
                    for m, _ in self.tag(k, "TABLE"):
                        if kind in ("on", "from", "to"):
                            found.append((m, Relation("on" if kind == "to" else kind, (), None, directional)))
                if kind == "in" and self.text(j) == "the":
                    for k, key in self.tag(j + 1, "POS"):
                        if key in ("left", "right") and k == j + 2:
                            other = Ref(text=self.said(j, k), one=True, ranks=(Rank(key),))
                            found.append((k, Relation("in", (other,), None, directional)))
                if self.said(j, j + 2) in ("front of", "top of"):
                    # "in front of both" is in nothing.
                    continue
                for k, refs in self.np_list(j):
                    single = len(refs) == 1
                    if kind == "between":
                        if len(refs) == 2 or (single and (refs[0].plural or refs[0].number == 2)):
                            found.append((k, Relation(kind, refs)))
                    elif single and _set_against_others(refs[0]):
                        # "everything in the bin but not the can": it is not the bin that the can is set against.
                        continue
                    elif single:
                        if kind in _OPPOSITE and not directional:
                            found += self._between_sides(k, kind, refs[0])
                        below = tag == "SOURCE" and bool(_BELOW & {self.text(m) for m in range(i, j)})
                        out = Relation("under", refs, order="from")
                        over = "over" if kind == "to" and self.text(i) == "over" else ""
                        if kind == "on" and not {"top", "atop"}.isdisjoint(self.texts[i:j]):
                            over = "top"
                        found.append((k, out if below else Relation(kind, refs, None, directional, over)))
        return found

    def _between_sides(self, i: int, side: str, first: Ref) -> Found[Relation]:
        """As in "to the left of the can and to the right of the box": between the two."""
        joint = i + (self.text(i) == ",")
        return [
            (k, Relation("between", (first, *refs)))
            for j, kind in (self.tag(joint + 1, "REL") if self.text(joint) in ("and", "but") else ())
            if kind == _OPPOSITE[side]
            for k, refs in self.np_list(j)
            if len(refs) == 1 and not refs[0].plural
        ]

    @rule
    def region(self, i: int) -> Found[Region]:
        """As in "in the far left corner of the table", "on the right", "at the edge"."""
        found: Found[Region] = []
        if self.text(i) in ("close", "next", "right", "over", "near") and self.text(i + 1) in (
            "to",
            "at",
            "by",
            "in",
            "on",
        ):
            # "close to the left edge"
            found += self.region(i + 1)
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
                region = Region(names, tuple(dict.fromkeys(sides)), directional=self.text(i) in ("towards", "toward"))
                found += [(end, region) for end in self._of_table(k + 1)]
                found += [
                    hit
                    for end in self._of_table(k + 1)
                    if names in ("corner", "side", "edge")
                    for hit in (*self._told_by(end, region), *self._told_apart(end, region))
                ]
            if (
                sides
                and j > start
                and (self.text(i) not in ("to", "towards", "toward", "into") or self._of_table(k)[0] > k)
                and self.text(k - 1) not in ("top", "bottom", "upper", "lower")
                # "the ball in the left bin, the can in the right" means the right bin.
                and not (self.text(i) == "in" and set(sides) <= {"left", "right"})
            ):
                side = Region("side", tuple(dict.fromkeys(sides)))
                found += [hit for end in self._of_table(k) for hit in ((end, side), *self._told_apart(end, side))]
        return found

    def _told_apart(self, i: int, corner: Region) -> Found[Region]:
        """As in "the right corner on the far side", "the corner nearest to you, on your left", "at the back on the right"."""
        found: Found[Region] = []
        sides = {*corner.sides}
        k = i
        while True:
            k += self.text(k) == ","
            if self.text(k) in ("nearest", "closest", "next", "near", "close"):
                told, k = {"near"}, k + 1
                k += self.text(k) == "to"
                if self.text(k) not in ("you", "yourself"):
                    return found
                k += 1
            elif self.text(k) in ("on", "at", "to", "in"):
                own = self.text(k + 1) in ("your", "its")
                k += 2 if own or self.text(k + 1) == "the" else 1
                k += self.text(k) == "own"
                told = {"far"} if self.text(k) in ("other", "opposite") else set[str]()
                k += bool(told)
                while self.text(k) in _REGION_SIDES:
                    told.add(_REGION_SIDES[self.text(k)])
                    k += 1
                named = self.text(k) in ("side", "end", "edge", "hand", "half")
                if not named and (self.tag(k, "NOUN") or self.text(k) in self.words.parts):
                    # "the can at the back in the top drawer"
                    return found
                k += named
                if not told and own and named:
                    told = {"near"}
            else:
                return found
            sides |= told
            if not told or {"left", "right"} <= sides or {"near", "far"} <= sides:
                return found
            found += [
                (end, Region(corner.name, tuple(sorted(sides)), directional=corner.directional))
                for end in self._of_table(k)
            ]
            k = found[-1][0]

    def _told_by(self, i: int, corner: Region) -> Found[Region]:
        """As in "the corner nearest the bin", "the corner diagonally opposite the bin"."""
        k = i + 1 if self.text(i) in ("diagonally", "directly", "right", "that") else i
        k = k + 1 if self.text(k) == "is" and k > i else k
        word = self.text(k)
        if word not in _BY_ANCHOR or corner.sides or corner.name != "corner":
            return []
        k = k + 2 if self.text(k + 1) in ("to", "from") else k + 1
        far = _BY_ANCHOR[word]
        return [
            (end, Region(corner.name, anchor=ref, farthest=far))
            for end, ref in self.np(k)
            if not (ref.plural or ref.unknown or ref.determiner == "it")
        ]

    def _of_table(self, i: int) -> list[int]:
        ends = [i]
        if self.text(i) in ("of", "on", "in"):
            ends = [end for j in self.optional(i + 1, "THE") for end, _ in self.tag(j, "TABLE")] + ends
        return ends


def _set_against_others(ref: Ref) -> bool:
    """Say whether a single thing is told apart from things of another kind: "the bin but not the can"."""
    which = ref.determiner == "the" and not ref.plural and bool(ref.nouns)
    told_apart = any(out.nouns and out.nouns != ref.nouns for out in ref.without)
    return which and (told_apart or " but not " in ref.text)


_OPPOSITE = {"left": "right", "right": "left", "front": "back", "back": "front"}
_PLACING = frozenset({"REL", "TO", "SOURCE"})
_BELOW = frozenset({"under", "underneath", "beneath", "below"})
_REGION_PREPOSITIONS = word_set("in on at to into onto near by towards toward over")
_REGION_SIDES = {
    "left": "left", "right": "right", "front": "near", "near": "near", "nearest": "near", "closest": "near", "close": "near", "bottom": "near",
    "lower": "near", "back": "far", "far": "far", "rear": "far", "top": "far", "upper": "far", "farthest": "far",
    "furthest": "far", "leftmost": "left", "rightmost": "right", "lefthand": "left", "righthand": "right",
}  # fmt: skip
_BY_ANCHOR = {
    **dict.fromkeys(("nearest", "closest"), False),
    **dict.fromkeys(("opposite", "farthest", "furthest"), True),
}
_REGION_NAMES = {
    "corner": "corner", "edge": "edge", "border": "edge", "rim": "edge", "side": "side", "half": "side", "end": "side", "part": "side",
    "area": "side", "section": "side", "middle": "middle", "center": "middle", "centre": "middle", "midpoint": "middle",
}  # fmt: skip
