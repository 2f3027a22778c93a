"""A chart of one sentence: every phrase that starts at each word, and what the grammar's rules found there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import wraps
from typing import Any, TypeVar

from robosandbox.agent.language.lexicon import LEXICON
from robosandbox.agent.language.strain import Known, strain
from robosandbox.agent.language.tokens import SceneWords, Token

T = TypeVar("T")
Found = list[tuple[int, T]]
# Number of steps of reading one sentence. Chosen so that no sentence takes over 40 ms (docs/measured.md).
MAX_STEPS = 9_000
MAX_READINGS = 12  # Number of readings of one span that are kept. Chosen.


class TooComplicatedError(ValueError):
    """The sentence has more readings than anybody would follow."""


C = TypeVar("C", bound="Chart")


def rule(function: Callable[[C, int], Found[T]]) -> Callable[[C, int], Found[T]]:
    """Remember what a grammar rule found at each position (a packrat parser that keeps every reading)."""
    name = function.__name__

    @wraps(function)
    def remembered(self: C, i: int) -> Found[T]:
        key = (name, i)
        found: Found[T] | None = self.memo.get(key)
        if found is None:
            self.memo[key] = []  # Left recursion finds nothing.
            found = function(self, i)
            # As `spend` does, without a call: there is no hotter line.
            self.steps += len(found)
            if self.steps > self.most_steps:
                raise TooComplicatedError
            if len(found) > MAX_READINGS:
                found = self.capped(found)
            self.memo[key] = found
        return found

    return remembered


class _Texts(dict[int, str]):
    """The texts of tokens by position, also from the end; "" elsewhere. It is asked so often that a method would be slow."""

    def __init__(self, texts: Sequence[str]) -> None:
        super().__init__(enumerate(texts))
        self.update(zip(range(-len(texts), 0), texts, strict=True))

    def __missing__(self, i: int) -> str:
        return ""


@dataclass
class Chart:
    """What the phrases of the lexicon and the rules of a grammar find at each token of one sentence.

    Attributes:
        tokens: The sentence.
        words: The words of the scene's ids.
        memo: Results by rule and position.
        steps: Work done so far: look-ups, and readings found.
        most_steps: How much of it a sentence gets.
    """

    tokens: Sequence[Token]
    words: SceneWords
    memo: dict[tuple[str, int], list[Any]] = field(default_factory=dict)
    steps: int = 0
    most_steps: int = MAX_STEPS

    def __post_init__(self) -> None:
        self.count: int = len(self.tokens)
        self.id_words: dict[int, str] = {}
        self.texts: list[str] = [token.text for token in self.tokens]
        self.text: Callable[[int], str] = _Texts(self.texts).__getitem__
        """Return a token's text, "" past the end; the last one's for -1."""
        self.raws: list[str] = [token.raw for token in self.tokens]
        self.strains: Known = {}
        self.tags: list[dict[str, list[tuple[int, Any]]]] = []
        for i in range(len(self.tokens)):
            tags: dict[str, list[tuple[int, Any]]] = {}
            for end, tag, value in self.phrases(i):
                tags.setdefault(tag, []).append((end, value))
            for found in tags.values():
                if len(found) > 1:
                    found.sort(key=lambda item: -item[0])
            self.tags.append(tags)
        self.present: frozenset[str] = frozenset(tag for tags in self.tags for tag in tags)

    def phrases(self, i: int) -> list[tuple[int, str, Any]]:
        """Return (end, tag, value) of every phrase of the lexicon that starts at token `i`."""
        return LEXICON.at(self.tokens, i)

    def tag(self, i: int, name: str) -> list[tuple[int, Any]]:
        """Return (end, value) of every phrase with this tag at `i`, longest first."""
        self.steps += 1
        return self.tags[i].get(name) or [] if i < self.count else []

    def spend(self, steps: int) -> None:
        """Count work; a sentence gets a bounded amount of it."""
        self.steps += steps
        if self.steps > self.most_steps:
            raise TooComplicatedError

    def said(self, i: int, j: int) -> str:
        """Return the words from `i` to `j` as said."""
        return " ".join(self.raws[i:j])

    def optional(self, i: int, *names: str) -> list[int]:
        """Return where phrases of these tags end, and `i` itself last."""
        self.steps += len(names)
        tags = self.tags[i] if i < self.count else {}
        return [*[end for name in names if name in tags for end, _ in tags[name]], i]

    def capped(self, found: Found[T]) -> Found[T]:
        """Keep the first and the plainest readings of each length."""
        if len(found) <= MAX_READINGS:
            return found
        by_end: dict[int, Found[T]] = {}
        found = distinct(found)
        for reading in found:
            by_end.setdefault(reading[0], []).append(reading)
        if all(len(readings) <= MAX_READINGS for readings in by_end.values()):
            return found
        kept = {id(reading) for readings in by_end.values() for reading in self.plainest(readings, MAX_READINGS)}
        return [reading for reading in found if id(reading) in kept]

    def plainest(self, found: Found[T], count: int) -> Found[T]:
        """Keep `count` readings, in their order: half of them the first, half the least far-fetched of the others."""
        if len(found) <= count:
            return found
        first = count // 2
        strains = [strain(value, self.strains) for _, value in found[first:]]
        limit = sorted(strains)[count - first - 1]
        plain = [reading for reading, strained in zip(found[first:], strains, strict=True) if strained <= limit]
        return [*found[:first], *plain[: count - first]]


def distinct(found: Found[T]) -> Found[T]:
    """Drop repeated readings."""
    if len(found) < 2:
        return found
    return list(dict.fromkeys(found))
