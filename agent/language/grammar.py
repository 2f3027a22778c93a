"""Whole sentences: clauses in an order, prohibitions, and every reading of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from robosandbox.agent.language.chart import Found, rule
from robosandbox.agent.language.clauses import Clauses, Element
from robosandbox.agent.language.frames import frame_command
from robosandbox.agent.language.intent import Command, Ref, Relation, Sentence
from robosandbox.agent.language.tokens import SceneWords, Token

Part = Command | tuple[Ref, ...] | str
MAX_SENTENCES = 8


def parse(tokens: Sequence[Token], words: SceneWords) -> tuple[tuple[float, Sentence], ...]:
    """Return the readings of a sentence and how far-fetched each is, the plainest first; none if a part of it is not understood.

    Args:
        tokens: What `tokenize` returned.
        words: The words of the scene's ids.

    Raises:
        TooComplicatedError: It has more readings than are worth following.
    """
    grammar = Grammar(tokens, words)
    found: dict[Sentence, None] = {}
    for end, parts in grammar.parts(0):
        if end == len(tokens):
            sentence = _sentence(parts)
            if sentence:
                found[sentence] = None
    ranked = sorted(((_strain(sentence), sentence) for sentence in found), key=lambda item: item[0])
    return tuple(ranked[:MAX_SENTENCES])


def _sentence(parts: tuple[Part, ...]) -> Sentence | None:
    steps: list[Command] = []
    avoid: list[Ref] = []
    for part in parts:
        if isinstance(part, Command) and part.negated == "same":
            steps += _repeated(steps, part.objects)
        elif isinstance(part, Command):
            steps.append(part)
        elif isinstance(part, tuple):
            avoid += part
    return Sentence(tuple(steps), tuple(avoid)) if steps or avoid else None


def _repeated(steps: list[Command], objects: tuple[Ref, ...]) -> list[Command]:
    """As in "pick it up, put it there, and do the same with the can": the commands about the last thing, for another."""
    start = len(steps)
    while start:
        start -= 1
        if steps[start].objects and steps[start].objects[0].determiner != "it":
            return [replace(steps[start], objects=objects), *steps[start + 1 :]]
    return []


def _strain(sentence: Sentence) -> float:
    """How far-fetched a reading is: unknown words, and modifiers where a plain noun would do."""
    telegrams = sum(command.bare for command in sentence.steps)
    return (
        telegrams
        + sum(_ref_strain(ref) for command in sentence.steps for ref in _refs(command))
        + sum(map(_ref_strain, sentence.avoid))
    )


def _refs(command: Command) -> tuple[Ref, ...]:
    place = command.place
    return (*command.objects, *command.tower, *getattr(place, "refs", ()))


def _ref_strain(ref: Ref) -> float:
    inner = sum(_ref_strain(r) for relation in ref.relations for r in relation.refs) + sum(
        map(_ref_strain, ref.without)
    )
    # "everything but the trays and the tin" leaves both out.
    bare = -0.6 * len(ref.without) + 0.2 * (ref.determiner == "bare") + 0.3 * (ref.one and not ref.nouns)
    return 20.0 * len(ref.unknown) + 1.0 * len(ref.relations) + bare + inner


_STAYS = frozenset({"stay", "stays", "remain", "remains"})


class Grammar(Clauses):
    """The rules for sentences."""

    def parts(self, i: int) -> Found[tuple[Part, ...]]:
        """Everything from `i` to the end, as parts in the order in which they are done."""
        return self._parts(i)

    @rule
    def _parts(self, i: int) -> Found[tuple[Part, ...]]:
        found: Found[tuple[Part, ...]] = []
        n = len(self.tokens)
        i = self._skip(i)
        if i >= n:
            return [(n, ())]
        for j, part in self.part(i):
            if j >= n or self._skip(j) >= n:
                found.append((n, part))
                continue
            for k in self._joints(j):
                found += [(end, (*part, *rest)) for end, rest in self._parts(k) if rest]
            late = [k for k, _ in self.tag(self._skip(j), "FIRST_BUT")]
            if any(self.text(m) == "first" for m in (self._skip(j), self._skip(j) + 1)):
                late += [k for m in (self._skip(j), self._skip(j) + 1) for k, _ in self.tag(m, "FIRST")]
            for k in self._corrected(j):
                # "pick up the can, no, push it": what was said before does not count.
                for end, rest in self._parts(k):
                    first = rest[0] if rest else None
                    last = part[-1]
                    if isinstance(first, Command) and isinstance(last, Command):
                        if first.objects and first.objects[0].determiner == "it":
                            first = replace(first, objects=last.objects)
                        found.append((end, (*part[:-1], first, *rest[1:])))
            for k in self._corrected(j):
                # "put it in the bowl - no, in the tray", "push it left, I mean right": the verb stays.
                found += self._corrected_place(part, k)
            for k in self._joints(j):
                # "anywhere but the bin" is no second command.
                found += self._gapped(part, k) if self.text(k - 1) != "but" else []
            for k in dict.fromkeys(late):
                for end, rest in self._parts(k):
                    found.append((end, (*rest, *part)))
        return found[:20]

    def _corrected_place(self, part: tuple[Part, ...], k: int) -> Found[tuple[Part, ...]]:
        last = part[-1]
        if not isinstance(last, Command) or last.verb not in ("put", "push", "stack") or last.tower or not last.objects:
            return []
        found: Found[tuple[Part, ...]] = []
        places = last.place.refs if isinstance(last.place, Relation) else ()
        for j, refs in self.np_list(k) if places and len(last.objects) == 1 else []:
            same = [bool(ref.nouns) and ref.nouns == refs[0].nouns for ref in (*last.objects, *places)]
            if self._skip(j) >= len(self.tokens) and same[0] and not any(same[1:]):
                # "put the red cube on the plate, oh wait, the green cube": it is the cube that was wrong.
                found.append((len(self.tokens), (*part[:-1], replace(last, objects=refs, bare=last.bare - 0.6))))
        for j, elements in self.elements(k):
            if not elements or any(e.kind not in ("place", "direction", "distance") for e in elements):
                continue
            for command in frame_command(last.verb, (_objects(last.objects), *elements)):
                better = replace(command, distance=command.distance or last.distance, times=last.times)
                if command.verb == "push" and not command.direction and not command.place:
                    better = replace(better, direction=last.direction, place=last.place)
                if self._skip(j) >= len(self.tokens):
                    found.append((len(self.tokens), (*part[:-1], better)))
                for m in self._joints(j):
                    found += [(end, (*part[:-1], better, *rest)) for end, rest in self._parts(m) if rest]
        return found

    def _gapped(self, part: tuple[Part, ...], k: int) -> Found[tuple[Part, ...]]:
        """As in "push the cube left, then right"; "push the can back and the cube forward": the verb from before."""
        last = part[-1]
        if not isinstance(last, Command) or last.verb not in ("push", "pick", "tap", "put", "stack") or last.tower:
            return []
        found: Found[tuple[Part, ...]] = []
        n = len(self.tokens)
        for j, refs in self.np_list(k) if last.verb not in ("push", "stack") or last.place else []:
            # "into the bowl; then the ball": the same with another object.
            again = replace(last, objects=refs, bare=0.9)
            if self._skip(j) >= n:
                found.append((n, (*part, again)))
            for m in self._joints(j):
                found += [(end, (*part, *rest)) for end, rest in self._gapped((again,), m)]
                found += [(end, (*part, again, *rest)) for end, rest in self._parts(m) if rest]
        if last.verb != "push":
            return found
        for j, elements in self.elements(k):
            if not any(e.kind in ("direction", "distance") for e in elements):
                continue
            for command in frame_command("push", elements):
                if command.direction is None:
                    continue
                again = (
                    replace(command, objects=last.objects)
                    if not any(e.kind == "objects" for e in elements)
                    else command
                )
                if self._skip(j) >= n:
                    found.append((n, (*part, again)))
                for m in self._joints(j):
                    found += [(end, (*part, *rest)) for end, rest in self._gapped((again,), m)]
                    found += [(end, (*part, again, *rest)) for end, rest in self._parts(m) if rest]
        return found

    def _skip(self, i: int) -> int:
        while self.text(i) in (",", ".", ";", "!", "?", ":"):
            i += 1
        return i

    def _joints(self, j: int) -> list[int]:
        """Return where the next part can start after one that ended at `j`."""
        starts = []
        k = self._skip(j)
        if k > j:
            starts.append(k)
        for end, _ in self.tag(k, "THEN"):
            starts.append(self._skip(end))
            starts += [self._skip(m) for m, _ in self.tag(self._skip(end), "THEN")]
        if self.tag(k, "AVOID") or self.tag(k, "NEGATION") or self.tag(k, "STILL"):
            starts.append(k)
        if self.text(k) == "but":
            starts.append(k + 1)
        if k == j and any(
            verb in ("pick", "put", "push", "stack", "tap", "go", "open", "close") for _, verb in self.tag(k, "VERB")
        ):
            starts.append(k)
        return list(dict.fromkeys(starts))

    @rule
    def part(self, i: int) -> Found[tuple[Part, ...]]:
        """One clause, a prohibition, or two clauses that "before" or "after" joins."""
        found: Found[tuple[Part, ...]] = []
        # "... but first tap the can" is no step in the order of words; `_parts` knows it.
        opening = i == 0 or self.text(i - 1) in (".", ";", "!", ":", "?", ",")
        for start in self.optional(i, *(("FIRST", "THEN") if opening else ("THEN",))):
            start = self._skip(start) if start > i else start
            for j, command in self.clause(start):
                found.append((j, (command,)))
                comma = self._skip(j)
                for tag in ("BEFORE", "AFTER"):
                    for k, _ in self.tag(comma, tag):
                        for end, second in self.clause(k):
                            found.append((end, (command, second) if tag == "BEFORE" else (second, command)))
            for tag in ("BEFORE", "AFTER"):
                for k, _ in self.tag(start, tag):
                    for j, second in self.clause(k):
                        for m in (self._skip(j), *(e for e, _ in self.tag(self._skip(j), "THEN"))):
                            for first_start in self.optional(m, "FIRST"):
                                for end, first in self.clause(first_start):
                                    found.append((end, (first, second) if tag == "BEFORE" else (second, first)))
        found += [(j, (refs,)) for j, refs in self._prohibition(i)]
        for k, _ in self.tag(i, "STILL"):
            found += [(j, (Command("nothing", refs, negated="move"),)) for j, refs in self.np_list(k)]
        for k, _ in self.tag(i, "SAME"):
            found += [(j, (Command("nothing", refs, negated="same"),)) for j, refs in self.np_list(k)]
        for start in self.optional(i, "PREAMBLE"):
            negated = [j for j, _ in self.tag(start, "NEGATION")]
            if self.text(start) == "no" and self.text(start + 1).endswith("ing"):
                negated.append(start + 1)
                # Touching stands for whatever would move it.
                found += [
                    (end, (refs,))
                    for j, verb in self.tag(start + 1, "VERB")
                    if verb in ("tap", "move", "put")
                    for end, refs in self.np_list(j)
                ]
            for j in negated:
                for end, command in self.clause(j):
                    if command.verb != "tap" and not command.bare:
                        found.append((end, (replace(command, verb="nothing", negated=command.verb),)))
        return list(dict.fromkeys(found))

    def _prohibition(self, i: int) -> Found[tuple[Ref, ...]]:
        found: Found[tuple[Ref, ...]] = []
        for j, refs in self.np_list(i):
            # "the batteries stay where they are"
            k = j + 1 if self.text(j) in ("should", "must", "shall", "can", "will", "to") else j
            if self.text(k) in _STAYS:
                found += [(end, refs) for end in self.optional(k + 1, "AVOID_TAIL")]
        for start in self.optional(i, "PREAMBLE"):
            for j, _ in self.tag(start, "AVOID"):
                for k, refs in self.np_list(j):
                    ends = [end for end, _ in self.tag(k, "AVOID_TAIL")]
                    needs_tail = self.text(start) in ("leave", "leaving") or self.text(j - 1) in ("leave", "leaving")
                    closing = k >= len(self.tokens) or bool(self._joints(k))
                    for end in ends if needs_tail and not closing else [*ends, k]:
                        found.append((end, refs))
        return found

    @rule
    def clause(self, i: int) -> Found[Command]:
        """A command: verb first, place first, or as a wish; gapped clauses borrow the verb before them."""
        found: Found[Command] = []
        for start in self._preambles(i, 0):
            found += self._verb_first(start)
            found += self._wish(start)
        found += self._fronted(i)
        found += self._telegram(i)
        for j, key in self.tag(i, "FROM"):
            # "counting from the left, pick the fourth"
            for end, command in self._verb_first(self._skip(j)):
                found.append((end, replace(command, objects=tuple(_counted_from(ref, key) for ref in command.objects))))
        for j, _ in self.tag(i, "INSTEAD"):
            for k, _ in self.np_list(j):
                found += [(end, command) for end, command in self._verb_first(self._skip(k)) if self._skip(k) > k]
        return list(dict.fromkeys(found))

    def _preambles(self, i: int, depth: int) -> list[int]:
        starts = [i]
        if depth < 3:
            for j, _ in self.tag(i, "PREAMBLE"):
                starts += self._preambles(self._skip(j), depth + 1)
        return list(dict.fromkeys(starts))

    def _verb_first(self, i: int) -> Found[Command]:
        found: Found[Command] = []
        for j, verb in self.tag(i, "VERB"):
            if verb == "home":
                found.append((j, Command("home")))
                found += [(k, Command("home")) for k in self._arm(j)]
            for start in self.optional(j, "SWAP_OF") if verb == "swap" else [j]:
                for k, elements in self.elements(start):
                    found += [(k, command) for command in frame_command(verb, elements)]
            if verb == "give":
                found += self._light(j)
            if verb in ("go", "move", "put", "push"):
                for k in self._arm(j):
                    for end in self._home(k):
                        found.append((end, Command("home")))
        for end in self._home(i):
            if end > i:
                found.append((end, Command("home")))
        return found

    def _light(self, i: int) -> Found[Command]:
        """As in "give the can a gentle push to the left": the noun is the verb."""
        found: Found[Command] = []
        for j, refs in self.np_list(i):
            for k, _ in self.tag(j, "A"):
                for m in self.optional(k, "LIGHT_ADJECTIVE"):
                    for n, verb in self.tag(m, "LIGHT_NOUN"):
                        for end, elements in self.elements(n):
                            found += [(end, c) for c in frame_command(verb, (_objects(refs), *elements))]
        return found

    def _arm(self, i: int) -> list[int]:
        return [end for start in self.optional(i, "THE") for end, _ in self.tag(start, "ARM")]

    def _wish(self, i: int) -> Found[Command]:
        """As in "I want the red cube in the bin", "make sure the can is on the tray", "the red cube goes in the bin"."""
        found: Found[Command] = []
        starts = [end for end, _ in self.tag(i, "DESIRE")]
        for start in [*starts, i]:
            for j, refs in self.np_list(start):
                copulas = [end for end, _ in self.tag(j, "COPULA")]
                if start > i:
                    # "make sure the can is on the tray"; alone, "the can is on the tray" asks for nothing.
                    copulas += [end for end, _ in self.tag(j, "IS_NOW")]
                for k in copulas + ([j] if start > i else []):
                    for m, verb in self.tag(k, "VERB"):
                        # "I need the red cube picked up", "... to be put in the bin".
                        if verb == "swap" or self.text(k).endswith(("ed", "en", "t", "ng", "d")):
                            for end, elements in self.elements(m):
                                objects = _objects(refs)
                                found += [(end, c) for c in frame_command(verb, (objects, *elements))]
                    for end, elements in self.elements(k):
                        if elements and any(e.kind in ("place", "matching") for e in elements):
                            found += [(end, c) for c in frame_command("put", (_objects(refs), *elements))]
        return found

    def _fronted(self, i: int) -> Found[Command]:
        """As in "In the bin, put the red cube"; "the red cube, put it in the bin"."""
        found: Found[Command] = []
        if self.text(i) in ("start", "begin") and self.text(i + 1) == "with":
            # "start with the marble: put it in the tray"
            i += 2
        for j, element in self.element(i):
            comma = j + 1 if self.text(j) in (",", ":") else j
            if element.kind == "objects" and comma > j:
                for start in self._preambles(comma, 0):
                    for k, command in self._verb_first(start):
                        if command.objects and command.objects[0].determiner == "it":
                            found.append((k, replace(command, objects=element.value)))
            elif element.kind in ("place", "direction"):
                for start in self._preambles(comma, 0):
                    for m, verb in self.tag(start, "VERB"):
                        if verb in ("put", "move", "stack", "push"):
                            for end, elements in self.elements(m):
                                found += [(end, c) for c in frame_command(verb, (*elements, element))]
        return found

    def _telegram(self, i: int) -> Found[Command]:
        """As in "red cube in the bin", "red on green on blue": no verb, or the one before."""
        found: Found[Command] = []
        for j, refs in self.np_list(i):
            # "the marble and the block, both into the crate"
            both = j + 2 if self.text(j) == "," and self.text(j + 1) in ("both", "all", "each") else j
            for end, elements in self.elements(both):
                if elements and any(e.kind in ("place", "matching") for e in elements):
                    found += [(end, replace(c, bare=0.3)) for c in frame_command("put", (_objects(refs), *elements))]
        return found


def _counted_from(ref: Ref, key: str) -> Ref:
    return replace(ref, ranks=tuple(replace(rank, key=key) if not rank.key else rank for rank in ref.ranks))


def _objects(refs: tuple[Ref, ...]) -> Element:
    return Element("objects", refs)
