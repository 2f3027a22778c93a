"""The tables of `things`, `places`, `speech` and `verbs` as one lexicon: phrase -> tags, and the vocabulary for typos."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from robosandbox.agent.language import places, speech, things, verbs
from robosandbox.agent.language.real_words import REAL_WORDS
from robosandbox.agent.language.synonyms import SAME_AS
from robosandbox.agent.language.wordlist import phrase_list, word_set

if TYPE_CHECKING:
    from robosandbox.agent.language.tokens import Token

__all__ = [
    "ASIDE_FILLERS",
    "COMMON",
    "EDGE_FILLERS",
    "END_FILLERS",
    "FILLERS",
    "JOINABLE",
    "LEXICON",
    "MEANING",
    "REAL_WORDS",
    "START_FILLERS",
    "VOCABULARY",
    "WORDS",
    "Phrases",
]


class _Node:
    """What is said by the words up to here, and the words that may follow."""

    __slots__ = ("hits", "next")

    def __init__(self) -> None:
        self.hits: list[tuple[str, Any]] = []
        self.next: dict[str, _Node] = {}


class Phrases:
    """Phrases by their first word; those with the same one become a tree of words when it is first looked up."""

    def __init__(self) -> None:
        self._written: dict[str, list[tuple[str, str, Any]]] = {}
        self._trees: dict[str, _Node] = {}

    def add(self, phrase: str, tag: str, value: Any = None) -> None:
        """Add one phrase with its tag and value."""
        self.add_all((phrase,), tag, value)

    def add_all(self, phrases: str | Iterable[str], tag: str, value: Any = None) -> None:
        """Add phrases, given as a list or separated by commas."""
        written = self._written
        for phrase in phrase_list(phrases) if isinstance(phrases, str) else phrases:
            first = phrase.partition(" ")[0]
            if first in written:
                written[first].append((phrase, tag, value))
                self._trees.pop(first, None)
            else:
                written[first] = [(phrase, tag, value)]

    def at(self, tokens: Sequence[Token], i: int) -> list[tuple[int, str, Any]]:
        """Return (end, tag, value) of every phrase that starts at token `i`, the shorter first."""
        found: list[tuple[int, str, Any]] = []
        node = self._tree(tokens[i].text) if tokens[i].kind == "word" else None
        count = len(tokens)
        while node is not None:
            i += 1
            for tag, value in node.hits:
                found.append((i, tag, value))
            node = node.next.get(tokens[i].text) if i < count else None
        return found

    def match(self, tokens: Sequence[Token], i: int) -> int:
        """Return the length of the longest phrase at token `i`, 0 for none."""
        node = self._tree(tokens[i].text) if tokens[i].kind == "word" else None
        start, longest, count = i, 0, len(tokens)
        while node is not None:
            i += 1
            longest = i - start if node.hits else longest
            node = node.next.get(tokens[i].text) if i < count else None
        return longest

    def words(self) -> set[str]:
        """Return every word that occurs."""
        return {word for entries in self._written.values() for phrase, _, _ in entries for word in phrase.split()}

    def _tree(self, first: str) -> _Node | None:
        """Return the phrases that begin with a word as a tree; None if there are none."""
        tree = self._trees.get(first)
        if tree is None and first in self._written:
            tree = self._trees[first] = _Node()
            for phrase, tag, value in self._written[first]:
                node = tree
                for word in phrase.split()[1:]:
                    node = node.next.setdefault(word, _Node())
                node.hits.append((tag, value))
        return tree


def _plural(noun: str) -> str:
    if noun.endswith(("s", "x", "ch", "sh")):
        return noun + "es"
    return noun[:-1] + "ies" if noun.endswith("y") and noun[-2] not in "aeiou" else noun + "s"


def _table(lexicon: Phrases, tag: str, table: Mapping[str, str]) -> None:
    for value, phrases in table.items():
        lexicon.add_all(phrases, tag, value)


def _build() -> Phrases:
    lexicon = Phrases()
    for verb, phrases in verbs.VERBS.items():
        for phrase in phrase_list(phrases):
            lexicon.add_all(verbs.forms(phrase), "VERB", verb)
    for noun, phrases in things.NOUNS.items():
        for phrase in phrase_list(phrases):
            lexicon.add(phrase, "NOUN", (noun, phrase, phrase in things.PLURAL_NOUNS))
            if phrase not in things.MASS_NOUNS | things.PLURAL_NOUNS:
                lexicon.add(words_plural(phrase), "NOUN", (noun, phrase, True))
            if phrase in things.COLLECTIVE_NOUNS:
                lexicon.add(phrase, "NOUN", (noun, phrase, True))
    shaped = {phrase for phrases in things.NOUNS.values() for phrase in phrase_list(phrases)}
    for noun in things.ABSENT_NOUNS | {*SAME_AS} - shaped:
        lexicon.add(noun, "ABSENT", (noun, False))
        lexicon.add(_plural(noun), "ABSENT", (noun, True))
    for tag, table in (
        ("COLOUR", things.COLOURS), ("SHADE", things.SHADES), ("SIZE", things.SIZES), ("SUPER", things.SUPERLATIVES),
        ("POS", things.POSITIONS), ("FROM", things.ORDER_FROM), ("DIR", places.DIRECTIONS), ("REL", places.RELATIONS),
        ("TO", places.DIRECTIONAL), ("PRON", things.PRONOUNS), ("LIGHT_NOUN", speech.LIGHT_NOUNS),
        ("ITS_SIDE", places.ITS_SIDES), ("OPPOSITE", places.OPPOSITES),
    ):  # fmt: skip
        _table(lexicon, tag, table)
    for tag, numbers in (
        ("ORDINAL", things.ORDINALS),
        ("NUM", things.NUMBERS),
        ("UNIT", things.UNITS),
        ("AMOUNT", things.AMOUNTS),
        ("TIMES", speech.TIMES),
    ):
        for phrase, number in numbers.items():
            lexicon.add(phrase, tag, number if tag in ("ORDINAL", "TIMES") else float(number))
    for tag, phrases in (
        ("SOURCE", places.SOURCES), ("TABLE", places.TABLE), ("FLOOR", places.FLOOR), ("ROBOT", places.ROBOT),
        ("ABOUT", things.ABOUT), ("PREAMBLE", speech.PREAMBLES), ("DESIRE", speech.DESIRES), ("OWN_WISH", speech.OWN_WISHES), ("COPULA", speech.COPULAS),
        ("IS", speech.IS), ("NOT_IS", speech.NOT_IS), ("EXCEPT", speech.EXCEPT), ("AVOID", speech.AVOID),
        ("AVOID_TAIL", speech.AVOID_TAILS), ("THEN", speech.CONNECTORS), ("FIRST", speech.FIRST),
        ("FIRST_BUT", speech.FIRST_BUT), ("BEFORE", speech.BEFORE), ("AFTER", speech.AFTER), ("UP_ORDER", places.ORDER_UP),
        ("DOWN_ORDER", places.ORDER_DOWN), ("BY_COLOUR", places.BY_COLOUR), ("BY_OTHER", places.BY_OTHER), ("BY_SIZE", places.BY_SIZE), ("SMALL_FIRST", places.SMALL_FIRST),
        ("MATCHING", places.MATCHING), ("SAME_COLOUR", places.SAME_COLOUR), ("MISMATCHED", places.MISMATCHED), ("OTHER_COLOUR", places.OTHER_COLOUR), ("HOME", places.HOMES), ("ARM", places.ARM),
        ("THE", things.DEFINITES), ("A", things.INDEFINITES), ("ALL", things.UNIVERSALS), ("BOTH", things.BOTHS), ("OTHER", things.OTHERS),
        ("REST", things.RESTS), ("OF_THEM", things.OF_THEM), ("CALLED", things.CALLED), ("NON", things.NON), ("COLOURED", things.COLOURED),
        ("ORIGINAL", places.ORIGINAL), ("EVERYTHING", things.EVERYTHING), ("EVERYTHING_ELSE", things.EVERYTHING_ELSE),
        ("TOP", places.TOPS), ("BOTTOM", places.BOTTOMS), ("ONE_OF", things.ONE_OF), ("SOMETHING", things.SOMETHING),
        ("STILL", speech.STILL),
        ("LATER", speech.LATER),
        ("DOES_TOO", speech.DOES_TOO),
        ("SO_THAT", places.SO_THAT),
        ("SAME", speech.SAME),
        ("IS_NOW", speech.IS_NOW),
        ("NEGATION", speech.NEGATIONS), ("LIGHT_ADJECTIVE", speech.LIGHT_ADJECTIVES), ("MIDDLE", places.MIDDLES), ("CORRECTION", speech.CORRECTION), ("INSTEAD", speech.INSTEAD), ("HELD", things.HELD), ("HELD_THING", things.HELD_THING), ("MATERIAL", speech.MATERIAL), ("SWAP_OF", speech.SWAP_OF), ("NOR", speech.NOR), ("LOOK", speech.LOOK), ("FREE", places.FREE_SPOTS),
        ("CONTENTS", things.CONTENTS),
    ):  # fmt: skip
        lexicon.add_all(phrases, tag, phrases and None)
    for phrase in phrase_list(places.PARTICLES):
        lexicon.add(phrase, "PART", phrase)
    return lexicon


def words_plural(phrase: str) -> str:
    """Return the plural of a noun phrase's last word."""
    return _plural(phrase)


LEXICON = _build()
FILLERS = Phrases()
FILLERS.add_all(speech.FILLERS, "FILLER")
FILLERS.add_all(speech.MANNERS, "FILLER", "manner")
FILLERS.add_all(speech.LIMITS, "FILLER", "limit")
FILLERS.add_all(speech.REPEATS, "FILLER", "repeat")
EDGE_FILLERS = Phrases()
EDGE_FILLERS.add_all(speech.EDGE_FILLERS, "FILLER")
END_FILLERS = Phrases()
END_FILLERS.add_all(speech.END_FILLERS, "FILLER")
END_FILLERS.add_all(speech.RATHER, "FILLER", "repeat")
ASIDE_FILLERS = Phrases()
ASIDE_FILLERS.add_all(speech.ASIDE_FILLERS, "FILLER")
START_FILLERS = Phrases()
START_FILLERS.add_all(speech.START_FILLERS, "FILLER")

WORDS = frozenset(
    LEXICON.words()
    | FILLERS.words()
    | EDGE_FILLERS.words()
    | END_FILLERS.words()
    | START_FILLERS.words()
    | ASIDE_FILLERS.words()
    | verbs.UNSUPPORTED_VERBS
    | speech.QUESTIONS
    | speech.CONDITIONS
    | speech.GRAMMAR_WORDS
    | speech.DEGREES
)
MEANING: dict[str, str] = {}
for _name, _table_ in (
    ("noun", things.NOUNS),
    ("colour", things.COLOURS),
    ("size", things.SIZES),
    ("super", things.SUPERLATIVES),
):
    for _value, _phrases in _table_.items():
        for _phrase in phrase_list(_phrases):
            MEANING[_phrase] = f"{_name} {_value}"
for _verb, _phrases in verbs.VERBS.items():
    for _phrase in phrase_list(_phrases):
        for _form in verbs.forms(_phrase):
            MEANING.setdefault(_form, f"verb {_verb}")
_CORE = word_set(
    """
    pick grab grasp get fetch take lift raise hold put place set drop move push shove slide nudge stack pile pour
    open close shut tap touch press swap switch exchange sort tidy go return home release build poke position pull
    drag shift transfer
    """
)
COMMON = (
    frozenset(w for phrase, meaning in MEANING.items() if not meaning.startswith("verb") for w in phrase.split())
    | speech.GRAMMAR_WORDS
    | frozenset(w for w in things.UNITS if w.isalpha())
    | frozenset(
        w for verb in _CORE for form in verbs.inflections(verb) if form == verb or form.endswith("ing") for w in [form]
    )
    | frozenset(w for n in things.NUMBERS for w in n.split())
    | {
        "please",
        "everything",
        "forward",
        "forwards",
        "backward",
        "backwards",
        "towards",
        "toward",
        "could",
        "would",
        "can",
        "first",
        "second",
        "third",
    }
)
"""The words that a typo is likely to have been."""
COMMON |= frozenset(
    part for noun in things.NOUNS.values() for phrase in phrase_list(noun) for part in words_plural(phrase).split()
)
COMMON |= frozenset(
    w for phrases in places.RELATIONS.values() for w in phrase_list(phrases) if len(w) > 4 and " " not in w
)
VOCABULARY = tuple(sorted(word for word in COMMON if len(word) >= 3 and word.isalpha()))

JOINABLE: dict[str, int] = {}
"""Words that are run together in this order: verb, article, colour, noun, particle."""
for _rank, _words in enumerate((
    {"pick", "put", "push", "grab", "stack", "place", "take", "lift"}, {"the", "a"}, {w for c in things.COLOURS.values() for w in phrase_list(c)},
    {w for n in things.NOUNS.values() for w in phrase_list(n) if " " not in w}, {"up", "down", "in", "on", "into", "onto"},
)):  # fmt: skip
    for _word in _words:
        JOINABLE.setdefault(_word, _rank)
