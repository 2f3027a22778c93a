"""The rules of a language from a rules file: what a phrase is made of, and which fields of a logical form it fills.

As in:

    thing : Ref                  a phrase, and the form that it becomes; without one its fields are the outer phrase's
      = &det &adjective* &noun   one way to say it: phrases, CLASSES of the lexicon, "words"; x?, x*, (a | b)
      = names+:ID one=yes        field:x fills a field, field+:x adds to one, field=value says it outright
    simple(V A)                  a rule about other phrases, as in simple(TURN turned)
      = V.imp A                  x.acc|dat is an x in that case; &x agrees with the other &, &~x only in case
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path

from robosandbox.agent.language.inflection import DIRECTIVES, Lexicon, LexiconError, logical_lines
from robosandbox.shapes import shapes

GRAMMARS = Path(__file__).with_name("grammars")
_HEAD = re.compile(r"(?P<name>\w+)(?:\((?P<takes>[\w ]+)\))?(?: : (?P<form>\w+))?")
_PIECE = re.compile(
    r"""\s*(?:(?P<open>\()|(?P<close>\))(?P<again>[?*]?)|(?P<bar>\|)
    |(?P<field>\w+\+?)=(?P<value>\w+)
    |(?:(?P<label>\w+\+?):)?(?P<agree>&~?)?(?:"(?P<word>[^"]+)"|(?P<ref>\w+)(?:\((?P<args>[\w ]+)\))?)
    (?:\.(?P<only>\w+(?:\|\w+)*))?(?P<repeat>[?*]?))""",
    re.VERBOSE,
)
_CONSTANTS: dict[str, bool] = {"yes": True, "no": False}


@dataclass(frozen=True, slots=True)
class Item:
    """One part of a way to say something.

    Attributes:
        word: A word as said; "" if it is a phrase or class.
        ref: The name of a phrase or class; "" if it is a word, a group or a constant.
        args: What the rule that `ref` names is about.
        group: Alternatives.
        label: The field that it fills; one that ends in + is added to.
        value: What fills the field, of a constant.
        agree: "&" to agree with the others, "&~" in case alone.
        only: Bit mask that it must have a part of.
        repeat: "?" or "*".
    """

    word: str = ""
    ref: str = ""
    args: tuple[str, ...] = ()
    group: tuple[tuple[Item, ...], ...] = ()
    label: str = ""
    value: str | int | bool | None = None
    agree: str = ""
    only: int = 0
    repeat: str = ""


@dataclass(frozen=True, slots=True)
class Rule:
    """A phrase.

    Attributes:
        name: Of the phrase.
        form: The logical form that it becomes, "" if it only has fields.
        takes: The names that stand for other phrases in it.
        ways: How it is said.
        source: Its lines as written.
    """

    name: str
    form: str
    takes: tuple[str, ...]
    ways: list[tuple[Item, ...]] = field(default_factory=list)
    source: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Rulebook:
    """A language: its rules and its lexicon."""

    rules: dict[str, Rule] = field(default_factory=dict)
    lexicon: Lexicon = field(default_factory=Lexicon)

    @classmethod
    def read(cls, texts: Mapping[str, str]) -> Rulebook:
        """Return the language of some texts, each under the name that errors tell; a later one may add to a rule or a class.

        Raises:
            LexiconError: A line is malformed, or a rule names what there is not.
        """
        book = cls()
        for source, text in texts.items():
            head = ""
            for number, line in logical_lines(text):
                try:
                    head = book._add_line(head, line)
                except (ValueError, KeyError, IndexError) as error:
                    raise LexiconError(f"{source}, line {number}: {line.strip()!r}: {error}") from error
        book._check()
        return book

    @property
    def lines(self) -> int:
        """How many lines of data it has, empty ones and comments apart."""
        return self.lexicon.lines + sum(1 + len(rule.ways) for rule in self.rules.values())

    def _add_line(self, head: str, line: str) -> str:
        """Take in a line below a head, and return the head that the next line stands below."""
        if line.startswith(" ") and line.lstrip().startswith("="):
            way = line.strip()
            self.rules[head].source.append(way)
            self.rules[head].ways.append(_items(way[1:], self.lexicon))
            return head
        if line.startswith(" "):
            self.lexicon.add_line(head, line.strip())
            return head
        if line[0].isupper():
            return line
        if line.partition(" ")[0] in DIRECTIVES:
            self.lexicon.add_line("", line)
            return ""
        rule = _head(line)
        return self.rules.setdefault(rule.name, rule).name

    @cached_property
    def words(self) -> frozenset[str]:
        """The words that rules name themselves."""
        return frozenset(item.word for rule in self.rules.values() for item in _every(rule.ways) if item.word)

    def listed(self) -> Iterator[str]:
        """Yield its rules, and its classes of words with what they mean, as lines for people."""
        for rule in self.rules.values():
            takes = f"({' '.join(rule.takes)})" if rule.takes else ""
            yield f"{rule.name}{takes}{' : ' + rule.form if rule.form else ''}"
            yield from (f"  {way}" for way in rule.source)
        for name, meanings in self.lexicon.classes.items():
            yield f"{name}: " + "; ".join(f"{value} = {', '.join(forms)}" for value, forms in meanings.items())

    def names(self, rule: str) -> frozenset[str]:
        """Return the phrases and classes that a rule names."""
        return frozenset(ref for item in _every(self.rules[rule].ways) for ref in (item.ref, *item.args) if ref)

    def _check(self) -> None:
        known = {*self.rules, *self.lexicon.classes, *BUILT_IN}
        for rule in self.rules.values():
            for item in _every(rule.ways):
                for ref in (item.ref, *item.args) if item.ref else ():
                    if ref not in known and ref not in rule.takes:
                        raise LexiconError(f"{rule.name} names {ref}, which is no rule and no class of words")
                untyped = item.ref in self.rules and not self.rules[item.ref].form
                if item.label and untyped:
                    raise LexiconError(f"{rule.name}: {item.ref} has no form that could fill {item.label}")


BUILT_IN = ("ID", "NAME", "UNKNOWN", "MARK", "END")
"""Classes that no lexicon lists: an id, a word of one, a noun that nobody knows, a mark, one that ends a sentence."""


_BROUGHT: dict[str, dict[str, str]] = {}


def bring(name: str, translations: Mapping[str, str]) -> None:
    """Take in what a skill says for itself in some languages: lines of a lexicon and of rules, by language."""
    for language, text in translations.items():
        if _BROUGHT.setdefault(language, {}).get(name) != text:
            _BROUGHT[language][name] = text
            rulebook.cache_clear()


@lru_cache(maxsize=8)
def rulebook(language: str) -> Rulebook:
    """Return a language by the name of its files, as "german", with what shapes and skills bring for it."""
    files = (GRAMMARS / f"{language}.lexicon", GRAMMARS / f"{language}.rules")
    texts = {path.name: path.read_text(encoding="utf-8") for path in files}
    shaped = {kind: shape.translations.get(language, "") for kind, shape in shapes().items()}
    return Rulebook.read(texts | shaped | _BROUGHT.get(language, {}))


def languages() -> tuple[str, ...]:
    """Return the names of the languages that are data."""
    return tuple(sorted(path.stem for path in GRAMMARS.glob("*.rules")))


def _head(line: str) -> Rule:
    match = _HEAD.fullmatch(line)
    if match is None:
        raise LexiconError(f"{line!r} is no name of a phrase")
    return Rule(match["name"], match["form"] or "", tuple((match["takes"] or "").split()))


def _items(text: str, lexicon: Lexicon) -> tuple[Item, ...]:
    ways, rest, _ = _alternatives(text.strip(), 0, lexicon)
    if rest != len(text.strip()):
        raise LexiconError(f"{text[rest:]!r} closes nothing")
    return ways[0] if len(ways) == 1 else (Item(group=ways),)


def _alternatives(text: str, i: int, lexicon: Lexicon) -> tuple[tuple[tuple[Item, ...], ...], int, str]:
    """Return what stands between bars from `i` to the end or a closing bracket, where that ends, and its repeat."""
    ways: list[tuple[Item, ...]] = []
    items: list[Item] = []
    while i < len(text):
        match = _PIECE.match(text, i)
        if match is None:
            raise LexiconError(f"{text[i:]!r} is no part of a rule")
        i = match.end()
        if match["open"]:
            group, i, again = _alternatives(text, i, lexicon)
            items.append(Item(group=group, repeat=again))
        elif match["close"]:
            return (*ways, tuple(items)), i, match["again"]
        elif match["bar"]:
            ways.append(tuple(items))
            items = []
        else:
            items.append(_item(match, lexicon))
    return (*ways, tuple(items)), i, ""


def _item(match: re.Match[str], lexicon: Lexicon) -> Item:
    if match["field"]:
        value = match["value"]
        return Item(label=match["field"], value=_CONSTANTS.get(value, int(value) if value.isdigit() else value))
    only = lexicon.mask((match["only"] or "").replace("|", " ")) if match["only"] else 0
    return Item(
        word=lexicon.folded(match["word"] or ""),
        ref=match["ref"] or "",
        args=tuple((match["args"] or "").split()),
        label=match["label"] or "",
        agree=match["agree"] or "",
        only=only,
        repeat=match["repeat"],
    )


def _every(ways: Sequence[tuple[Item, ...]]) -> Iterator[Item]:
    for way in ways:
        for item in way:
            yield item
            yield from _every(item.group)
