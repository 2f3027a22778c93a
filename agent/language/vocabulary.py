r"""The words of a language from a lexicon file: classes of forms, what each form means and what it agrees with.

As in:

    agree nom acc dat gen x m f n p x w s     every combination is a way in which words agree, its first part the case
    inflect der: - = nom.m acc.m; s es = gen.m   endings and what forms with them agree with
    inflect verb first: - = base; ed = past   the first word of a phrase takes the ending: "picked up"
    fuse ([^aeiou])y\+ed = \1ied              how an ending, behind its "+", is spelled where a stem ends so
    contract zum=zu dem, gonna=going to       words that are several
    write can't = can not                     a pattern of written text, and what it stands for
    asks where how                            words that questions begin with; a sentence without any is none
    list bearing: not only again              words that the reading of chat looks at, by what for
    NOUN / NOUNS plural                       a class, the one of what stands behind a slash, and the endings of each
      cube = der Würfel / Würfel              a meaning, and its forms, each with a table of endings before it
      ball, can, die(sg), dice(pl)            forms that mean themselves; brackets say what a form agrees with
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, NamedTuple

EVERYTHING = -1
"""Agrees with whatever there is; a bit mask with every bit set."""
_FORM = re.compile(r"(?:(?P<table>\w+) )?(?P<stem>[^()]+?)(?:\((?P<mask>[^)]*)\))?")
DIRECTIVES = (
    "language",
    "signs",
    "asks",
    "spelling",
    "typed",
    "agree",
    "inflect",
    "fuse",
    "contract",
    "join",
    "write",
    "list",
    "nouns",
    "say",
)
"""What a line may begin with that stands in no class."""


class LexiconError(ValueError):
    """A line of a lexicon or rules file that is malformed; the message names file and line."""


class Token(NamedTuple):
    """One word, number, id or mark.

    Attributes:
        text: In its normal form.
        raw: As written.
        kind: word, number, id or mark.
    """

    text: str
    raw: str
    kind: str


class Hit(NamedTuple):
    """A phrase of a class that was found in a sentence: where it ends, what it means, what it agrees with."""

    end: int
    value: Any
    mask: int


class _Table(NamedTuple):
    endings: list[tuple[str, int]]
    first: bool


@dataclass(eq=False)
class Vocabulary:
    """What a lexicon file holds.

    Attributes:
        name: Of the language, for people.
        signs: Words that no other language has, by which this one is known.
        spelling: Letters and what stands for them on other keyboards.
        typed: What else is typed for them, where nothing else is called so.
        contractions: Words that are several.
        joins: Pairs of classes whose words are written as one word.
        writes: Patterns of written text, and what they stand for.
        says: English texts with slots {}, and the same in this language.
        lists: Words by what they are looked at for.
        classes: The forms of each class, by meaning, as written.
        words: Every single word.
        bits: The ways to agree, by their parts.
        capital: Nouns are written with a capital.
    """

    name: str = ""
    signs: frozenset[str] = frozenset()
    spelling: dict[str, str] = field(default_factory=dict)
    typed: dict[str, str] = field(default_factory=dict)
    contractions: dict[str, tuple[str, ...]] = field(default_factory=dict)
    joins: list[tuple[str, str]] = field(default_factory=list)
    writes: list[tuple[re.Pattern[str], str]] = field(default_factory=list)
    says: list[tuple[str, str]] = field(default_factory=list)
    lists: dict[str, frozenset[str]] = field(default_factory=dict)
    classes: dict[str, dict[Any, list[str]]] = field(default_factory=dict)
    words: set[str] = field(default_factory=set)
    capital: bool = False
    lines: int = 0
    bits: dict[tuple[str, ...], int] = field(default_factory=dict)
    _masks: dict[str, int] = field(default_factory=dict)
    _tables: dict[str, _Table] = field(default_factory=dict)
    _fuse: dict[str, list[tuple[re.Pattern[str], str]]] = field(default_factory=dict)
    _forms: dict[str, set[str]] = field(default_factory=dict)
    _tree: dict[str, Any] = field(default_factory=dict)

    def add_line(self, section: str, line: str) -> None:
        """Take in a line: an entry of a class, or a directive where there is no class.

        Raises:
            ValueError: It is malformed.
        """
        self.lines += 1
        if not section:
            self._directive(line)
            return
        names, _, slashed = section.partition("/")
        meaning, equals, forms = line.partition(" = ")
        value = _value(meaning) if equals else None
        for form in (forms if equals else line).split(","):
            single, _, several = form.partition("/")
            self._add(names.split(), value, single.strip())
            if several:
                self._add(slashed.split(), value, several.strip())

    def folded(self, text: str) -> str:
        """Return text in lower case with one spelling for letters that have two."""
        return text.lower() if text.isascii() else replaced(unicodedata.normalize("NFKC", text).lower(), self.spelling)

    def mask(self, specification: str) -> int:
        """Return the ways of agreeing that a specification such as "acc.m dat.p" has in common with the language's.

        Raises:
            LexiconError: None has such a part.
        """
        found = self._masks.get(specification, 0)
        for pattern in re.split(r"[\s|]+", specification.strip()) if not found else ():
            parts = set(pattern.split("."))
            bits = [bit for names, bit in self.bits.items() if parts <= {*names}]
            if not bits:
                told = ", ".join(sorted({part for names in self.bits for part in names}))
                raise LexiconError(f"{pattern!r} is no way to agree; there are {told}")
            found |= sum(bits)
        self._masks[specification] = found
        return found

    def same_case(self, mask: int) -> int:
        """Return a mask with every gender and number of the cases that it has."""
        return mask if mask == EVERYTHING else self._alike(mask, slice(0, 1))

    def any_case(self, mask: int) -> int:
        """Return a mask with every case of the genders and numbers that it has."""
        return mask if mask == EVERYTHING else self._alike(mask, slice(1, 2))

    def is_form(self, word: str, name: str) -> bool:
        """Say whether a folded word is a form of a class."""
        return word in self._forms.get(name, ())

    def split(self, word: str) -> tuple[str, ...]:
        """Return the words that a folded word is made of: itself if it is known, none if it cannot be split."""
        if word in self.contractions:
            return self.contractions[word]
        if word in self.words:
            return (word,)
        for k in range(2, len(word) - 1) if self.joins else ():
            first, second = word[:k], word[k:]
            if any(self.is_form(first, one) and self.is_form(second, other) for one, other in self.joins):
                return (first, second)
        return ()

    @property
    def has_gender(self) -> bool:
        """Whether words agree in more than number."""
        return any(len(names) > 1 for names in self.bits)

    @property
    def singular(self) -> int:
        """What one thing that is called by its name agrees with."""
        return self.bits.get(("sg",), EVERYTHING)

    def named(self, part: str) -> Mapping[str, int]:
        """Return the forms of a word of an id, by the endings called "name", with what each agrees with."""
        table = self._tables.get("name")
        if table is None or not part.isalpha() or len(part) < 2:
            return {part: self.singular}
        forms: dict[str, int] = {}
        for form, mask in self._inflected(part, table):
            forms[form] = forms.get(form, 0) | mask
        # "keys" is what several are called already.
        return forms | {part: forms[part] | self.number_of(part)}

    def number_of(self, word: str) -> int:
        """Return what a word agrees with by its ending, as of the endings called "name"."""
        table = self._tables.get("name")
        found = 0
        for ending, mask in table.endings if table else ():
            stem = word.removesuffix(ending)
            if ending and stem != word and self._ended(stem, ending) == word:
                found |= mask
        return found or (self.singular if table else EVERYTHING)

    def is_strange(self, token: Token, known: Collection[str], only: Collection[str]) -> bool:
        """Say whether a word may be a noun that nobody knows: it stands for nothing here, which grounding tells.

        Args:
            token: The word.
            known: Words of the language.
            only: The classes that begin with it here.
        """
        if len(token.text) < 2 or token.text in self.lists.get("real", ()):
            return False
        if token.text in known:
            return bool(only) and {*only} <= self.lists.get("doubtful", frozenset())
        return not self.capital or token.raw[:1].isupper()

    def at(self, tokens: Sequence[Token], i: int) -> Iterator[tuple[str, Hit]]:
        """Yield each class, with its hit, of which a phrase begins at a token."""
        node, count = self._tree, len(tokens)
        while i < count and (node := node.get(tokens[i].text)) is not None:  # type: ignore[assignment]
            i += 1
            for name, value, mask in node.get("", ()):
                yield name, Hit(i, value, mask)

    def _alike(self, mask: int, part: slice) -> int:
        own = {names[part] for names, bit in self.bits.items() if bit & mask}
        return sum(bit for names, bit in self.bits.items() if names[part] in own)

    def _directive(self, line: str) -> None:
        word, _, rest = line.partition(" ")
        match word:
            case "language":
                self.name = rest
            case "signs":
                self.signs |= frozenset(spelled(rest.split(), self.spelling))
            case "spelling":
                self.spelling.update(_pairs(rest))
            case "asks":
                pass  # front.py reads it before anything else is read.
            case "typed":
                self.typed.update(_pairs(rest))
            case "agree":
                for names in product(*(group.split() for group in rest.split(" x "))):
                    self.bits[names] = 1 << len(self.bits)
            case "inflect":
                name, _, endings = rest.partition(":")
                name, _, first = name.partition(" ")
                told = [
                    ("" if ending == "-" else ending, self.mask(mask))
                    for group in endings.split(";")
                    for forms, _, mask in [group.partition("=")]
                    for ending in forms.split()
                ]
                self._tables[name] = _Table(told, first == "first")
            case "fuse":
                pattern, _, by = rest.partition(" = ")
                self._fuse.setdefault(pattern.rpartition("+")[2], []).append((re.compile(pattern + "$"), by))
            case "contract":
                self.contractions.update((self.folded(a), tuple(self.folded(b).split())) for a, b in _pairs(rest))
            case "join":
                first, second = rest.split()
                self.joins.append((first, second))
            case "write":
                pattern, _, by = (rest + " ").partition(" = ")
                self.writes.append((re.compile(pattern), by.rstrip() if "\\" in by else f" {by.strip()} "))
            case "list":
                name, _, words = rest.partition(":")
                self.lists[name] = self.lists.get(name, frozenset()) | frozenset(words.split())
            case "nouns":
                self.capital = rest == "capital"
            case "say":
                english, _, own = rest.partition(" = ")
                self.says.append((english, own))
            case _:
                raise LexiconError(f"no line begins with {word!r}")

    def _add(self, section: Sequence[str], value: Any, written: str) -> None:
        match = _FORM.fullmatch(written)
        if match is None:
            raise LexiconError(f"{written!r} is no form")
        name, table = section[0], "".join(section[1:])
        prefix, stem, mask = match.groups()
        if prefix in self._tables and mask is None:
            table = prefix
        elif prefix:
            stem = f"{prefix} {stem}"
        value = stem if value is None else value
        forms: Iterable[tuple[str, int]] = ((stem, EVERYTHING),)
        if mask is not None:
            forms = ((stem, self.mask(mask)),)
        elif table:
            forms = self._inflected(stem, self._tables[table])
        masks: dict[str, int] = {}
        for form, bits in forms:
            for spelled_so in dict.fromkeys((form, replaced(form, self.typed))) if self.typed else (form,):
                folded = self.folded(spelled_so)
                masks[folded] = masks.get(folded, 0) | bits
        self.classes.setdefault(name, {}).setdefault(value, []).append(written)
        self._forms.setdefault(name, set()).update(masks)
        for form, bits in masks.items():
            words = form.split()
            self.words.update(words)
            node = self._tree
            for word in words:
                node = node.setdefault(word, {})
            node.setdefault("", []).append((name, value, bits))

    def _inflected(self, stem: str, table: _Table) -> Iterator[tuple[str, int]]:
        word, space, rest = stem.partition(" ") if table.first else ("", "", stem)
        for ending, mask in table.endings:
            yield (self._ended(word, ending) + space + rest if word else self._ended(rest, ending)), mask

    def _ended(self, stem: str, ending: str) -> str:
        if not ending:
            return stem
        for pattern, by in self._fuse.get(ending.lstrip("+"), ()):
            joined, changed = pattern.subn(by, f"{stem}+{ending}")
            if changed:
                return joined
        return stem + ending.lstrip("+")


def logical_lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield the lines of a text that are neither empty nor comments, with their numbers."""
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.partition(" # ")[0].rstrip() if not line.startswith("#") else ""
        if bare:
            yield number, bare


def spelled(words: Iterable[str], spelling: Mapping[str, str]) -> Iterator[str]:
    """Yield each word, and each spelling that it may have instead."""
    for word in words:
        yield word
        yield replaced(word, spelling)


def replaced(text: str, letters: Mapping[str, str]) -> str:
    """Return a text with some letters written otherwise."""
    for letter, other in letters.items():
        text = text.replace(letter, other)
    return text


def _pairs(text: str) -> list[tuple[str, str]]:
    return [(a.strip(), b.strip()) for pair in text.split(",") for a, b in [pair.split("=")]]


def _value(text: str) -> Any:
    try:
        number = float(text)
    except ValueError:
        return text
    return int(number) if number.is_integer() else number
