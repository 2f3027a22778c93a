"""Whole sentences: clauses in an order, prohibitions, and every reading of them."""

from __future__ import annotations

from functools import cached_property

from robosandbox.agent.language.amendments import without
from robosandbox.agent.language.anaphora import in_it, inside_it, named_first, still_about
from robosandbox.agent.language.branching import Branching
from robosandbox.agent.language.chart import MAX_READINGS, MAX_STEPS, Found, rule
from robosandbox.agent.language.frames import frame_command
from robosandbox.agent.language.intent import IT, Command, Ref, Relation, Sentence, replace
from robosandbox.agent.language.logic import ForEach
from robosandbox.agent.language.readings import Part, sentence_of
from robosandbox.agent.language.strain import parties, strain
from robosandbox.agent.language.things import ORDINALS
from robosandbox.agent.language.turns import taking_turns
from robosandbox.agent.language.verbs import BASE_FORMS
from robosandbox.agent.language.wishes import spoken

MAX_SENTENCES = 8  # Number of readings of a sentence that are tried on the scene. Chosen.


_THAT = frozenset({"this", "that"})
"""After which a thing without a verb is a step: "and after this the cube into the bowl"."""
_FINISHING = frozenset({"finish", "end", "conclude"})
_NEXT = frozenset({"then", "next", "that", "afterwards", "finally", "lastly"})
_BEFOREHAND = frozenset({"first", "beforehand", "before that", "before this"})
_ONCE = frozenset({"once", "after", "soon", "until", "till"})
_STAYS = frozenset({"stay", "stays", "remain", "remains"})


class Grammar(Branching):
    """The rules for sentences."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.texts[:1] == ["later"]:
            # With nothing to do before it, "later, tap the can" puts it off.
            self.tags[0].pop("THEN", None)
        for i, tags in enumerate(self.tags[:-1]):
            if self.texts[i] in ORDINALS and "SUPER" in self.tags[i + 1]:
                # "..., second biggest in the bowl" counts, and opens no new step.
                for tag in ("THEN", "FIRST"):
                    tags[tag] = [hit for hit in tags.get(tag, []) if hit[0] > i + 1]

    def sentences(self, most_steps: int = MAX_STEPS) -> tuple[tuple[float, Sentence], ...]:
        """Return the readings of the sentence and how far-fetched each is, the plainest first; none if a part of it is not understood.

        Args:
            most_steps: How much further work it may be.

        Raises:
            TooComplicatedError: It has more readings than are worth following.
        """
        self.steps, self.most_steps = 0, most_steps
        found: dict[Sentence, None] = {}
        for end, parts in self._parts(0):
            if end == self.count:
                sentence = sentence_of(parts)
                if sentence:
                    found[sentence] = None
        ranked = sorted(((strain(sentence, self.strains), sentence) for sentence in found), key=lambda item: item[0])
        return tuple(ranked[:MAX_SENTENCES])

    @rule
    def _parts(self, i: int) -> Found[tuple[Part, ...]]:
        """Everything from `i` to the end, as parts in the order in which they are done."""
        found: Found[tuple[Part, ...]] = []
        n = len(self.tokens)
        follows = i > 0
        i = self._skip(i)
        if i >= n:
            return [(n, ())]
        found += self._under_conditions(i)
        for j, part in self.part(i):
            # "... and go home afterwards" says what the order of the words says already; alone it would be a condition.
            ends = [m for m, _ in self.tag(j, "LATER")] if follows else []
            if any(self._skip(m) >= n for m in (*ends, j)):
                found.append((n, part))
                continue
            if self._told_to_finish(i) and not follows:
                # "finish by tapping the can, but start with the ball": what is told first comes last.
                found += [
                    (end, (*part, *rest) if self._goes_on_after(j, k, start) else (*before, *part))
                    for k in self._joints(j)
                    for start in dict.fromkeys((k, *(m for tag in ("FIRST", "FIRST_BUT") for m, _ in self.tag(k, tag))))
                    for end, rest in self._parts(start)
                    for before in [in_it(rest, part, alone=True) if rest else ()]
                    if before and not (rest[1:] and self.text(j) == "and" and self.text(start).endswith("ing"))
                ]
                continue
            found += self._in_turns(part, j) if self.tells_turns else []
            for k in self._joints(j):
                set_apart = self.text(k - 1) == "but"
                # "before you go home, put the can in the bin and close it": home comes last.
                final = part[-1:] if part[1:] and self._goes_before(i, j, k) else ()
                done = part[:-1] if final else part
                for end, rest in self._parts(k):
                    if rest and not (self.texts[j:k] == ["and"] and _one_list(part[-1], rest[0])):
                        rather = self.in_its_place(done, rest, k) if self.depends else ()
                        rather = rather or (*(without(done, rest[0]) if set_apart else done), *rest)
                        found.append((end, (*rather, *final)))
            after = j + 3 if self.said(j, j + 3) in ("at the end", "in the end") else j
            late = [k for k, _ in self.tag(self._skip(after), "FIRST_BUT")]
            if any(self.text(m) == "first" for m in (self._skip(j), self._skip(j) + 1)):
                late += [k for m in (self._skip(j), self._skip(j) + 1) for k, _ in self.tag(m, "FIRST")]
            late = [k for k in late if self.text(k) not in (".", "!", ";", "and", "then")]
            # "..., but open it first, then close it": what follows comes last.
            late = [k for k in late if self.text(k) != "," or self.text(k + 1) not in ("and", "then")]
            anew = self._first_anew(j) if "FIRST" in self.present else 0
            found += self._told_anew(i, part, anew) if anew else []
            for k in self._corrected(j) if not anew else ():
                # "pick up the can, no, push it": what was said before does not count; "wait, push it first" adds to it.
                if "first" in self.texts[k : next((m for m in range(k, n) if self.tokens[m].kind == "mark"), n)]:
                    continue
                if self.text(k) == "right" and self.text(k + 1) in (",", "and", "then"):
                    # "to the left of it, no, right, and the can ..." agrees to nothing.
                    continue
                for end, rest in self._parts(k):
                    first = rest[0] if rest else None
                    last = part[-1]
                    if isinstance(first, Command) and isinstance(last, Command):
                        if not self.tag(k, "VERB") and _takes_more(first, last):
                            continue
                        if first.objects and first.objects[0].determiner == "it":
                            first = replace(first, objects=(*last.objects, *first.objects[1:]))
                        there = last.place.refs if isinstance(last.place, Relation) else ()
                        if isinstance(first.place, Relation) and first.place.refs == (IT,) and there:
                            # "..., I mean the banana next to it"
                            first = replace(first, place=replace(first.place, refs=there))
                        if replace(first, bare=last.bare) == last and "wait" in self.texts[j:k]:
                            # "tap the bell, wait a second, tap it again"
                            first, rest = last, rest if last.bare else (last, *rest)
                        found.append((end, (*part[:-1], first, *rest[1:])))
            for k in self._corrected(j) if not anew else ():
                # "put it in the bowl - no, in the tray", "push it left, I mean right": the verb stays.
                found += self._corrected_place(part, k)
            for k in self._joints(j):
                # "anywhere but the bin" is no second command.
                found += self._gapped(part, k) if self.text(k - 1) != "but" else []
            for k in dict.fromkeys(late):
                for end, rest in self._parts(k):
                    if rest:
                        # "tap the can, but first tap the cup, then go home": home comes last.
                        final = rest[-1:] if rest[1:] and _goes_home(rest[-1]) else ()
                        before = rest[: len(rest) - len(final)]
                        before = in_it(before, part, alone=not follows)
                        found += [(end, (*before, *part, *final))] if before else []
            for k in self._joints(j):
                # "put the can on the block, but tap the block first"
                for m, second in self.part(k) if self.text(k - 1) in ("but", ",", ";", ".", "and") else []:
                    asked = isinstance(second[0], Command) and not second[0].bare
                    late_word = next((q for q in range(m + 1, m + 3) if self.said(m, q) in _BEFOREHAND), 0)
                    if not asked or not late_word:
                        continue
                    first_done = in_it(second, part, alone=not follows)
                    if not first_done:
                        continue
                    before = (*first_done, *part)
                    if self._skip(late_word) >= n:
                        found.append((n, before))
                    for q in self._joints(late_word):
                        found += [(end, (*before, *rest)) for end, rest in self._parts(q) if rest]
        return self.plainest(found, MAX_READINGS)

    def _under_conditions(self, i: int) -> Found[tuple[Part, ...]]:
        """What depends on something, and what follows it: apart from it, or after "then"."""
        found: Found[tuple[Part, ...]] = []
        for end, command in self.control(i):
            if self._skip(end) >= self.count:
                found.append((self.count, (command,)))
            for k in self._joints(end):
                between = {*self.texts[end:k]}
                if self._alternative(k) or not ("then" in between or between & {".", ";", "!"}):
                    continue
                each = isinstance(command.control, ForEach)
                found += [
                    (m, (command, *still_about(command, rest)))
                    for m, rest in self._parts(k)
                    if rest and not _same_again(rest) and not (each and _of_it(rest[0]))
                ]
        return found

    def _told_to_finish(self, i: int) -> bool:
        return self.text(i) in _FINISHING and self.text(i + 1) in ("by", "with", "off", "up")

    def _goes_on_after(self, j: int, k: int, start: int) -> bool:
        """As in "finish by tapping the can, then go home", "finish by tapping the can and closing the drawer"."""
        also = self.text(j) == "and" and self.text(start).endswith("ing")
        return also or bool({self.text(k - 1), self.text(k)} & _NEXT)

    def _first_anew(self, j: int) -> int:
        """Return where what comes first is told after a correction at `j`: "..., wait, no, first tap the ball"; 0 if it is not."""
        for k in self._corrected(j):
            start = self._skip(k)
            for _ in range(3):
                start = next((self._skip(m) for m, _ in self.tag(start, "CORRECTION")), start)
            ends = [m for m, _ in self.tag(start, "FIRST")]
            if ends:
                return self._skip(ends[-1])
        return 0

    def _told_anew(self, i: int, part: tuple[Part, ...], k: int) -> Found[tuple[Part, ...]]:
        """As in "first tap the can, no, first tap the ball and then the can"; "tap the can, wait, first tap the ball".

        What is told again is done when the better words say; what is not told again may be taken back or only put off
        where it was to come first, or where more steps are told.
        """
        old = part[-1]
        found: Found[tuple[Part, ...]] = []
        if not isinstance(old, Command):
            return found
        for end, rest in self._parts(k):
            again = any(isinstance(c, Command) and replace(c, bare=old.bare) == old for c in rest)
            alone = i == 0 and len(part) == len(rest) == 1 and not self.tag(self._skip(i), "FIRST")
            if again and len(part) == 1:
                found.append((end, rest))
            elif alone and not again and isinstance(rest[0], Command) and len(rest[0].objects) < 2:
                found.append((end, (*in_it(rest, part, alone=True), *part)))
        return found

    def _in_turns(self, part: tuple[Part, ...], j: int) -> Found[tuple[Part, ...]]:
        """As in "put the cubes in the box. Start with the red one", "...; the blue one goes in last"."""
        found: Found[tuple[Part, ...]] = []
        last = [c for c in part[-1:] if isinstance(c, Command) and c.verb != "stack"]
        several = [replace(c, order=None) for c in taking_turns(last, ())]
        for k in dict.fromkeys((j, *self._joints(j))) if several else ():
            for end, turns in self.turns(k):
                told = (*part[:-1], *(replace(c, bare=c.bare - 0.6) for c in taking_turns(several, turns)))
                if self._skip(end) >= self.count:
                    found.append((self.count, told))
                found += [(m, (*told, *rest)) for q in self._joints(end) for m, rest in self._parts(q) if rest]
        return found

    def _goes_before(self, i: int, j: int, k: int) -> bool:
        """Say whether what is joined at `j` to a clause that "before" opens is to be done before, too."""
        opened = any(self.tag(start, "BEFORE") for start in {i, *(end for end, _ in self.tag(i, "THEN"))})
        return opened and self.texts[j:k] in (["and"], [","], [",", "and"])

    @rule
    def part(self, i: int) -> Found[tuple[Part, ...]]:
        """One clause, a prohibition, or two clauses that "before" or "after" joins."""
        found: Found[tuple[Part, ...]] = []
        # "... but first tap the can" is no step in the order of words; `_parts` knows it.
        opening = i == 0 or self.text(i - 1) in (".", ";", "!", ":", "?", ",")
        for start in self.optional(i, *(("FIRST", "THEN") if opening else ("THEN",))):
            start = self._skip(start) if start > i else start
            found += self._two_verbs(start)
            for j, command in self.clause(start):
                if len(command.objects) > 1 and command.bare and self._one_by_one(start, j):
                    command = replace(command, bare=command.bare + 1.6)
                found.append((j, (command,)))
                if (
                    self.text(j) in ("first", "beforehand")
                    and i == 0
                    and _plainly_done(command)
                    and not self._set_apart(i, j)
                ):
                    # "tap the can first, then go home"
                    found.append((j + 1, (command,)))
                comma = self._skip(j)
                for tag in ("BEFORE", "AFTER") if self._tells_when else ():
                    hits = [k for k, _ in self.tag(comma, tag)]
                    apart = [k for k in hits if self._afterwards(j, k)] if tag == "AFTER" else []
                    second_at = [
                        (end, inside_it(second, command))
                        for k in hits
                        if k not in apart or self.text(k - 1) == "you"
                        for end, second in self.clause(k)
                        if not (second.bare and self.text(k) in _THAT)
                    ]
                    second_at += [hit for k in hits if k not in apart for hit in self._likewise(command, k, tag)]
                    second_at += [hit for k in hits if tag == "BEFORE" for hit in self._to_be_done(k)]
                    # "..., but only once the apple is in the bowl", "..., but not before the apple is in the bowl"
                    joint = comma + (self.text(comma) == "but")
                    done = [(end, inside_it(second, command)) for end, second in self._accomplished(joint)]
                    for end, second in second_at + (done if tag == "AFTER" else []):
                        found.append((end, (command, second) if tag == "BEFORE" else (second, command)))
                    found += [(end, (command, second)) for k in apart for end, second in self.clause(k)]
            for tag in ("BEFORE", "AFTER") if self._tells_when else ():
                hits = [k for k, _ in self.tag(start, tag)]
                second_at = [hit for k in hits for hit in self.clause(k)]
                second_at += [hit for k in hits if tag == "BEFORE" for hit in self._to_be_done(k)]
                for j, second in second_at + (self._accomplished(start) if tag == "AFTER" else []):
                    for m in (self._skip(j), *(e for e, _ in self.tag(self._skip(j), "THEN"))):
                        for first_start in self.optional(m, "FIRST"):
                            for end, first in self.clause(first_start):
                                found.append((end, named_first(first, second) if tag == "BEFORE" else (second, first)))
        found += [(j, (refs,)) for j, refs in self._prohibition(i)]
        found += [(j, (command,)) for j, command in self._left_as_it_is(i)]
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
                for k, verb in self.tag(j, "VERB") if self.text(j) in BASE_FORMS else []:
                    if verb in ("put", "move", "throw", "discard"):
                        # "do not ship the box": wherever to.
                        found += [(end, (Command("nothing", refs, negated="put"),)) for end, refs in self.np_list(k)]
                for end, command in self.clause(j):
                    # "do not touch it" forbids whatever would move it, "do not tap it" to tap it.
                    tapped = self.text(j).startswith("tap")
                    if (command.verb != "tap" or tapped) and not command.bare:
                        # "without letting go" forbids what "careful not to drop it" asks to do well.
                        dropped = command.verb == "release" and self.text(j).startswith("drop")
                        negated_verb = "drop" if dropped else command.skill or command.verb
                        found.append((end, (replace(command, verb="nothing", negated=negated_verb),)))
        return list(dict.fromkeys(found))

    def _one_by_one(self, i: int, j: int) -> bool:
        """As in "..., then the pear, and finally the plum in the bowl": a step each."""
        return self.text(i - 1) == "then" and not {"then", "finally", "lastly", "afterwards"}.isdisjoint(
            self.texts[i:j]
        )

    @cached_property
    def _tells_when(self) -> bool:
        """Whether a word may tell that one thing is done before or after another: "before", "after", "once", "as soon as"."""
        return self._tells_before or not _ONCE.isdisjoint(self.texts)

    def _likewise(self, command: Command, k: int, tag: str) -> Found[Command]:
        """As in "put the stone in the tub after the bulb": the same is done with the bulb."""
        place = command.place
        # "put the can in the bin before the cup" may say where it goes.
        likely = ("put", "pour") if tag == "AFTER" else ("pour",)
        told = isinstance(place, Relation) and place.kind in ("in", "on") and place.refs not in ((), (IT,))
        if tag == "BEFORE" and self.text(k) in ("that", "this"):
            # "tap the can, but before that the cup": the cup comes first.
            return []
        if not (command.verb == "tap" or (command.verb in likely and told)) or command.order or command.tower:
            return []
        return [
            (j, replace(command, objects=refs, bare=command.bare + 0.3))
            for j, refs in self.np_list(k)
            if not any(ref.unknown or ref.determiner == "it" for ref in refs)
            # "tap the can after all" is no order.
            and refs[0].text not in ("all", "all of them", "everything")
        ]

    def _set_apart(self, i: int, j: int) -> bool:
        """Say whether a thing stands alone before `j`: "tap the can and the jar, the jar first" is about the order of both."""
        comma = max((k for k in range(i, j) if self.text(k) == ","), default=-1)
        return comma > i and any(end == j for end, _ in self.np(comma + 1))

    def _afterwards(self, j: int, k: int) -> bool:
        """Say whether the "after" that leads to `k` may mean afterwards, as those say it who have English from a school.

        As in "put it in the drawer, and after close it", "..., and after you must close it"; a comma alone and "after you"
        may mean either.
        """
        start = self._skip(j)
        if self.text(start) == "and":
            return self.text(start + 1) == "after" and not self.text(k).endswith("ing") and self.text(k - 1) != "have"
        if self.text(start) != "after" or start == j:
            return False
        asked = self.text(k) in BASE_FORMS and "VERB" in self.tags[k]
        must = self.text(k - 1) == "after" and self.text(k) == "you"
        return (asked or must) and self.text(k - 1) in ("after", "you")

    def _two_verbs(self, i: int) -> Found[tuple[Part, ...]]:
        """As in "open and then close the drawer"."""
        found: Found[tuple[Part, ...]] = []
        for start in self._preambles(i, 0):
            for j, verb in self.tag(start, "VERB"):
                for k, _ in self.tag(j, "THEN"):
                    for end, second in self._verb_first(k):
                        if len(second.objects) == 1 and second.objects[0].determiner != "it":
                            found += [
                                (end, (first, replace(second, objects=(IT,), times=1)) * second.times)
                                for first in frame_command(verb, (spoken(second.objects),))
                            ]
        return found

    def _left_as_it_is(self, i: int) -> Found[Command]:
        """As in "... but leave the drawer open": it is not to be closed."""
        found: Found[Command] = []
        for j, _ in self.tag(i, "AVOID"):
            for k, refs in self.np_list(j) if self.text(j - 1) in ("leave", "keep") else []:
                closing = {"open": "close", "closed": "open", "shut": "open"}.get(self.text(k))
                command = Command("nothing", refs, negated=closing or "")
                found += [(end, command) for end in self.optional(k + 1, "LATER", "AVOID_TAIL")] if closing else []
        return found

    def _prohibition(self, i: int) -> Found[tuple[Ref, ...]]:
        found: Found[tuple[Ref, ...]] = []
        for j, refs in self.np_list(i):
            # "the batteries stay where they are"
            k = j + 1 if self.text(j) in ("should", "must", "shall", "can", "will", "to") else j
            # "the dice, and the car stays out of it": one thing stays.
            if self.text(k) in _STAYS and not (self.text(k).endswith("s") and k == j and len(refs) > 1):
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


def _same_again(rest: tuple[Part, ...]) -> bool:
    """As in "... and do the same with the can": the same as what?"""
    return isinstance(rest[0], Command) and rest[0].negated == "same"


def _of_it(part: Part) -> bool:
    """Say whether a part is about what was spoken of before it."""
    return isinstance(part, Command) and bool(part.objects) and part.objects[0].determiner == "it"


def _one_list(one: Part, other: Part) -> bool:
    """As in "stack the can and the cup next to the bowl", "tap the can and the cup in the bin": the cup is of the list.

    What goes somewhere with no verb of its own borrows none from what goes nowhere.
    """
    if not (isinstance(one, Command) and isinstance(other, Command)) or one.bare or one.place or one.tower:
        return False
    return one.verb in ("tap", "stack", "pick") and other.verb == "put" and other.bare == 0.3


def _goes_home(part: Part) -> bool:
    return isinstance(part, Command) and part.verb == "home"


def _takes_more(anew: Command, last: Command) -> bool:
    """Say whether a correction without a verb would carry more than it corrects elsewhere.

    As in "the hammer in the toolbox, no, the brick, and the sponge in the crate": the brick alone is the better word.
    """
    if not anew.bare and anew.verb != last.verb:
        return False
    # "in the red bin, no, ..." asks nobody to bin anything.
    return anew.verb != last.verb or (bool(anew.place and last.place) and len(anew.objects) > len(last.objects))


def _plainly_done(command: Command) -> bool:
    """Say whether a command names all it is about: "..., the green one first" tells of an order."""
    named = all(
        (ref.nouns or ref.names or ref.determiner == "it") and not (ref.without or ref.instead)
        for ref in parties(command)
    )
    return named and not command.bare
