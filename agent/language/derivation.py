"""A chart of one sentence by the rules of a rulebook: every way to read it, each word accounted for by a rule."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from robosandbox.agent.language.binding import Fields, Filled, Misfit, formed
from robosandbox.agent.language.chart import Chart, TooComplicatedError
from robosandbox.agent.language.inflection import EVERYTHING, Entry
from robosandbox.agent.language.intent import Ref, Sentence
from robosandbox.agent.language.rulebook import Item, Rule, Rulebook
from robosandbox.agent.language.tokens import SceneWords, Token

# Number of times that what may be repeated is: more adjectives or items than anybody says. Chosen.
_MOST_REPEATED = 6
_ENDS = frozenset(".!?;")
# How much reading one sentence may take, a number of steps as of Chart. Chosen: three times what any of tests/prompts/german takes.
_MOST_STEPS = 4_000
# Number of ways to read what begins at one word that are followed. Chosen likewise.
_MOST_READINGS = 48
# Where a phrase ends, the fields that it fills, and what it agrees with.
Reading = tuple[int, Fields, int]


class Derivation(Chart):
    """What the rules of a language find at each token of one sentence.

    Attributes:
        reach: How far the words go that some rule found a use for.
        genders: What each description agrees with, as a bit mask: in which gender and number a pronoun may stand for it.
    """

    def __init__(self, tokens: Sequence[Token], words: SceneWords, book: Rulebook, *, lenient: bool = False) -> None:
        """Begin with a sentence; `lenient` lets a noun stand for every gender."""
        self.book = book
        self.lenient = lenient
        self.reach = 0
        self.genders: dict[Ref, int] = {}
        super().__init__(tokens, words, most_steps=_MOST_STEPS)

    def phrases(self, i: int) -> list[tuple[int, str, Any]]:
        """Return (end, class, entry) of every phrase of the language's lexicon that starts at token `i`."""
        return self.book.lexicon.phrases.at(self.tokens, i)

    def is_over(self, i: int) -> bool:
        """Say whether only marks follow."""
        return all(token.kind == "mark" for token in self.tokens[i:])

    def sentences(self) -> tuple[Sentence, ...]:
        """Return every reading of all the words.

        Raises:
            TooComplicatedError: There are more than anybody would follow.
        """
        found = [fields for end, fields, _ in self.rule("sentence", (), 0) if end == self.count]
        return tuple(dict.fromkeys(fields[0].value for fields in found))

    def rule(self, name: str, args: tuple[str, ...], i: int) -> list[Reading]:
        """Return what a rule finds at a token; a phrase with a form fills one field, which has no name."""
        key = (f"{name}({' '.join(args)})", i)
        found = self.memo.get(key)
        if found is None:
            # Left recursion finds nothing.
            self.memo[key] = []
            rule = self.book.rules[name]
            given = dict(zip(rule.takes, args, strict=True))
            read = (reading for way in rule.ways for reading in self._sequence(way, 0, i, EVERYTHING, given))
            found = list(dict.fromkeys(self._formed(rule, i, reading) for reading in read))
            found = self.memo[key] = [reading for reading in found if reading is not None]
            self.spend(len(found) + 1)
            if len(found) > _MOST_READINGS:
                raise TooComplicatedError
        return found

    def _formed(self, rule: Rule, i: int, reading: Reading) -> Reading | None:
        end, fields, mask = reading
        if not rule.form:
            return reading
        try:
            value = formed(rule.form, fields, self.said(i, end))
        except Misfit:
            return None
        if isinstance(value, Ref) and not self.lenient:
            self.genders[value] = self.genders.get(value, 0) | mask
        return end, (Filled("", value, False),), mask

    def _sequence(self, items: tuple[Item, ...], k: int, i: int, mask: int, given: dict[str, str]) -> Iterator[Reading]:
        """Yield every way to read the items from the k-th on at token `i`."""
        if k == len(items):
            yield i, (), mask
            return
        item = items[k]
        for end, fields, own in self._repeated(item, i, given):
            agreed = mask & self._agreement(item, own)
            if not agreed:
                continue
            for stop, rest, last in self._sequence(items, k + 1, end, agreed, given):
                yield stop, (*fields, *rest), last

    def _agreement(self, item: Item, own: int) -> int:
        if not item.agree and not item.group:
            return EVERYTHING
        return self.book.lexicon.same_case(own) if item.agree == "&~" else own

    def _repeated(self, item: Item, i: int, given: dict[str, str]) -> Iterator[Reading]:
        if item.repeat:
            yield i, (), EVERYTHING
        readings: list[Reading] = [(i, (), EVERYTHING)]
        for _ in range(_MOST_REPEATED if item.repeat == "*" else 1):
            readings = [
                (stop, (*fields, *more), agreed)
                for end, fields, mask in readings
                for stop, more, own in self._once(item, end, given)
                for agreed in [mask & own]
                if agreed and (stop > end or not item.repeat)
            ]
            yield from readings

    def _once(self, item: Item, i: int, given: dict[str, str]) -> Iterator[Reading]:
        if item.group:
            for way in item.group:
                yield from self._sequence(way, 0, i, EVERYTHING, given)
        elif item.value is not None:
            yield i, (_filled(item.label, item.value),), EVERYTHING
        elif item.word:
            if self.text(i) == item.word:
                self.reach = max(self.reach, i + 1)
                yield i + 1, (), EVERYTHING
        else:
            yield from self._phrase(item, i, given)

    def _phrase(self, item: Item, i: int, given: dict[str, str]) -> Iterator[Reading]:
        ref = given.get(item.ref, item.ref)
        args = tuple(given.get(arg, arg) for arg in item.args)
        found = self.rule(ref, args, i) if ref in self.book.rules else self._class(ref, i)
        for end, fields, mask in found:
            own = mask & item.only if item.only else mask
            if not own:
                continue
            if item.label:
                fields = (_filled(item.label, fields[0].value),)
            elif fields and not fields[0].field:
                # A form or a word that fills no field.
                fields = ()
            yield end, fields, own

    def _class(self, name: str, i: int) -> Iterator[Reading]:
        for end, entry in self._entries(name, i):
            self.reach = max(self.reach, end)
            yield end, (Filled("", entry.value, False),), entry.mask

    def _entries(self, name: str, i: int) -> Iterator[tuple[int, Entry]]:
        if i >= self.count:
            return
        token = self.tokens[i]
        match name:
            case "ID" if token.kind == "id":
                yield i + 1, Entry(token.text, EVERYTHING)
            case "MARK" if token.kind == "mark" and token.text in {*_ENDS, ",", ":"}:
                yield i + 1, Entry(token.text, EVERYTHING)
            case "END" if token.kind == "mark" and token.text in _ENDS:
                yield i + 1, Entry(token.text, EVERYTHING)
            case "NAME" if token.kind == "word" and token.text in self.words.parts:
                yield i + 1, Entry(token.text, EVERYTHING)
            case "UNKNOWN" if self._is_strange(token):
                yield i + 1, Entry(token.text, EVERYTHING)
            case "NUMBER" if token.kind == "number":
                yield i + 1, Entry(token.number, EVERYTHING)
        for end, entry in self.tag(i, name):
            any_gender = self.lenient and name == "NOUN"
            yield end, Entry(entry.value, self.book.lexicon.same_case(entry.mask)) if any_gender else entry

    def _is_strange(self, token: Token) -> bool:
        """Say whether a word may be a noun that nobody knows: it stands for nothing here, which grounding tells."""
        known = token.text in self.book.lexicon.words or token.text in self.words.parts
        return token.kind == "word" and token.raw[:1].isupper() and not known


def _filled(label: str, value: Any) -> Filled:
    return Filled(label.removesuffix("+"), value, label.endswith("+"))
