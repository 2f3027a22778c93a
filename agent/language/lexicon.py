"""The tables of `words` and `verbs` as one lexicon: phrase -> tags, and the vocabulary for typos."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from robosandbox.agent.language import verbs, words
from robosandbox.agent.language.real_words import REAL_WORDS
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


class Phrases:
    """Phrases by their first word."""

    def __init__(self) -> None:
        self._by_first: dict[str, list[tuple[tuple[str, ...], str, Any]]] = {}

    def add(self, phrase: str, tag: str, value: Any = None) -> None:
        """Add one phrase with its tag and value."""
        parts = tuple(phrase.split())
        self._by_first.setdefault(parts[0], []).append((parts, tag, value))

    def add_all(self, phrases: str | Iterable[str], tag: str, value: Any = None) -> None:
        """Add phrases, given as a list or separated by commas."""
        for phrase in phrase_list(phrases) if isinstance(phrases, str) else phrases:
            self.add(phrase, tag, value)

    def at(self, tokens: Sequence[Token], i: int) -> list[tuple[int, str, Any]]:
        """Return (end, tag, value) of every phrase that starts at token `i`."""
        token = tokens[i]
        found = []
        for parts, tag, value in self._by_first.get(token.text, ()) if token.kind == "word" else ():
            end = i + len(parts)
            if end <= len(tokens) and all(tokens[i + k].text == parts[k] for k in range(1, len(parts))):
                found.append((end, tag, value))
        return found

    def match(self, tokens: Sequence[Token], i: int) -> int:
        """Return the length of the longest phrase at token `i`, 0 for none."""
        return max((end - i for end, _, _ in self.at(tokens, i)), default=0)

    def words(self) -> set[str]:
        """Return every word that occurs."""
        return {word for entries in self._by_first.values() for parts, _, _ in entries for word in parts}


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
            for form in verbs.forms(phrase):
                lexicon.add(form, "VERB", verb)
    for noun, phrases in words.NOUNS.items():
        for phrase in phrase_list(phrases):
            lexicon.add(phrase, "NOUN", (noun, phrase, phrase in words.MASS_NOUNS))
            if phrase not in words.MASS_NOUNS:
                lexicon.add(words_plural(phrase), "NOUN", (noun, phrase, True))
    for noun in words.ABSENT_NOUNS:
        lexicon.add(noun, "ABSENT", (noun, False))
        lexicon.add(_plural(noun), "ABSENT", (noun, True))
    for tag, table in (
        ("COLOUR", words.COLOURS), ("SHADE", words.SHADES), ("SIZE", words.SIZES), ("SUPER", words.SUPERLATIVES),
        ("POS", words.POSITIONS), ("FROM", words.ORDER_FROM), ("DIR", words.DIRECTIONS), ("REL", words.RELATIONS),
        ("TO", words.DIRECTIONAL), ("PRON", words.PRONOUNS), ("LIGHT_NOUN", words.LIGHT_NOUNS),
        ("ITS_SIDE", words.ITS_SIDES),
    ):  # fmt: skip
        _table(lexicon, tag, table)
    for tag, numbers in (
        ("ORDINAL", words.ORDINALS),
        ("NUM", words.NUMBERS),
        ("UNIT", words.UNITS),
        ("AMOUNT", words.AMOUNTS),
        ("TIMES", words.TIMES),
    ):
        for phrase, number in numbers.items():
            lexicon.add(phrase, tag, number if tag in ("ORDINAL", "TIMES") else float(number))
    for tag, phrases in (
        ("SOURCE", words.SOURCES), ("TABLE", words.TABLE), ("FLOOR", words.FLOOR), ("ROBOT", words.ROBOT),
        ("ABOUT", words.ABOUT), ("PREAMBLE", words.PREAMBLES), ("DESIRE", words.DESIRES), ("COPULA", words.COPULAS),
        ("IS", words.IS), ("NOT_IS", words.NOT_IS), ("EXCEPT", words.EXCEPT), ("AVOID", words.AVOID),
        ("AVOID_TAIL", words.AVOID_TAILS), ("THEN", words.CONNECTORS), ("FIRST", words.FIRST),
        ("FIRST_BUT", words.FIRST_BUT), ("BEFORE", words.BEFORE), ("AFTER", words.AFTER), ("UP_ORDER", words.ORDER_UP),
        ("DOWN_ORDER", words.ORDER_DOWN), ("BY_COLOUR", words.BY_COLOUR), ("BY_OTHER", words.BY_OTHER),
        ("MATCHING", words.MATCHING), ("SAME_COLOUR", words.SAME_COLOUR), ("HOME", words.HOMES), ("ARM", words.ARM),
        ("THE", words.DEFINITES), ("A", words.INDEFINITES), ("ALL", words.UNIVERSALS), ("BOTH", words.BOTHS), ("OTHER", words.OTHERS),
        ("REST", words.RESTS), ("OF_THEM", words.OF_THEM), ("CALLED", words.CALLED), ("NON", words.NON), ("COLOURED", words.COLOURED),
        ("ORIGINAL", words.ORIGINAL), ("EVERYTHING", words.EVERYTHING), ("EVERYTHING_ELSE", words.EVERYTHING_ELSE),
        ("TOP", words.TOPS), ("BOTTOM", words.BOTTOMS), ("ONE_OF", words.ONE_OF), ("SOMETHING", words.SOMETHING),
        ("STILL", words.STILL),
        ("SO_THAT", words.SO_THAT),
        ("SAME", words.SAME),
        ("IS_NOW", words.IS_NOW),
        ("NEGATION", words.NEGATIONS), ("LIGHT_ADJECTIVE", words.LIGHT_ADJECTIVES), ("MIDDLE", words.MIDDLES), ("CORRECTION", words.CORRECTION), ("INSTEAD", words.INSTEAD), ("HELD", words.HELD), ("HELD_THING", words.HELD_THING), ("MATERIAL", words.MATERIAL), ("SWAP_OF", words.SWAP_OF), ("NOR", words.NOR), ("FREE", words.FREE_SPOTS),
        ("CONTENTS", words.CONTENTS),
    ):  # fmt: skip
        lexicon.add_all(phrases, tag, phrases and None)
    for phrase in phrase_list(words.PARTICLES):
        lexicon.add(phrase, "PART", phrase)
    return lexicon


def words_plural(phrase: str) -> str:
    """Return the plural of a noun phrase's last word."""
    return _plural(phrase)


LEXICON = _build()
FILLERS = Phrases()
FILLERS.add_all(words.FILLERS, "FILLER")
EDGE_FILLERS = Phrases()
EDGE_FILLERS.add_all(words.EDGE_FILLERS, "FILLER")
END_FILLERS = Phrases()
END_FILLERS.add_all(words.END_FILLERS, "FILLER")
ASIDE_FILLERS = Phrases()
ASIDE_FILLERS.add_all(words.ASIDE_FILLERS, "FILLER")
START_FILLERS = Phrases()
START_FILLERS.add_all(words.START_FILLERS, "FILLER")

WORDS = frozenset(
    LEXICON.words()
    | FILLERS.words()
    | EDGE_FILLERS.words()
    | END_FILLERS.words()
    | START_FILLERS.words()
    | ASIDE_FILLERS.words()
    | verbs.UNSUPPORTED_VERBS
    | words.QUESTIONS
    | words.CONDITIONS
    | words.GRAMMAR_WORDS
)
MEANING: dict[str, str] = {}
for _name, _table_ in (
    ("noun", words.NOUNS),
    ("colour", words.COLOURS),
    ("size", words.SIZES),
    ("super", words.SUPERLATIVES),
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
    | words.GRAMMAR_WORDS
    | frozenset(w for w in words.UNITS if w.isalpha())
    | frozenset(
        w for verb in _CORE for form in verbs.inflections(verb) if form == verb or form.endswith("ing") for w in [form]
    )
    | frozenset(w for n in words.NUMBERS for w in n.split())
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
    part for noun in words.NOUNS.values() for phrase in phrase_list(noun) for part in words_plural(phrase).split()
)
VOCABULARY = tuple(sorted(word for word in COMMON if len(word) >= 3 and word.isalpha()))

JOINABLE: dict[str, int] = {}
"""Words that are run together in this order: verb, article, colour, noun, particle."""
for _rank, _words in enumerate((
    {"pick", "put", "push", "grab", "stack", "place", "take", "lift"}, {"the", "a"}, {w for c in words.COLOURS.values() for w in phrase_list(c)},
    {w for n in words.NOUNS.values() for w in phrase_list(n) if " " not in w}, {"up", "down", "in", "on", "into", "onto"},
)):  # fmt: skip
    for _word in _words:
        JOINABLE.setdefault(_word, _rank)
