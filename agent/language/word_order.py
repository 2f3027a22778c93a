"""Commands with the thing, the place or nothing but these first: "the can, put it in the bin", "can in the bin"."""

from __future__ import annotations

from abc import ABC
from typing import Literal

from robosandbox.agent.language.chart import Found
from robosandbox.agent.language.clauses import Element, Elements
from robosandbox.agent.language.frames import frame_command
from robosandbox.agent.language.intent import Command, Ref, Relation, Verb, replace
from robosandbox.agent.language.verbs import BASE_FORMS
from robosandbox.agent.language.wishes import Wishes, spoken

_YOU_MUST = frozenset(f"you {must}" for must in ("must", "should", "can", "could", "have", "need", "may", "will"))
ORDERS: tuple[tuple[str, Literal["up", "down"]], ...] = (("UP_ORDER", "up"), ("DOWN_ORDER", "down"))
_ASKING = BASE_FORMS - {"stand", "rest"}
"""Verbs that ask for something after their object as well: "the cubes stand in a row" tells how they are."""
_STATES: dict[str, Verb] = {"open": "open", "opened": "open", "closed": "close", "shut": "close"}


def _of_some(ref: Ref) -> bool:
    """Say whether a thing is told by its place in an order alone: "the closer one"."""
    return bool(ref.one and ref.ranks) and not (ref.nouns or ref.names or ref.plural or ref.colours)


class WordOrder(Wishes, ABC):
    """The rules for commands in which the verb is not first, or is left out."""

    def _preambles(self, i: int, depth: int) -> list[int]:
        starts = [i]
        if depth < 3:
            for j, _ in self.tag(i, "PREAMBLE"):
                starts += self._preambles(self._skip(j), depth + 1)
        return list(dict.fromkeys(starts))

    def _partitive(self, i: int) -> Found[Command]:
        """As in "of the three mugs, take the middle one", "of the mugs, the left one goes in the bin"."""
        found: Found[Command] = []
        if self.text(i) not in ("of", "out", "from", "among"):
            return found
        for j, whole in self.np(i + 2 if self.text(i + 1) == "of" else i + 1):
            start = self._skip(j)
            commands = (*self._verb_first(start), *self._wish(start)) if whole.plural and not whole.ranks else ()
            for k, command in commands:
                if command.objects and all(ref.one and not ref.nouns for ref in command.objects):
                    parts = tuple(
                        replace(
                            ref,
                            nouns=whole.nouns,
                            names=whole.names,
                            one=False,
                            colours=ref.colours or whole.colours,
                            relations=(*whole.relations, *ref.relations),
                        )
                        for ref in command.objects
                    )
                    found.append((k, replace(command, objects=parts)))
        for j, refs in self.np_list(i + 2 if self.text(i + 1) == "of" else i + 1):
            # "of the can and the cube, take the one that is further left"
            single = len(refs) > 1 and not any(
                ref.plural or ref.unknown or ref.determiner in ("a", "all") for ref in refs
            )
            start = self._skip(j)
            for k, command in (*self._verb_first(start), *self._wish(start)) if single and start > j else ():
                if len(command.objects) == 1 and _of_some(command.objects[0]):
                    which = replace(command.objects[0], options=refs, one=False)
                    found.append((k, replace(command, objects=(which,))))
        return found

    def _fronted(self, i: int) -> Found[Command]:
        """As in "In the bin, put the red cube"; "the red cube, put it in the bin"."""
        found: Found[Command] = []
        if self.text(i) in ("start", "begin") and self.text(i + 1) == "with":
            # "start with the marble: put it in the tray"
            i += 2
        for tag, order in ORDERS:
            for k, _ in self.tag(i, tag):
                # "from the bottom up: yellow, white, blue"
                found += [
                    (j, Command("stack", refs, None, (), order))
                    for j, refs in (self.np_list(self._skip(k)) if self._skip(k) > k else ())
                    if len(refs) > 1
                ]
        for k, ref in self.np(i):
            if ref.nouns[:1] == ("tower",) and self.text(k) in (":", ","):
                # "a tower: red on green on blue"
                found += [(end, c) for end, c in self._telegram(k + 1) if c.verb in ("put", "stack")]
                # "tower: red, green, blue from bottom to top"
                found += [
                    (end, command)
                    for end, elements in self.elements(k + 1)
                    for command in frame_command("build", (Element("objects", (ref,)), *elements))
                    if command.objects
                ]
        for k, _ in self.tag(i, "LOOK"):
            if not self._asks_for(i):
                found += self._pointed_out(k)
        for j, element in self.element(i):
            comma = j + 1 if self.text(j) in (",", ":") else j
            if element.kind == "objects" and self.text(j) in _ASKING and "VERB" in self.tags[j]:
                # "the can pick it up", as it is dictated
                for k, command in self._verb_first(j):
                    if command.objects and command.objects[0].determiner == "it":
                        found.append(
                            (
                                k,
                                replace(
                                    command, objects=(*element.value, *command.objects[1:]), bare=command.bare + 0.6
                                ),
                            )
                        )
            if element.kind == "objects" and (self._skip(j) > j or self.said(j, j + 2) in _YOU_MUST):
                # "the can, put it in the bin", "the can you must put it in the bin"
                for start in self._preambles(self._skip(j), 0):
                    for k, command in (
                        *self._verb_first(start),
                        *(self._wish(start) if start == self._skip(j) else ()),
                    ):
                        it = command.objects[:1]
                        # "the small brick, the little one, put it in the box" says twice which.
                        again = it and not it[0].plural and len(element.value) > 1 and "and" not in self.texts[i:j]
                        if it and it[0].determiner == "it" and not again:
                            # "tap the can and the cup. Pick it up": the cup is of the list.
                            listed = 0.6 if self.text(i - 1) == "and" and self.text(j) == "." else 0.0
                            named = replace(command, objects=(*element.value, *command.objects[1:]))
                            found.append((k, replace(named, bare=command.bare + listed)))
                # "the can is old, into the bin with it"
                found += [
                    (end + 2, command)
                    for end, place in self.element(self._skip(j))
                    if place.kind == "place" and self.text(end) == "with" and self.tag(end + 1, "PRON")
                    for command in frame_command("put", (element, place))
                ]
            elif element.kind in ("place", "direction") or (element.kind == "distance" and comma > j):
                for start in self._preambles(comma, 0):
                    # "in the right bin ..." goes on with the bin.
                    noun = start == j and self.tag(start, "NOUN")
                    for m, verb in self.tag(start, "VERB") if not noun else []:
                        if verb in ("put", "move", "stack", "push"):
                            for end, elements in self.elements(m):
                                # "in the grey bin" is no binning in the grey.
                                if any(e.kind == "objects" for e in elements):
                                    found += [(end, c) for c in frame_command(verb, (*elements, element))]
                with_ = j + 1 if self.text(j) in ("with", "goes", "go", "comes", ",") else 0
                if element.kind == "place" and with_:
                    # "into the bin with the plum", "into the bin goes the plum", "in the bin, the plum"
                    for end, refs in self.np_list(with_):
                        if self.text(j) == "," and self._skip(end) < len(self.tokens):
                            continue
                        found += [(end, c) for c in frame_command("put", (spoken(refs), element))]
        return found

    def _pointed_out(self, i: int) -> Found[Command]:
        """As in "see the small block over there? Put it in the bin"; "there is a can, tap it"."""
        found: Found[Command] = []
        for j, ref in self.np(i):
            j = next((end for end, particle in self.tag(j, "PART") if particle == "over here"), j)
            if self._skip(j) == j and self.text(i - 3) != "if" and self.text(i - 4) != "if":
                continue
            which = replace(ref, determiner="the") if ref.determiner == "a" or ref.number else ref
            for start in self._preambles(self._skip(j), 0):
                for end, command in (*self._verb_first(start), *self._wish(start)):
                    it = command.objects[0] if command.objects else None
                    if it is not None and it.determiner == "it" and it.plural == ref.plural:
                        found.append((end, replace(command, objects=(which, *command.objects[1:]))))
        return found

    def _telegram(self, i: int) -> Found[Command]:
        """As in "red cube in the bin", "red on green on blue": no verb, or the one before."""
        found: Found[Command] = []
        beside: dict[int, list[tuple[int, str, Elements]]] = {}
        for j, refs in self.np_list(i):
            if refs[0].text.split(" ")[0] in ("whichever", "whatever"):
                continue
            if self.text(i) == "any" and self.text(i - 1) == "," and self.text(i + 1) in self.texts[: i - 1]:
                # "put a cube in the bowl, any cube, and a ball in the bin"
                continue
            # "the marble and the block, both into the crate"
            both = j + 2 if self.text(j) in (",", ":") and self.text(j + 1) in ("both", "all", "each") else j
            if both == j and len(refs) > 1 and self.text(j) in ("both", "all", "each"):
                both = j + 1
            both += 2 if both > j and self.said(both, both + 2) == "of them" else 0
            starts = {both, j + 1} if self.text(j) in (",", ":", "!", ".") else {both}
            for start in sorted(starts):
                if start not in beside:
                    beside[start] = [hit for found_ in self.elements(start) for hit in _implied(*found_)]
                for end, verb, elements in beside[start]:
                    if self.text(end) == "?" and end + 1 < self.count and self.tag(end + 1, "VERB"):
                        # "the lemon in the bowl? Get it": which lemon, and no order.
                        continue
                    found += [(end, replace(c, bare=0.3)) for c in frame_command(verb, (spoken(refs), *elements))]
            if self.text(both) in ("put", "place"):
                # "small stone put in flower pot", "ruler and crayon all put into pencil case"
                found += [
                    (end, replace(c, bare=0.6))
                    for end, elements in self.elements(both + 1)
                    if [element.kind for element in elements] == ["place"]
                    for c in frame_command("put", (spoken(refs), *elements))
                ]
            if self.text(j) == "up" and (j + 1 >= len(self.tokens) or self._joints_at(j + 1)):
                # "can up"
                found += [
                    (j + 1, replace(c, bare=0.9))
                    for c in frame_command("pick", (spoken(refs), Element("particle", "up")))
                ]
            if self.text(j) == "swap" and len(refs) == 2:
                ends = [j + 2] if self.text(j + 1) in ("places", "positions", "spots", "locations") else []
                found += [(end, Command("swap", refs, bare=0.3)) for end in (*ends, j + 1)]
            if self.text(j) in _STATES and (j + 1 >= len(self.tokens) or self._joints_at(j + 1)):
                # "drawer closed"
                found.append((j + 1, Command(_STATES[self.text(j)], refs, bare=0.9)))
            found += self._run_on(refs, j + 1 if self.text(j) in (",", ":", ".", "!") else j)
            if self.text(j) in (":", "for") and self._named_container(refs):
                # "left bin: red cube and can", "left bin for the can"
                put = Relation("in", refs)
                found += [(k, Command("put", objects, put, bare=0.6)) for k, objects in self.np_list(j + 1)]
        return found

    def _joints_at(self, i: int) -> bool:
        return self.tokens[i].kind == "mark" or bool(self.tag(i, "THEN"))


def _implied(end: int, elements: Elements) -> list[tuple[int, str, Elements]]:
    """Return the verbs that go without saying beside a thing: to put it where a place is named, to push it a way."""
    kinds = [element.kind for element in elements]
    put = [(end, "put", elements)] if "place" in kinds or "matching" in kinds else []
    # "red cube: 5 cm left"
    return [*put, (end, "push", elements)] if sorted(kinds) == ["direction", "distance"] else put
