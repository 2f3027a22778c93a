"""The rules of a language from a rules file: what a phrase is made of, and which fields of a logical form it fills.

As in:

    thing : Ref                  a phrase, and the form that it becomes; without one its fields are the outer phrase's
      = &det &adjective* &noun   one way to say it: phrases, CLASSES of the lexicon, "words"; x?, x*, (a | b)
      = names+:ID one=yes !      field:x fills a field, field+:x adds to one, field=value says it outright
      = [PUT objects place]      parts in any order; another one than the written is a little unusual
      = PUT.base ^"it" place     x.base is an x of that form; ^x is no x here
    simple(V A)                  a rule about other phrases, as in simple(TURN turned)
      = &V.imp &~A               &x agrees with the other &, &~x only in case

A way to say something is plain, or unusual (!), far-fetched (!!), or a last resort (!!!) such as a noun that nobody knows;
the plainest reading of a sentence is the one that is meant.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from robosandbox.agent.language.vocabulary import DIRECTIVES, LexiconError, Vocabulary, logical_lines
from robosandbox.shapes import shapes

GRAMMARS = Path(__file__).with_name("grammars")
BUILT_IN = (
    "ID", "NAME", "SIDENAME", "SUFFIX", "ONE_NAME", "UNKNOWN", "NUMERAL", "MARK", "END", "OVER", "WORD", "PART_OF_ID", "STEM",
    "CHAT", "CHATTER", "PURPOSE", "REMARK", "REASON", "SAID", "STATED", "TALK", "OWN_DOING",
)  # fmt: skip
"""Classes that no lexicon lists: an id, a word or a last part of one, a noun that nobody knows, a number in figures,
a mark, one that ends a sentence, the end, any one word, and the clauses that may be passed over (chat.py)."""
# How far from plain speech a way of saying something is, by the number of its "!".
COSTS = (0.0, 0.3, 0.8, 4.0)
_HEAD = re.compile(r"(?P<name>\w+)(?:\((?P<takes>[\w ]+)\))?(?: : (?P<form>\w+))?")
_PIECE = re.compile(
    r"""\s*(?:(?P<open>[(\[])|(?P<close>[)\]])(?P<again>[?*]?)|(?P<bar>\|)|(?P<cost>!+)
    |(?P<field>\w+\+?)=(?P<value>-?[\w.]+)
    |(?:(?P<label>\w+\+?):)?(?P<agree>&~?)?(?P<no>\^)?(?:"(?P<word>[^"]+)"|(?P<ref>\w+)(?:\((?P<args>[\w ]+)\))?)
    (?:\.(?P<only>\w+(?:\|\w+)*))?(?P<repeat>[?*]?))""",
    re.VERBOSE,
)
_CONSTANTS: dict[str, Any] = {"yes": True, "no": False, "none": None}


@dataclass(slots=True)
class Item:
    """One part of a way to say something.

    Attributes:
        kind: word, class, rule, group, order or over.
        name: The word, the class or the rule as it is expanded.
        ways: Of a group, its alternatives; of parts in any order, one way of all of them.
        label: The field that it fills; `more` adds to it.
        agree: "&" to agree with the others, "&~" in case alone.
        no: It must not stand here.
        only: Bit mask that it must have a part of; 0 for any.
        repeat: "?" or "*".
        first: What it may begin with, a bit mask of words and classes.
        empty: It may be nothing.
        needs: Words and classes that a sentence with it has, a bit mask.
    """

    kind: str
    name: str
    ways: list[Way] = field(default_factory=list)
    label: str = ""
    more: bool = False
    agree: str = ""
    no: bool = False
    only: int = 0
    repeat: str = ""
    first: int = 0
    empty: bool = False
    needs: int = 0


@dataclass(slots=True)
class Way:
    """One way to say something: its parts, the fields that it fills outright, what it costs."""

    items: list[Item] = field(default_factory=list)
    fields: list[tuple[str, Any, bool]] = field(default_factory=list)
    cost: float = 0.0
    first: int = 0
    empty: bool = False
    needs: int = 0


@dataclass(slots=True)
class Rule:
    """A phrase: its form, the names that stand for other phrases in it, its ways as written and as read."""

    name: str
    form: str
    takes: tuple[str, ...] = ()
    source: list[str] = field(default_factory=list)
    ways: list[Way] = field(default_factory=list)
    first: int = 0
    empty: bool = False
    needs: int = 0


class Ruleset:
    """A language: its rules and its vocabulary.

    Attributes:
        vocabulary: Its words.
        written: Its rules as written, those about other phrases among them.
        rules: Its rules as they are read, each about given phrases.
        bits: A bit for each word that a rule names, as '"it', and each class.
    """

    def __init__(self, texts: Mapping[str, str]) -> None:
        """Read some texts, each under the name that errors tell; a later one may add to a rule or a class.

        Raises:
            LexiconError: A line is malformed, a rule names what there is not, or it begins with itself.
        """
        self.vocabulary: Vocabulary = Vocabulary()
        self.written: dict[str, Rule] = {}
        self.rules: dict[str, Rule] = {}
        self.bits: dict[str, int] = {}
        # Names of its rules, each behind those that it names, as far as none of them names it as well.
        self._order: list[str] = []
        self._places: dict[str, list[str]] = {}
        for source, text in texts.items():
            head = ""
            for number, line in logical_lines(text):
                try:
                    head = self._add_line(head, line)
                except (ValueError, KeyError, IndexError) as error:
                    raise LexiconError(f"{source}, line {number}: {line.strip()!r}: {error}") from error
                if line.startswith(" ") and head in self.written:
                    self._places.setdefault(head, []).append(f"{source}, line {number}: {line.strip()!r}")
        for name in (*self.vocabulary.classes, *BUILT_IN):
            self._bit(name)
        for rule in self.written.values():
            if not rule.takes:
                self._expanded(rule.name, ())
        named = {name.partition("(")[0] for name in self.rules}
        for rule in self.written.values():
            if rule.name not in named:
                # Nothing uses it yet; what is malformed in it is told all the same.
                self._expanded(rule.name, ("WORD",) * len(rule.takes))
        self._close()

    @property
    def lines(self) -> int:
        """Number of its lines of data, empty ones and comments apart."""
        return self.vocabulary.lines + sum(1 + len(rule.source) for rule in self.written.values())

    @cached_property
    def words(self) -> frozenset[str]:
        """The words that rules name themselves."""
        return frozenset(name[1:] for name in self.bits if name[0] == '"')

    @cached_property
    def known(self) -> frozenset[str]:
        """Every word of the language."""
        return self.words | self.vocabulary.words

    @cached_property
    def by_letter(self) -> dict[str, list[str]]:
        """Every word of the language by its first letter."""
        found: dict[str, list[str]] = {}
        for word in self.known:
            found.setdefault(word[0], []).append(word)
        return found

    def names(self, rule: str) -> frozenset[str]:
        """Return the phrases and classes that a rule names."""
        found = [match for way in self.written[rule].source for match in _PIECE.finditer(way[1:]) if match["ref"]]
        return frozenset(ref for match in found for ref in (match["ref"], *(match["args"] or "").split()))

    def listed(self) -> Iterator[str]:
        """Yield its rules, and its classes of words with what they mean, as lines for people."""
        for rule in self.written.values():
            takes = f"({' '.join(rule.takes)})" if rule.takes else ""
            yield f"{rule.name}{takes}{' : ' + rule.form if rule.form else ''}"
            yield from (f"  {way}" for way in rule.source)
        for name, meanings in self.vocabulary.classes.items():
            yield f"{name}: " + "; ".join(f"{value} = {', '.join(forms)}" for value, forms in meanings.items())

    def _add_line(self, head: str, line: str) -> str:
        """Take in a line below a head, and return the head that the next line stands below."""
        if line.startswith(" ") and (line.strip() + " ").startswith("= "):
            self.written[head].source.append(line.strip())
            return head
        if line.startswith(" "):
            self.vocabulary.add_line(head, line.strip())
            return head
        if line[0].isupper():
            return line
        if line.partition(" ")[0] in DIRECTIVES:
            self.vocabulary.add_line("", line)
            return ""
        match = _HEAD.fullmatch(line)
        if match is None:
            raise LexiconError(f"{line!r} is no name of a phrase")
        rule = Rule(match["name"], match["form"] or "", tuple((match["takes"] or "").split()))
        known = self.written.setdefault(rule.name, rule)
        if (known.form, known.takes) != (rule.form, rule.takes):
            raise LexiconError(f"{rule.name} is written already, and becomes {known.form or 'no form'}")
        return rule.name

    def _bit(self, name: str) -> int:
        """Return the bit of a class, or of a word, as '"it'."""
        return self.bits.setdefault(name, 1 << len(self.bits))

    def _expanded(self, name: str, args: tuple[str, ...]) -> str:
        """Return the name of a rule about given phrases, made the first time that it is asked for."""
        full = f"{name}({' '.join(args)})" if args else name
        if full in self.rules:
            return full
        written = self.written[name]
        if len(args) != len(written.takes):
            raise LexiconError(f"{full} gives {len(args)} phrases to {name}, which takes {len(written.takes)}")
        rule = self.rules[full] = Rule(full, written.form)
        given = dict(zip(written.takes, args, strict=True))
        for k, source in enumerate(written.source):
            try:
                rule.ways.append(self._way(source[1:].strip(), given))
            except LexiconError as error:
                told = str(error) if ", line " in str(error) else f"{self._places[name][k]}: {name} {error}"
                raise LexiconError(told) from None
        self._order.append(full)
        return full

    def _way(self, text: str, given: Mapping[str, str]) -> Way:
        ways, rest, _ = self._alternatives(text, 0, given)
        if rest != len(text):
            raise LexiconError(f"{text[rest:]!r} closes nothing")
        return ways[0] if len(ways) == 1 else Way([Item("group", "", ways=ways)])

    def _alternatives(self, text: str, i: int, given: Mapping[str, str]) -> tuple[list[Way], int, str]:
        """Return what stands between bars from `i` to the end or a closing bracket, where that ends, and its repeat."""
        ways = [Way()]
        while i < len(text):
            match = _PIECE.match(text, i)
            if match is None:
                raise LexiconError(f"{text[i:]!r} is no part of a rule")
            i = match.end()
            match match.lastgroup:
                case "open":
                    inner, i, again = self._alternatives(text, i, given)
                    kind = "order" if match["open"] == "[" else "group"
                    ways[-1].items.append(Item(kind, "", ways=inner, repeat=again))
                case "again":
                    return ways, i, match["again"]
                case "bar":
                    ways.append(Way())
                case "cost":
                    ways[-1].cost += COSTS[len(match["cost"])]
                case "value":
                    label = match["field"]
                    ways[-1].fields.append((label.rstrip("+"), _constant(match["value"]), label.endswith("+")))
                case _:
                    ways[-1].items.append(self._item(match, given))
        return ways, i, ""

    def _item(self, match: re.Match[str], given: Mapping[str, str]) -> Item:
        label, agree, no, word, ref, args, only, repeat = match.group(
            "label", "agree", "no", "word", "ref", "args", "only", "repeat"
        )
        item = Item("word", self.vocabulary.folded(word or ""), agree=agree or "", no=bool(no), repeat=repeat)
        if label:
            item.label, item.more = label.rstrip("+"), label.endswith("+")
        if only:
            item.only = self.vocabulary.mask(only)
        ref = given.get(ref, ref)
        if ref in self.written:
            phrases = tuple(given.get(arg, arg) for arg in args.split()) if args else ()
            item.kind, item.name = "rule", self._expanded(ref, phrases)
            if item.label and not self.rules[item.name].form:
                raise LexiconError(f"fills {item.label} with {item.name}, which has no form")
        else:
            if ref:
                item.kind, item.name = "over" if ref == "OVER" else "class", ref
                if ref not in self.vocabulary.classes and ref not in BUILT_IN:
                    raise LexiconError(f"names {ref}, which is no rule and no class of words")
            item.first = self._bit(ref or '"' + item.name)
            item.empty = item.no or bool(repeat)
            item.needs = 0 if item.empty or ref == "OVER" else item.first
        return item

    def _close(self) -> None:
        """Find out what each part may begin with and what it needs, and that none begins with itself."""
        naming: dict[str, set[str]] = {}
        for rule in self.rules.values():
            rule.needs = -1
            for name in _named(rule.ways):
                naming.setdefault(name, set()).add(rule.name)
        # What a rule may begin with depends on those that it names, which come first here.
        todo = dict.fromkeys(self._order)
        while todo:
            rule = self.rules[next(iter(todo))]
            del todo[rule.name]
            before = (rule.first, rule.empty, rule.needs)
            rule.first, rule.empty, rule.needs = self._closed(rule.ways)
            if before != (rule.first, rule.empty, rule.needs):
                todo.update(dict.fromkeys(naming.get(rule.name, ())))
        self._refuse_left_recursion()

    def _closed(self, ways: Sequence[Way]) -> tuple[int, bool, int]:
        first, empty, needs = 0, False, -1
        for way in ways:
            way.first, way.empty, way.needs = 0, True, 0
            for item in way.items:
                if item.kind in ("rule", "group", "order"):
                    self._close_item(item)
                if way.empty and not item.no:
                    way.first |= item.first
                    way.empty = item.empty
                if not item.empty:
                    way.needs |= item.needs
            first, empty, needs = first | way.first, empty or way.empty, needs & way.needs
        return first, empty, needs

    def _close_item(self, item: Item) -> None:
        match item.kind:
            case "rule":
                rule = self.rules[item.name]
                item.first, item.empty, item.needs = rule.first, rule.empty, rule.needs
            case "group":
                item.first, item.empty, item.needs = self._closed(item.ways)
            case _:
                self._closed(item.ways)
                parts = item.ways[0].items
                item.first, item.needs = 0, item.ways[0].needs
                for part in parts:
                    item.first |= part.first
                item.empty = all(part.empty for part in parts)
        if item.no:
            item.empty, item.needs = True, 0
        item.empty = item.empty or bool(item.repeat)

    def _refuse_left_recursion(self) -> None:
        """Raise a LexiconError for a phrase that begins with itself, which a chart from the top down finds nothing for."""
        corners = {name: set(_corners(rule.ways)) for name, rule in self.rules.items()}
        for name in self.rules:
            seen, todo = set[str](), [*corners[name]]
            while todo:
                one = todo.pop()
                todo += corners[one] - seen
                seen |= {one, *corners[one]}
            if name in seen:
                raise LexiconError(f"{name} may begin with itself")


def _named(ways: Sequence[Way]) -> Iterator[str]:
    """Yield the rules that some ways name."""
    for item in (item for way in ways for item in way.items):
        yield from [item.name] if item.kind == "rule" else _named(item.ways)


def _corners(ways: Sequence[Way]) -> Iterator[str]:
    """Yield the rules that some ways may begin with."""
    for way in ways:
        for item in way.items:
            if item.kind == "rule":
                yield item.name
            elif item.kind == "order":
                for part in item.ways[0].items:
                    yield from _corners([Way([part])])
            else:
                yield from _corners(item.ways)
            if not item.empty:
                break


def _constant(text: str) -> Any:
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    try:
        number = float(text)
    except ValueError:
        return text
    return int(number) if number.is_integer() else number


_BROUGHT: dict[str, dict[str, str]] = {}


def bring(name: str, translations: Mapping[str, str]) -> None:
    """Take in what a skill says for itself in some languages: lines of a lexicon and of rules, by language."""
    for language, text in translations.items():
        if _BROUGHT.setdefault(language, {}).get(name) != text:
            _BROUGHT[language][name] = text
            ruleset.cache_clear()


@lru_cache(maxsize=8)
def ruleset(language: str) -> Ruleset:
    """Return a language by the name of its files, as "german" or "german_questions", with what shapes and skills bring for it."""
    files = [path for kind in ("lexicon", "rules") for path in sorted(GRAMMARS.glob(f"{language}*.{kind}"))]
    texts = {path.name: path.read_text(encoding="utf-8") for path in files}
    shaped = {kind: shape.translations.get(language, "") for kind, shape in shapes().items()}
    return Ruleset(texts | shaped | _BROUGHT.get(language, {}))


def languages() -> tuple[str, ...]:
    """Return the names of the languages that are data."""
    return tuple(sorted({path.stem.partition("_")[0] for path in GRAMMARS.glob("*.rules")}))
