"""Commands, in whatever order people say them: verb first, place first, as a wish, or with no verb at all."""

from __future__ import annotations

from robosandbox.agent.language.chart import Found, rule
from robosandbox.agent.language.clauses import Element
from robosandbox.agent.language.conditions import Conditions
from robosandbox.agent.language.frames import frame_command
from robosandbox.agent.language.intent import IT, Command, Ref, Relation, replace
from robosandbox.agent.language.logic import There
from robosandbox.agent.language.wishes import spoken
from robosandbox.agent.language.word_order import ORDERS
from robosandbox.agent.language.worded import worded
from robosandbox.agent.language.wordlist import word_set

_POSTURES = frozenset({"standing", "sitting", "lying", "resting", "waiting", "parked"})
_TOPS = frozenset({"lid", "top", "surface", "cap", "rim", "head", "tip"})
_TAKES = frozenset({"take", "grab", "get", "fetch"})
_MOVES = frozenset({"go", "move", "slide", "roll", "drive", "travel", "scoot"})
_HOLDERS = word_set("rack case caddy holder hamper locker shelf cradle dock cubby chest pouch pocket sleeve trough")


def _tells_which(command: Command) -> bool:
    """Say whether where something is to go is a position that rather tells what is meant."""
    place = command.place
    return isinstance(place, Relation) and place.kind in ("between", "in", "on") and not place.directional


class Commands(Conditions):
    """The rules for one command."""

    @rule
    def clause(self, i: int) -> Found[Command]:
        """A command: verb first, place first, or as a wish; gapped clauses borrow the verb before them."""
        found: Found[Command] = []
        for start in self._preambles(i, 0):
            # What tells a tower level by level has many another reading, and comes first so that none of them pushes it out.
            found += self.told_tower(start)
            found += self._verb_first(start)
            found += self._wish(start)
            found += self._by_doing(start)
        for start, _ in self.tag(i, "OWN_WISH"):
            # "I want to pick up the can"; but "I have to go home" is about the speaker.
            found += [(j, command) for j, command in self._verb_first(start) if command.objects]
        found += self._fronted(i)
        found += self._partitive(i)
        found += self._telegram(i)
        for j, key in self.tag(i, "FROM"):
            # "counting from the left, pick the fourth"
            for end, command in self._verb_first(self._skip(j)):
                found.append((end, replace(command, objects=tuple(_counted_from(ref, key) for ref in command.objects))))
        if self.text(i) == "use":
            # "use the green cubes to make a tower on the tray"
            for j, refs in self.np_list(i + 1):
                for k, verb in self.tag(j + 1, "VERB") if self.text(j) == "to" else []:
                    if verb == "build":
                        found += [
                            (end, command)
                            for end, elements in self.elements(k)
                            for command in frame_command("build", (*elements, Element("material", refs)))
                        ]
        for j, _ in self.tag(i, "INSTEAD"):
            for k, _ in self.np_list(j):
                found += self._verb_first(self._skip(k))
            # "instead of putting the pear in the basket, put it in the tray"
            for k, left in self._verb_first(j) if self.text(j).endswith("ing") else []:
                for end, command in self._verb_first(self._skip(k)) if self._skip(k) > k else []:
                    it = bool(command.objects) and command.objects[0].determiner == "it"
                    found.append((end, replace(command, objects=left.objects) if it else command))
        return list(dict.fromkeys(found))

    def _asks_for(self, i: int) -> bool:
        """As in "if there is a ball, tap it", which asks whether there is one."""
        return self.text(i) == "if" and any(
            isinstance(told, There) and not told.bound.none and self.closed_off(j) for j, told in self.condition(i + 1)
        )

    def _verb_first(self, i: int) -> Found[Command]:
        found: Found[Command] = worded(self, i)
        for j, verb in self.tag(i, "VERB") if self._asks(i) else []:
            if verb == "home":
                found.append((j, Command("home")))
                found += [(k, Command("home")) for k in self._arm(j)]
            for start in self.optional(j, "SWAP_OF") if verb == "swap" else [j]:
                # "leave the can on the table" is rather to let it be.
                strain = 0.6 if self.text(i).startswith("leav") else 0.0
                dumped = self.text(i).startswith("dump")
                for k, elements in self.elements(start):
                    if dumped and verb in ("pour", "put"):
                        # "dump the can in the bowl": the can; "dump the can out into the bowl": what is in it.
                        out = any(e.kind == "particle" and e.value == "out" for e in elements)
                        strain = 0.6 if out == (verb == "put") else 0.0
                    if self.text(i).startswith("arrang") and len(elements) == 1 and verb in ("sort", "line_up"):
                        # "arrange the cubes": by what, or into what?
                        continue
                    if self.text(i) in _TAKES and self.text(k - 1) == "right" and self.text(k) in ("and", "then"):
                        # "take the ball right and put it in the bin": a way of speaking, and no way to go.
                        elements = tuple(e for e in elements if (e.kind, e.value) != ("direction", "right"))
                        verb = "pick"
                    made = frame_command(verb, elements)
                    if self.text(i) in _TAKES and self._puts_it(k):
                        # "take the lime away from the plum and put it in the tray": the push would be for nothing.
                        away = [c for c in made if c.verb == "push" and getattr(c.place, "kind", "") == "away"]
                        made = [replace(c, verb="pick", place=None) if c in away else c for c in made]
                    if verb == "move" and self.text(i) in _TAKES:
                        # "take the ball between the cans" tells which; "take it to the tray" where to.
                        made = [c for c in made if not _tells_which(c)]
                    found += [(k, replace(c, bare=c.bare + strain) if strain else c) for c in made]
                    found += self._tapped(k, made) if verb == "tap" else []
            if verb == "tap":
                # "tap the lid of the can": a tap lands on top.
                for k in [
                    end
                    for m in self.optional(j, "THE")
                    if self.text(m) in _TOPS
                    for end in (m + 2,)
                    if self.text(m + 1) == "of"
                ]:
                    for end, elements in self.elements(k):
                        found += [(end, command) for command in frame_command(verb, elements)]
            if verb in ("give", "put", "pick"):
                # "give me the can, put it in the bin", "bring the can and put it on the tray": it is to be put.
                for k, refs in self.np_list(j + 1 if self.text(j) in ("me", "us") else j):
                    then = self._skip(k)
                    then = self._skip(then + 1) if self.text(then) in ("and", "then") else then
                    for end, command in self._verb_first(then) if then > k else []:
                        if (
                            command.verb in ("put", "stack")
                            and command.objects
                            and command.objects[0].determiner == "it"
                        ):
                            found.append((end, replace(command, objects=refs)))
            if verb == "build":
                # "build a three-cube tower"
                for k, number in [hit for m in self.optional(j, "A") for hit in self.tag(m, "NUM")]:
                    for m, (_, phrase, _) in self.tag(k, "NOUN"):
                        which = Ref(
                            text=self.said(j, m), determiner="a", nouns=(phrase,), number=int(number), plural=True
                        )
                        if number >= 2:
                            found += [
                                (end, Command("stack", (which,)))
                                for end, (n, _, _) in self.tag(m, "NOUN")
                                if n == "tower"
                            ]
            if verb in ("stack", "build"):
                found += self._by_kinds(j)
            if verb == "load":
                # "fill the box: the cup, the can"
                for k, into in self.np_list(j):
                    if self.text(k) == ":" and len(into) == 1:
                        found += [
                            (end, Command("put", refs, Relation("in", into))) for end, refs in self.np_list(k + 1)
                        ]
            if verb in ("open", "close") and (j >= len(self.tokens) or self._joints_at(j)):
                # "open the drawer, put the can in, close"
                found.append((j, Command("open" if verb == "open" else "close", (IT,), bare=0.6)))
            if verb == "stack":
                # "stack them: blue, green, red"
                for k, whole in self.np(j):
                    if self.text(k) == ":" and (whole.plural or whole.determiner == "all"):
                        found += [(end, Command("stack", refs)) for end, refs in self.np_list(k + 1) if len(refs) > 1]
            if verb == "put":
                taken = self.text(i - 1) in (",", "and", "then") and "pick" in {
                    value for m in range(i - 1) for _, value in self.tag(m, "VERB")
                }
                for k, refs in self.np_list(j):
                    found += self._run_on(refs, k)
                    if taken and self._named_container(refs):
                        # "take sponge, put blue box"
                        found.append((k, Command("put", (IT,), Relation("in", refs), bare=0.9)))
            if verb == "give":
                found += self._light(j)
                # "give the can in the bin", as a German has it
                found += [
                    (k, replace(c, bare=0.3))
                    for k, elements in self.elements(j)
                    if {e.kind for e in elements} == {"objects", "place"}
                    for c in frame_command("put", elements)
                    if isinstance(c.place, Relation) and c.place.kind in ("in", "on")
                ]
            if verb in ("build", "pick") and self.text(i) in ("make", "let", "get"):
                # "make the car go forward"
                found += [
                    (end, command)
                    for k, refs in self.np_list(j)
                    if self.text(k) in _MOVES
                    for end, elements in self.elements(k + 1)
                    for command in frame_command("push", (spoken(refs), *elements))
                ]
            if self.text(i) in ("leave", "keep", "have", "park"):
                # "leave it standing next to the can"
                found += [
                    (end, command)
                    for k, refs in self.np_list(j)
                    if self.text(k) in _POSTURES
                    for end, elements in self.elements(k + 1)
                    if elements and elements[0].kind == "place"
                    for command in frame_command("put", (spoken(refs), *elements))
                ]
            if verb in ("go", "move", "put", "push"):
                for k in self._arm(j):
                    for end in self._home(k):
                        found.append((end, Command("home")))
        if self.text(i) == "keep":
            # "keep the ginger in the tin", where it is not: put it there.
            found += [
                (end, replace(c, bare=1.6))
                for end, elements in self.elements(i + 1)
                if [e.kind for e in elements] == ["objects", "place"]
                for c in frame_command("put", elements)
                if isinstance(c.place, Relation) and c.place.kind in ("in", "on") and c.place.refs
            ]
        for j, where in self._container_verb(i):
            # "crate the cube", "rack all vials"
            found += [
                (k, Command("put", refs, Relation("in", (where,)), bare=0.3))
                for k, refs in self.np_list(j)
                if refs[0].determiner != "bare"
            ]
        for end in self._home(i):
            # "home"; but "start" alone is no place, nor is "rest".
            if end > i + 1 or self.text(i) == "home":
                found.append((end, Command("home")))
        return found

    def _puts_it(self, i: int) -> bool:
        """Say whether an order to put "it" somewhere follows."""
        k = self._skip(i)
        while self.text(k) in ("and", "then"):
            k += 1
        return k > i and any(verb == "put" and bool(self.tag(j, "PRON")) for j, verb in self.tag(k, "VERB"))

    def _container_verb(self, i: int) -> Found[Ref]:
        """Return a container whose noun stands as a verb at `i`: one by its kind, or by what its name ends with."""
        found: Found[Ref] = [
            (j, Ref(text=self.said(i, j), nouns=(phrase,)))
            for j, (noun, phrase, plural) in self.tag(i, "NOUN")
            if noun in ("bin", "bowl", "box", "drawer") and not plural
        ]
        if not found and self.text(i) in _HOLDERS and self.text(i) in self.words.lasts:
            found = [(i + 1, Ref(text=self.text(i), names=(self.text(i),)))]
        return found

    def _by_kinds(self, i: int) -> Found[Command]:
        """As in "stack the dice, white on red", "build a tower with the dice: white, red from the bottom up"."""
        found: Found[Command] = []
        i += self.text(i) in ("me", "us")
        starts = [i]
        for k, tower in self.np(i):
            if tower.nouns[:1] == ("tower",):
                starts += [m for m, _ in self.tag(k, "MATERIAL")]
        for j, whole in [hit for start in starts for hit in self.np(start)]:
            if self.text(j) not in (",", ":") or not (whole.nouns or whole.names) or whole.ranks or whole.colours:
                continue
            if whole.nouns[:1] == ("tower",):
                if not any(end == j for end, _ in self.tag(j - 1, "NOUN")):
                    # "a tower of black, brown, pink"
                    continue
                # "build a tower: green on blue on yellow": of whatever is green, blue and yellow.
                whole = Ref(text="", one=True)
            on = self._kinds(j + 1, whole, "on")
            found += [(k, Command("stack", refs[:1], Relation("on", refs[1:2]), refs[2:])) for k, refs in on]
            for k, refs in self._kinds(j + 1, whole, ","):
                for tag, order in ORDERS:
                    for m in (k, k + 1) if self.text(k) == "," else (k,):
                        found += [(end, Command("stack", refs, None, (), order)) for end, _ in self.tag(m, tag)]
        return found

    def _kinds(self, i: int, whole: Ref, joint: str) -> Found[tuple[Ref, ...]]:
        """Two or more adjectives, joined by "on" or commas: each is one of the things named before."""
        refs: list[Ref] = []
        found: Found[tuple[Ref, ...]] = []
        one = replace(whole, determiner="the", plural=False, number=None)
        while i:
            start = self.optional(i, "THE")[0]
            hits = [hit for hit in self._adjectives(start, one, 0) if hit[0] > start]
            if self.text(start) in self.words.parts:
                hits.append((start + 1, replace(one, names=(self.text(start), *(one.names or one.nouns)), nouns=())))
            if not hits:
                break
            j, ref = hits[0]
            refs.append(replace(ref, text=" ".join((self.said(i, j), *whole.text.split()[-1:]))))
            j += self.text(j) == "one"
            if len(refs) > 1:
                found.append((j, tuple(refs)))
            upon = j + 3 if self.said(j, j + 3) == "on top of" else j + 1
            i = (upon if self.text(j) == "on" else 0) if joint == "on" else self._joint(j)
        return found

    def _light(self, i: int) -> Found[Command]:
        """As in "give the can a gentle push to the left": the noun is the verb."""
        found: Found[Command] = []
        for j, refs in self.np_list(i):
            for k, _ in self.tag(j, "A"):
                for m in self.optional(k, "LIGHT_ADJECTIVE"):
                    for n, verb in self.tag(m, "LIGHT_NOUN"):
                        for end, elements in self.elements(n):
                            made = frame_command(verb, (spoken(refs), *elements))
                            found += [(end, c) for c in made]
                            found += self._tapped(end, made) if verb == "tap" else []
        return found

    def _tapped(self, i: int, commands: list[Command]) -> Found[Command]:
        """As in "tap the can on the lid", "tap the can, just a little", "touch it from above": a tap lands gently on top."""
        ends = [i + 2] if self.said(i, i + 2) == "from above" else []
        if self.text(i) in ("on", "at"):
            ends += [k + 1 for k in self.optional(i + 1, "THE") if self.text(k) in _TOPS]
        ends += [j for j, _ in self.tag(i + 1 if self.text(i) == "," else i, "AMOUNT")]
        often = [(end, replace(c, times=n)) for k in ends for end, n in self.tag(k, "TIMES") for c in commands]
        found = [*((end, c) for end in ends for c in commands), *((end, c) for end, c in often)]
        return [(j, c) for j, c in found if j >= self.count or self._joints_at(j)]

    def _arm(self, i: int) -> list[int]:
        return [end for start in self.optional(i, "THE") for end, _ in self.tag(start, "ARM")]


def _counted_from(ref: Ref, key: str) -> Ref:
    return replace(ref, ranks=tuple(replace(rank, key=key) if not rank.key else rank for rank in ref.ranks))
