"""Templates: ways of saying something, each with plainer words for it, matched over the phrases of the grammar.

    use {one} as a (base|support) [and] put {thing} on (it|top)   ->   put {thing} on {one}

A pattern holds words, choices `(a|b c)`, optional words `[a|b]`, slots `{kind}` and places in the sentence: `<start>`,
`<end>` (nothing but marks follows), `<edge>` (a clause begins or ends here), `<verb>` (a command may begin here).
`{kind}` and `{kind2}` are phrases that the grammar reads (`slots.KINDS`), `{TAG}` and `{TAG=value}` phrases of the
lexicon, `{name:a|b}` words to carry over; `<part>` is a pattern that several share.

What a template says stays: its slots are carried over whole, except those named with an underscore (`{_place}`), which
are left out; and a word that may bind (`GUARDED`: if, until, once, not, only, a number ...) is left out only if the
pattern marks it so (`once!`), and never as a part of a slot.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from robosandbox.agent.language.slots import KINDS, Said
from robosandbox.agent.language.speech import OPENERS
from robosandbox.agent.language.things import NUMBERS, ORDINALS
from robosandbox.agent.language.tokens import MARKS, SceneWords, Token
from robosandbox.agent.language.wordlist import word_set
from robosandbox.values import frozen

GUARDED = word_set(
    """
        if unless whether until till when whenever while once after before only except without not never no nor neither none
        nothing nobody avoid instead otherwise or first last again twice else soon later yet still
        """
) | frozenset(word for word in (*NUMBERS, *ORDINALS) if " " not in word and word not in ("a", "an", "one"))
"""Words that may say whether, when, how often or how much."""
_JOINTS = frozenset({"and", "then", "but", "so"})


class TemplateError(ValueError):
    """A template that is no template, or that leaves out what may bind."""


@frozen
class Word:
    """One word or mark; `dropped` where the outcome may lack it though it is guarded."""

    text: str
    dropped: bool = False


@frozen
class Choice:
    """One of several sequences, `name` to carry over which; optional where one of them is empty."""

    options: tuple[tuple[Node, ...], ...]
    name: str = ""


@frozen
class Slot:
    """A phrase of the grammar or of the lexicon."""

    name: str

    @property
    def kind(self) -> str:
        """What phrase, without the number that tells two slots apart."""
        return self.name.strip("_").rstrip("0123456789")


@frozen
class Place:
    """A place in the sentence: start, end, edge or verb."""

    name: str


Node = Word | Choice | Slot | Place
Bound = tuple[tuple[str, int, int], ...]


@frozen(eq=False)
class Step:
    """One node of a pattern and what comes after it.

    Attributes:
        node: The word, choice, slot or place.
        then: The next step, None at the end of the pattern.
        ways: Of a choice: the first step of each option; where it has no name, the options go on with `then`.
        opens: The words with one of which what is matched from here must begin; none if it may begin with anything.
        kind: What phrase a slot takes.
    """

    node: Node
    then: Step | None
    ways: tuple[Step | None, ...] = ()
    opens: frozenset[str] = frozenset()
    kind: str = ""


@dataclass(frozen=True)
class Template:
    """One way of saying something and the plainer words for it.

    Attributes:
        pattern: What is said.
        outcome: Words, and names of slots in braces.
        source: The pattern as written.
    """

    pattern: tuple[Node, ...]
    outcome: tuple[str, ...]
    source: str

    @classmethod
    def read(cls, pattern: str, outcome: str) -> Template:
        """Return the template of a pattern and an outcome as they are written.

        Raises:
            TemplateError: It is malformed, has no word of its own, or leaves out what may bind.
        """
        pieces = _PIECES.findall(pattern)
        nodes, rest = _sequence(pieces, 0, pattern)
        if rest != len(pieces):
            raise TemplateError(f"{pattern!r}: “{pieces[rest]}” closes nothing")
        template = cls(nodes, tuple(outcome.split()), pattern)
        template._check()
        return template

    def _check(self) -> None:
        names = {name: 0 for name in _names(self.pattern)}
        for name in re.findall(r"\{([^}]*)\}", " ".join(self.outcome)):
            if name not in names:
                raise TemplateError(f"{self.source!r}: its outcome has a slot {{{name}}} that it lacks")
            names[name] += 1
        lost = [name for name, count in names.items() if not count and not name.startswith("_")]
        if lost:
            raise TemplateError(f"{self.source!r} leaves out {{{lost[0]}}}: carry it over, or call it {{_{lost[0]}}}")
        for word in _plain_words(self.pattern):
            binds = _binding([word.text]) and word.text not in self.outcome
            if binds and not word.dropped:
                raise TemplateError(f"{self.source!r} leaves out “{word.text}”: carry it over, or write “{word.text}!”")
            if word.dropped and not binds:
                raise TemplateError(f"{self.source!r}: “{word.text}!” is not left out, or binds nothing")
        if not self.needed:
            raise TemplateError(f"{self.source!r} has no word that must be there")

    @cached_property
    def needed(self) -> tuple[frozenset[str], ...]:
        """Sets of words of which a sentence must have one each, the rarest first."""
        sets = [words for node in self.pattern for words in [_must(node)] if words]
        return tuple(sorted(sets, key=_commonness))

    @cached_property
    def start(self) -> Step | None:
        """The pattern step by step."""
        return _steps(self.pattern, None)

    @cached_property
    def opens(self) -> frozenset[str]:
        """The words with one of which it must begin; none if it may begin with anything."""
        return self.start.opens if self.start else frozenset()

    def may_fit(self, texts: frozenset[str]) -> bool:
        """Say whether the words of a sentence have what a match needs."""
        return all(words & texts for words in self.needed)

    def applied(self, said: Said) -> Said | None:
        """Return the sentence with every match in plainer words, None if there is no match."""
        made: list[Token] = []
        i, n, changed = 0, len(said.tokens), False
        starts = self._starts(said)
        if not starts:
            return None
        while i < n:
            found = next(self._matches(said, i), None) if i in starts else None
            if found is None:
                made.append(said.tokens[i])
                i += 1
            else:
                changed = True
                end, bound = found
                made += self._said_plainly(said, bound)
                if end == i:
                    made.append(said.tokens[i])
                i = max(end, i + 1)
        return Said(_tidied(made), said.words) if changed else None

    def _starts(self, said: Said) -> set[int]:
        """Return where a match may begin: not behind a word that it needs, and at a place or with a word that opens it."""
        texts = said.texts
        last = min(max((k for k, text in enumerate(texts) if text in words), default=-1) for words in self.needed)
        if self.opens:
            return {k for k in range(last + 1) if texts[k] in self.opens}
        place = self.pattern[0].name if isinstance(self.pattern[0], Place) else ""
        return {k for k in range(last + 1) if not place or _at(place, texts, k)}

    def _matches(self, said: Said, i: int) -> Iterator[tuple[int, Bound]]:
        for end, bound in _matched(self.start, said, i, ()):
            dropped = (said.texts[a:b] for name, a, b in bound if name.startswith("_"))
            if not any(_binding(texts) for texts in dropped):
                yield end, bound

    def _said_plainly(self, said: Said, bound: Bound) -> list[Token]:
        slots = {name: said.tokens[a:b] for name, a, b in bound}
        made: list[Token] = []
        for word in self.outcome:
            if word.startswith("{"):
                made += slots.get(word[1:-1], ())
            else:
                made.append(Token(word, word, "mark" if word in MARKS else "word"))
        return made


class Constructions:
    """A table of templates, tried in order; those without a word of the sentence cost nothing."""

    def __init__(self, *tables: Mapping[str, str], parts: Mapping[str, str] | None = None) -> None:
        self._tables = tables
        self._parts = parts or {}

    @cached_property
    def templates(self) -> list[Template]:
        """All templates, read from the tables when a sentence is first compared with them; most sentences never are."""
        return [
            Template.read(_with_parts(pattern, self._parts), outcome)
            for table in self._tables
            for pattern, outcome in table.items()
        ]

    @cached_property
    def _by_word(self) -> dict[str, list[int]]:
        """The templates that need one of some words, by each of those words."""
        found: dict[str, list[int]] = {}
        for k, template in enumerate(self.templates):
            for word in template.needed[0]:
                found.setdefault(word, []).append(k)
        return found

    def applied(self, tokens: Sequence[Token], words: SceneWords) -> tuple[Token, ...]:
        """Return the tokens of a sentence in plainer words; the same tokens if no template fits."""
        return tuple(self.reworded(Said(tuple(tokens), words)).tokens)

    def reworded(self, said: Said) -> Said:
        """Return a sentence in plainer words, each template applied once; the same sentence if none fits."""
        start = 0
        while True:
            texts = frozenset(said.texts)
            for k in sorted({k for word in texts for k in self._by_word.get(word, ()) if k >= start}):
                made = self.templates[k].applied(said) if self.templates[k].may_fit(texts) else None
                if made is not None:
                    said, start = made, k + 1
                    break
            else:
                return said


_PIECES = re.compile(r"\{[^}]*\}|<\w+>|[()\[\]|]|[^\s()\[\]{}|<>]+")
_PLACES = ("start", "end", "edge", "verb")
_COMMON = dict.fromkeys(
    word_set("the a an of to in on it is and you i that with for we , . ; : ! ? put as by me at are be or be will can"),
    50,
)


def _with_parts(pattern: str, parts: Mapping[str, str]) -> str:
    while any(f"<{name}>" in pattern for name in parts):
        pattern = re.sub(r"<(\w+)>", lambda match: parts.get(match[1], match[0]), pattern)
    return pattern


def _sequence(pieces: Sequence[str], k: int, source: str) -> tuple[tuple[Node, ...], int]:
    nodes: list[Node] = []
    while k < len(pieces) and pieces[k] not in (")", "]", "|"):
        piece = pieces[k]
        k += 1
        if piece in "([":
            options: list[tuple[Node, ...]] = []
            close = ")" if piece == "(" else "]"
            while True:
                option, k = _sequence(pieces, k, source)
                options.append(option)
                if k >= len(pieces) or pieces[k] not in ("|", close):
                    raise TemplateError(f"{source!r}: “{piece}” is not closed")
                k += 1
                if pieces[k - 1] == close:
                    break
            nodes.append(Choice((*options, ()) if piece == "[" else tuple(options)))
        elif piece.startswith("<"):
            if piece[1:-1] not in _PLACES:
                raise TemplateError(f"{source!r}: no place is called {piece}")
            nodes.append(Place(piece[1:-1]))
        elif piece.startswith("{"):
            nodes.append(_slot(piece[1:-1], source))
        else:
            word = piece.rstrip("!") or "!"
            dropped = len(piece) > 1 and piece.endswith("!")
            nodes.append(Word(str(float(word)) if word.isdigit() else word, dropped))
    return tuple(nodes), k


def _slot(text: str, source: str) -> Node:
    name, colon, options = text.partition(":")
    if colon:
        return Choice(tuple(tuple(Word(word) for word in option.split()) for option in options.split("|")), name)
    slot = Slot(name)
    if not slot.kind.partition("=")[0].isupper() and slot.kind not in KINDS:
        raise TemplateError(f"{source!r}: no phrase is called {{{name}}}")
    return slot


def _names(nodes: Sequence[Node]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, Slot):
            yield node.name
        elif isinstance(node, Choice):
            if node.name:
                yield node.name
            for option in node.options:
                yield from _names(option)


def _plain_words(nodes: Sequence[Node]) -> Iterator[Word]:
    """The words that are left out unless the outcome says them."""
    for node in nodes:
        if isinstance(node, Word):
            yield node
        elif isinstance(node, Choice) and not node.name:
            for option in node.options:
                yield from _plain_words(option)


def _must(node: Node) -> frozenset[str]:
    """Return words of which one must be said where this node matches; none if it can do without."""
    if isinstance(node, Word):
        return frozenset({node.text})
    if not isinstance(node, Choice):
        return frozenset()
    sets = [min(filter(None, map(_must, option)), key=_commonness, default=frozenset[str]()) for option in node.options]
    return frozenset().union(*sets) if all(sets) else frozenset()


def _commonness(words: frozenset[str]) -> int:
    return sum(_COMMON.get(word, 1) for word in words)


def _steps(nodes: Sequence[Node], then: Step | None) -> Step | None:
    """Return the first step of a sequence that goes on with `then`."""
    for node in reversed(nodes):
        then = _step(node, then)
    return then


def _step(node: Node, then: Step | None) -> Step:
    if isinstance(node, Word):
        return Step(node, then, (), frozenset({node.text}))
    if isinstance(node, Slot):
        return Step(node, then, kind=node.kind)
    if isinstance(node, Place):
        return Step(node, then, (), then.opens if then else frozenset())
    ways = tuple(_steps(option, None if node.name else then) for option in node.options)
    opens = [way.opens if way else frozenset[str]() for way in ways]
    return Step(node, then, ways, frozenset().union(*opens) if all(opens) else frozenset())


def _matched(step: Step | None, said: Said, i: int, bound: Bound) -> Iterator[tuple[int, Bound]]:
    """Every way to match a sequence from token `i`, the longer phrases first."""
    texts = said.texts
    while step is not None:
        if step.opens and (i >= len(texts) or texts[i] not in step.opens):
            return
        node, then = step.node, step.then
        if isinstance(node, Word):
            i += 1
        elif isinstance(node, Place):
            if not _at(node.name, texts, i):
                return
        elif isinstance(node, Choice):
            for way in step.ways:
                if not node.name:
                    yield from _matched(way, said, i, bound)
                    continue
                for end, _ in _matched(way, said, i, ()):
                    yield from _matched(then, said, end, (*bound, (node.name, i, end)))
            return
        else:
            # No phrase is looked for that nothing after it lets match.
            goes_on = i < len(texts) and not (then and then.opens and then.opens.isdisjoint(texts[i + 1 :]))
            for end in said.ends(step.kind, i) if goes_on else ():
                yield from _matched(then, said, end, (*bound, (node.name, i, end)))
            return
        step = then
    yield i, bound


def _at(place: str, texts: Sequence[str], i: int) -> bool:
    if place == "start":
        return i == 0
    if place == "end":
        return all(text in MARKS for text in texts[i:])
    if place == "verb":
        return i == 0 or texts[i - 1] in OPENERS
    opens = i == 0 or texts[i - 1] in MARKS or texts[i - 1] in _JOINTS
    return opens or i == len(texts) or texts[i] in MARKS or texts[i] in _JOINTS


def _binding(texts: Sequence[str]) -> bool:
    return any(text in GUARDED or text[:1].isdigit() for text in texts)


def _tidied(tokens: Sequence[Token]) -> tuple[Token, ...]:
    """Drop marks that nothing stands before any more."""
    made: list[Token] = []
    for token in tokens:
        if token.text not in MARKS or (made and made[-1].text not in MARKS):
            made.append(token)
    return tuple(made)


__all__ = ["GUARDED", "KINDS", "Constructions", "Said", "Template", "TemplateError"]
