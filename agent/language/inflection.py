"""The words of a language from a lexicon file: stems, their endings, and what each form agrees with.

As in:

    agree nom acc dat gen x m f n p x w s     every combination is a way in which words agree, its first part the case
    inflect der: - = nom.m acc.m dat.m; s es = gen.m
    NOUN / NOUNS plural                       a class of words, and the one of what stands behind a slash
      cube = der Würfel / Würfel              a meaning, and the stems with the name of their endings
      the = den(acc.m dat.p)                  a form with what it agrees with; a bare one agrees with everything
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import product

from robosandbox.agent.language.lexicon import Phrases

EVERYTHING = -1
"""Agrees with whatever there is; a bit mask with every bit set."""
_FORM = re.compile(r"(?:(?P<table>\w+) )?(?P<stem>[^()]+?)(?:\((?P<mask>[^)]*)\))?")


class LexiconError(ValueError):
    """A line of a lexicon or rules file that is malformed; the message names file and line."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One word of a class: what it means, and what it agrees with as a bit mask."""

    value: str | float
    mask: int


@dataclass
class Lexicon:
    """What a lexicon file holds.

    Attributes:
        name: Of the language, for people.
        signs: Words that no other language has, by which this one is known.
        spelling: Letters and what stands for them on other keyboards.
        typed: What else is typed for them, where nothing else is called so.
        contractions: Words that are two.
        joins: Pairs of classes whose words are written as one word.
        says: English texts with slots {}, and the same in this language.
        phrases: Every form with its class and entry.
        classes: The forms of each class, by meaning, as written.
        words: Every single word.
    """

    name: str = ""
    signs: frozenset[str] = frozenset()
    spelling: dict[str, str] = field(default_factory=dict)
    typed: dict[str, str] = field(default_factory=dict)
    contractions: dict[str, tuple[str, ...]] = field(default_factory=dict)
    joins: list[tuple[str, str]] = field(default_factory=list)
    says: list[tuple[str, str]] = field(default_factory=list)
    phrases: Phrases = field(default_factory=Phrases)
    classes: dict[str, dict[str | float, list[str]]] = field(default_factory=dict)
    words: set[str] = field(default_factory=set)
    lines: int = 0
    _bits: dict[tuple[str, ...], int] = field(default_factory=dict)
    _tables: dict[str, list[tuple[str, int]]] = field(default_factory=dict)
    _forms: dict[str, set[str]] = field(default_factory=dict)

    def add_line(self, section: str, line: str) -> None:
        """Take in a line: an entry of a section, or a directive where there is no section.

        Raises:
            ValueError: It is malformed.
        """
        self.lines += 1
        if section:
            self._entry(tuple(section.replace("/", " ").split()), line)
        else:
            self._directive(line)

    def folded(self, text: str) -> str:
        """Return text in lower case with one spelling for letters that have two."""
        return _replaced(unicodedata.normalize("NFC", text).lower(), self.spelling)

    def mask(self, specification: str) -> int:
        """Return the ways of agreeing that a specification such as "acc.m dat.p" has in common with the lexicon's.

        Raises:
            LexiconError: None has such a part.
        """
        found = 0
        for pattern in specification.split():
            parts = set(pattern.split("."))
            bits = [bit for names, bit in self._bits.items() if parts <= {*names}]
            if not bits:
                raise LexiconError(f"{pattern!r} is no way to agree; there are {', '.join(sorted(self._parts()))}")
            found |= sum(bits)
        return found

    def same_case(self, mask: int) -> int:
        """Return a mask with every gender and number of the cases that it has."""
        if mask == EVERYTHING:
            return mask
        cases = {names[0] for names, bit in self._bits.items() if bit & mask}
        return sum(bit for names, bit in self._bits.items() if names[0] in cases)

    def any_case(self, mask: int) -> int:
        """Return a mask with every case of the genders and numbers that it has."""
        if mask == EVERYTHING:
            return mask
        others = {names[1:2] for names, bit in self._bits.items() if bit & mask}
        return sum(bit for names, bit in self._bits.items() if names[1:2] in others)

    def is_form(self, word: str, name: str) -> bool:
        """Say whether a folded word is a form of a class."""
        return word in self._forms.get(name, ())

    def split(self, word: str) -> tuple[str, ...]:
        """Return the words that a folded word is made of: itself if it is known, none if it cannot be split."""
        if word in self.contractions:
            return self.contractions[word]
        if word in self.words:
            return (word,)
        for k in range(2, len(word) - 1):
            first, second = word[:k], word[k:]
            if any(self.is_form(first, one) and self.is_form(second, other) for one, other in self.joins):
                return (first, second)
        return ()

    def _parts(self) -> set[str]:
        return {part for names in self._bits for part in names}

    def _directive(self, line: str) -> None:
        word, _, rest = line.partition(" ")
        match word:
            case "language":
                self.name = rest
            case "signs":
                self.signs |= frozenset(spelled(rest.split(), self.spelling))
            case "spelling":
                self.spelling.update(_pairs(rest))
            case "typed":
                self.typed.update(_pairs(rest))
            case "agree":
                for names in product(*(group.split() for group in rest.split(" x "))):
                    self._bits[names] = 1 << len(self._bits)
            case "inflect":
                name, _, endings = rest.partition(":")
                self._tables[name] = [
                    ("" if ending == "-" else ending, self.mask(mask))
                    for group in endings.split(";")
                    for forms, _, mask in [group.partition("=")]
                    for ending in forms.split()
                ]
            case "contract":
                self.contractions.update((self.folded(a), tuple(self.folded(b).split())) for a, b in _pairs(rest))
            case "join":
                first, second = rest.split()
                self.joins.append((first, second))
            case "say":
                english, _, own = rest.partition(" = ")
                self.says.append((english, own))
            case _:
                raise LexiconError(f"no line begins with {word!r}")

    def _entry(self, section: tuple[str, ...], line: str) -> None:
        meaning, _, forms = line.partition(" = ")
        value = _value(meaning)
        for form in forms.split(","):
            single, _, several = form.partition("/")
            self._add(section[0], value, single.strip(), "")
            if several:
                self._add(section[1], value, several.strip(), section[2])

    def _add(self, name: str, value: str | float, written: str, table: str) -> None:
        match = _FORM.fullmatch(written)
        if match is None:
            raise LexiconError(f"{written!r} is no form")
        stem = match["stem"]
        if match["table"] in self._tables:
            table = match["table"]
        elif match["table"]:
            stem = f"{match['table']} {stem}"
        if match["mask"] is not None:
            endings = [("", self.mask(match["mask"]))]
        else:
            endings = self._tables[table] if table else [("", EVERYTHING)]
        self.classes.setdefault(name, {}).setdefault(value, []).append(written)
        masks: dict[str, int] = {}
        for ending, mask in endings:
            written = stem + ending
            for form in dict.fromkeys((self.folded(written), self.folded(_replaced(written, self.typed)))):
                masks[form] = masks.get(form, 0) | mask
        for form, mask in masks.items():
            self.phrases.add(form, name, Entry(value, mask))
            self._forms.setdefault(name, set()).add(form)
            self.words.update(form.split())


DIRECTIVES = ("language", "signs", "spelling", "typed", "agree", "inflect", "contract", "join", "say")
"""What a line may begin with that stands in no section."""


def logical_lines(text: str) -> Iterable[tuple[int, str]]:
    """Return the lines of a text that are neither empty nor comments, with their numbers."""
    for number, line in enumerate(text.splitlines(), 1):
        bare = re.sub(r"(?:^|\s+)#.*", "", line).rstrip()
        if bare:
            yield number, bare


def spelled(words: Iterable[str], spelling: Mapping[str, str]) -> Iterable[str]:
    """Return each word, and each spelling that it may have instead."""
    for word in words:
        yield word
        yield _replaced(word, spelling)


def _replaced(text: str, letters: Mapping[str, str]) -> str:
    for letter, other in letters.items():
        text = text.replace(letter, other)
    return text


def _pairs(text: str) -> list[tuple[str, str]]:
    return [(a.strip(), b.strip()) for pair in text.split(",") for a, b in [pair.split("=")]]


def _value(text: str) -> str | float:
    try:
        number = float(text)
    except ValueError:
        return text
    return int(number) if number.is_integer() else number
