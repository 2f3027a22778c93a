"""A chart of one sentence by the rules of a language: the plainest ways to read it, each word accounted for by a rule."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from robosandbox.agent.language.forms import Filled, Misfit, formed
from robosandbox.agent.language.intent import Ref
from robosandbox.agent.language.ruleset import COSTS, Item, Rule, Ruleset, Way
from robosandbox.agent.language.vocabulary import EVERYTHING, Hit, Token

# Number of readings of one phrase over the same words that are followed, plainest first: eight lose what
# one of many skills with the same slots says without its verb, and cost as much.
MOST_READINGS = 14
# Number of times that what may be repeated is: more adjectives or items than anybody says.
MOST_REPEATED = 8
# Cost of parts in another order than a rule writes them.
OUT_OF_ORDER = COSTS[2]
# How much reading one sentence may take, a number of parts tried: some 40 ms.
MOST_STEPS = 40_000
# Number of words up to which a reading of a phrase counts as no more than one step.
_SHORT_PHRASE = 10


class TooComplicatedError(ValueError):
    """The sentence has more readings than anybody would follow."""


class Reading(NamedTuple):
    """One way to read a phrase: where it ends, what it costs, what it agrees with, and the fields that it fills."""

    end: int
    cost: float
    mask: int
    fields: tuple[Filled, ...]


Hits = Mapping[str, Sequence[Hit]]


class Parser:
    """Hits of a language's rules at each token of one sentence.

    Attributes:
        reach: How far the words go that some rule found a use for.
        genders: What each description agrees with, as a bit mask: in which gender and number a pronoun may stand for it.
    """

    def __init__(self, tokens: Sequence[Token], book: Ruleset, classes: Sequence[Hits]) -> None:
        """Begin with a sentence; `classes` has, for each token, the hits of each class that begin there."""
        self.tokens: Sequence[Token] = tokens
        self.book: Ruleset = book
        self.classes: Sequence[Hits] = classes
        self.count: int = len(tokens)
        self.reach: int = 0
        self._gendered = book.vocabulary.has_gender
        self.genders: dict[Ref, int] = {}
        bits, present = book.bits, book.bits["OVER"]
        self._starts: list[int] = []
        for token, hits in zip(tokens, classes, strict=True):
            starts = bits.get('"' + token.text, 0)
            for name in hits:
                starts |= bits.get(name, 0)
            self._starts.append(starts)
            present |= starts
        self._starts.append(bits["OVER"])
        self._absent = ~present
        self._steps = 0
        self._memo: dict[tuple[str, int], list[Reading]] = {}

    def readings(self, rule: str = "sentence") -> list[tuple[float, Any]]:
        """Return every reading of all the words as a phrase with a form, the plainest first.

        Raises:
            TooComplicatedError: There are more than anybody would follow.
        """
        found = [(r.cost, r.fields[0].value) for r in self.rule(rule, 0) if r.end == self.count]
        return sorted(found, key=lambda reading: reading[0])

    def said(self, i: int, j: int) -> str:
        """Return words as they were read."""
        return " ".join(token.raw for token in self.tokens[i:j])

    def rule(self, name: str, i: int) -> list[Reading]:
        """Return what a rule finds at a token; a phrase with a form fills one field, which has no name."""
        key = (name, i)
        found = self._memo.get(key)
        if found is None:
            rule = self.book.rules[name]
            read: list[Reading] = []
            for way in rule.ways:
                if not way.needs & self._absent and (way.empty or way.first & self._starts[i]):
                    read += self._way(way, i)
            if rule.form:
                read = [made for reading in read if (made := self._formed(rule, i, reading)) is not None]
            found = self._memo[key] = plainest(read)
            # What is nested deep is long to compare.
            self._spend(sum((reading.end - i) ** 2 for reading in found) // _SHORT_PHRASE**2)
        return found

    def _formed(self, rule: Rule, i: int, reading: Reading) -> Reading | None:
        end, cost, mask, fields = reading
        try:
            value, more = formed(rule.form, fields, self.said(i, end))
        except Misfit:
            return None
        if self._gendered and isinstance(value, Ref):
            self.genders[value] = self.genders.get(value, 0) | mask
        return Reading(end, cost + more, mask, (Filled("", value, False),))

    def _way(self, way: Way, i: int) -> list[Reading]:
        """Return every way to read a sequence of parts at a token."""
        states = [Reading(i, way.cost, EVERYTHING, tuple(Filled(*each) for each in way.fields))]
        for item in way.items:
            states = self._after(states, item)
            if not states:
                break
        return states

    def _after(self, states: list[Reading], item: Item) -> list[Reading]:
        """Return what some readings become with one part more."""
        self._spend(len(states))
        if item.no:
            return [state for state in states if not self._once(item, state.end)]
        agreeing = bool(item.agree) or not item.name
        made: list[Reading] = []
        for state in states:
            end, cost, mask, fields = state
            if item.repeat:
                made.append(state)
                if not item.first & self._starts[end]:
                    continue
                found = self._repeated(item, end)
            elif not item.empty and not item.first & self._starts[end]:
                continue
            else:
                found = self._once(item, end)
            for stop, more, own, filled in found:
                agreed = mask
                if agreeing:
                    agreed &= self.book.vocabulary.same_case(own) if item.agree == "&~" else own
                    if not agreed:
                        continue
                made.append(Reading(stop, cost + more, agreed, fields + filled if filled else fields))
        return made if len(made) < 2 * MOST_READINGS else plainest(made)

    def _spend(self, steps: int) -> None:
        self._steps += steps
        if self._steps > MOST_STEPS:
            raise TooComplicatedError

    def _repeated(self, item: Item, i: int) -> list[Reading]:
        """Return what a part that may stand several times finds, once at least."""
        if item.repeat == "?":
            return [reading for reading in self._once(item, i) if reading.end > i]
        made: list[Reading] = []
        latest = [Reading(i, 0.0, EVERYTHING, ())]
        for _ in range(MOST_REPEATED):
            later = [
                Reading(stop, cost + more, mask & own, (*fields, *filled))
                for end, cost, mask, fields in latest
                for stop, more, own, filled in (self._once(item, end) if item.first & self._starts[end] else ())
                if stop > end and (mask & own or not item.agree)
            ]
            if not later:
                break
            self._spend(len(later))
            latest = later if len(later) < 2 * MOST_READINGS else plainest(later)
            made += latest
        return made

    def _once(self, item: Item, i: int) -> list[Reading]:
        match item.kind:
            case "rule":
                return self._labelled(item, self.rule(item.name, i))
            case "class":
                hits = self.classes[i].get(item.name, ()) if i < self.count else ()
                found = [Reading(hit.end, 0.0, hit.mask, (Filled("", hit.value, False),)) for hit in hits]
                if found and not item.no:
                    self.reach = max(self.reach, *(hit.end for hit in hits))
                return self._labelled(item, found)
            case "word":
                if i >= self.count or self.tokens[i].text != item.name:
                    return []
                self.reach = max(self.reach, i + 1) if not item.no else self.reach
                return [Reading(i + 1, 0.0, EVERYTHING, ())]
            case "group":
                made: list[Reading] = []
                for way in item.ways:
                    if not way.needs & self._absent and (way.empty or way.first & self._starts[i]):
                        made += self._way(way, i)
                return made
            case "order":
                return self._in_any_order(item.ways[0], i)
            case _:
                return [Reading(i, 0.0, EVERYTHING, ())] if i == self.count else []

    def _labelled(self, item: Item, found: list[Reading]) -> list[Reading]:
        """Return readings under the label of the part; a form or a word that fills no field is dropped."""
        made: list[Reading] = []
        for end, cost, mask, fields in found:
            if item.only:
                mask &= item.only
                if not mask:
                    continue
            if item.label:
                fields = (Filled(item.label, fields[0].value, item.more),)
            elif fields and not fields[0].field:
                fields = ()
            made.append(Reading(end, cost, mask, fields))
        return made

    def _in_any_order(self, way: Way, i: int) -> list[Reading]:
        """Return every order of some parts; one that may be absent may be so in each."""
        made: list[Reading] = []
        states = [(tuple(way.items), Reading(i, way.cost, EVERYTHING, tuple(Filled(*f) for f in way.fields)))]
        while states:
            later: list[tuple[tuple[Item, ...], Reading]] = []
            for left, state in states:
                if all(item.empty for item in left):
                    made.append(state)
                skipped = False
                for k, item in enumerate(left):
                    if item.first & self._starts[state.end]:
                        extra = OUT_OF_ORDER if skipped else 0.0
                        rest = left[:k] + left[k + 1 :]
                        one = Reading(state.end, state.cost + extra, state.mask, state.fields)
                        later += [(rest, after) for after in self._after([one], item) if after.end > state.end]
                    skipped = skipped or not item.empty
            states = later
        return made


def plainest(read: list[Reading]) -> list[Reading]:
    """Return the plainest readings of each length, each meaning once."""
    if len(read) < 2:
        return read
    kept: list[Reading] = []
    count: dict[int, int] = {}
    seen: set[tuple[Any, ...]] = set()
    for reading in sorted(read, key=lambda r: r.cost):
        key = (reading.end, reading.mask, reading.fields)
        if key in seen or count.get(reading.end, 0) >= MOST_READINGS:
            continue
        seen.add(key)
        count[reading.end] = count.get(reading.end, 0) + 1
        kept.append(reading)
    return kept
