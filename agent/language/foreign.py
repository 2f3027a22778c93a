"""Sentences of languages that are pairs of files in `grammars`: which one it is, what it asks for, how it is refused.

What comes out is the same `Sentence` that the grammar of English gives, so that grounding, prohibitions, ambiguity and
refusals are those of `ground` and `build`.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Protocol, runtime_checkable

from robosandbox.agent.language.binding import Binder
from robosandbox.agent.language.chart import TooComplicatedError
from robosandbox.agent.language.derivation import Derivation
from robosandbox.agent.language.discourse import RefusedError, listed
from robosandbox.agent.language.inflection import logical_lines, spelled
from robosandbox.agent.language.intent import Ref, Sentence
from robosandbox.agent.language.lexicon import WORDS
from robosandbox.agent.language.rulebook import GRAMMARS, Rulebook, bring, languages, rulebook
from robosandbox.agent.language.strain import strain
from robosandbox.agent.language.tokens import MARKS, MAX_CHARACTERS, SceneWords, Token, scene_words
from robosandbox.types import Refusal, RefusalCode

ENGLISH = "english"
# How alike a word has to be to one of the language to be offered for it, a ratio as of difflib, and the number of letters
# up to which none is. Chosen: a slip in a word of six letters.
_NEAR, _SHORT = 0.8, 3
# Share of a sentence's words that a language has to know for it to be that sentence's. Chosen low: what is not known is refused
# in that language, and an English sentence has more words of English.
_LEAST_KNOWN = 1.0 / 3.0
# Number of words of a sentence that is read. Chosen far above a spoken command.
_MOST_WORDS = 60
# Words; ids, which have underscores, are of no language.
_WORD = re.compile(r"(?<![\w_])[^\W\d_]+(?![\w_])")
_PIECE = re.compile(r"(?P<number>\d+(?:[.,]\d+)?)|(?P<word>[^\W\d_]+|°)|(?P<mark>\S)")
_SLOT = re.escape("{}")


@runtime_checkable
class Translated(Protocol):
    """A skill that says how people ask for it in languages that are data."""

    name: str
    translations: Mapping[str, str]


def learn_translations(skills: Iterable[object]) -> None:
    """Take in what skills say for themselves in other languages."""
    for skill in skills:
        if isinstance(skill, Translated) and skill.translations:
            bring(skill.name, skill.translations)


@lru_cache(maxsize=1)
def _signs() -> dict[str, frozenset[str]]:
    """The words by which each language is known, from the first lines of its lexicon; no more of it is read for that."""
    found: dict[str, frozenset[str]] = {}
    for name in languages():
        spelling: dict[str, str] = {}
        words: set[str] = set()
        for _, line in logical_lines((GRAMMARS / f"{name}.lexicon").read_text(encoding="utf-8")):
            kind, _, rest = line.partition(" ")
            if kind == "spelling":
                spelling = {a.strip(): b.strip() for pair in rest.split(",") for a, b in [pair.split("=")]}
            elif kind == "signs":
                words.update(spelled(rest.split(), spelling))
            elif kind == "agree":
                break
        found[name] = frozenset(words)
    return found


def language_of(prompt: str) -> str:
    """Return the name of the language that a sentence is in.

    It is another one than English where it has a word that English lacks, such as an article, and where that language
    knows a third of its words and more of them than English does.
    """
    words = _WORD.findall(prompt[:MAX_CHARACTERS].lower())
    for name, signs in _signs().items():
        if not signs.isdisjoint(words) and _is_in(words, rulebook(name)):
            return name
    return ENGLISH


def _is_in(words: Sequence[str], book: Rulebook) -> bool:
    own = sum(bool(book.lexicon.split(book.lexicon.folded(word))) for word in words)
    return own >= _LEAST_KNOWN * len(words) and own > sum(word in WORDS for word in words)


def read_in(language: str, prompt: str, ids: tuple[str, ...]) -> tuple[tuple[float, Sentence], ...] | Refusal:
    """Return the readings of a sentence in a language that is data, or a refusal that names what was not understood.

    Args:
        language: Its name.
        prompt: What was said.
        ids: Those of the scene.
    """
    book, known = rulebook(language), scene_words(ids)
    if len(prompt) > MAX_CHARACTERS:
        return _unrecognized("That is too complicated for me; please say it in shorter sentences.")
    tokens = _kept(_tokens(prompt, known, book), book)
    if not tokens:
        return _unrecognized("Tell me what to do, for example: pick up the red cube.")
    if len(tokens) > _MOST_WORDS:
        return _unrecognized("That is too complicated for me; please say it in shorter sentences.")
    chart = Derivation(tokens, known, book)
    try:
        sentences = chart.sentences()
        if not sentences:
            # Whoever learns the language may have a noun's gender wrong.
            lenient = Derivation(tokens, known, book, lenient=True)
            chart, sentences = (lenient, found) if (found := lenient.sentences()) else (chart, sentences)
    except TooComplicatedError:
        return _unrecognized("That is too complicated for me; please say it in shorter sentences.")
    bound: list[Sentence] = []
    refused: Refusal | None = None
    for sentence in sentences:
        try:
            made = Binder(chart.genders, book.lexicon).bound(sentence)
            bound += [made] if made is not None else []
        except RefusedError as error:
            refused = refused or error.refusal
    if bound:
        ranked = [(strain(sentence, chart.strains), sentence) for sentence in dict.fromkeys(bound)]
        return tuple(sorted(ranked, key=lambda reading: reading[0]))
    return refused or _not_understood(chart, book)


def thing_in(language: str, prompt: str, ids: tuple[str, ...]) -> Ref | None:
    """Return the description that a whole prompt is, if it is one: an answer to a question."""
    book, known = rulebook(language), scene_words(ids)
    tokens = _kept(_tokens(prompt[:MAX_CHARACTERS], known, book), book)
    if not tokens or len(tokens) > _MOST_WORDS:
        return None
    chart = Derivation(tokens, known, book)
    try:
        found = [fields[0].value for end, fields, _ in chart.rule("thing", (), 0) if chart.is_over(end)]
    except TooComplicatedError:
        return None
    return found[0] if found and found[0].determiner != "it" else None


def says_in_turn(language: str, prompt: str) -> bool:
    """Say whether a word tells that one step follows another."""
    lexicon = rulebook(language).lexicon
    return any(lexicon.is_form(lexicon.folded(word), "THEN") for word in _WORD.findall(prompt))


def told_in(language: str, refusal: Refusal) -> Refusal:
    """Return a refusal in a language, where its lexicon has the words for it."""
    for english, own in rulebook(language).lexicon.says:
        match = re.fullmatch(re.escape(english).replace(_SLOT, "(.+?)"), refusal.message)
        if match:
            return refusal.model_copy(
                update={"message": own.format(*(_listed_in(language, t) for t in match.groups()))}
            )
    return refusal


def _listed_in(language: str, text: str) -> str:
    """Return "a, b and c" with the language's own word between the last two."""
    words = rulebook(language).lexicon.classes
    last, word = next(((w, name) for w, name in ((" and ", "AND"), (" or ", "OR")) if w in text), ("", ""))
    if not last or word not in words:
        return text
    return text.replace(last, f" {next(iter(words[word].values()))[0]} ")


def _tokens(prompt: str, known: SceneWords, book: Rulebook) -> Iterator[Token]:
    start = 0
    for match in known.pattern.finditer(prompt) if known.pattern else ():
        yield from _pieces(prompt[start : match.start()], known, book)
        yield Token(known.ids[match[0].lower()], match[0], "id")
        start = match.end()
    yield from _pieces(prompt[start:], known, book)


def _pieces(text: str, known: SceneWords, book: Rulebook) -> Iterator[Token]:
    for match in _PIECE.finditer(text):
        raw = match[0]
        match match.lastgroup:
            case "number":
                yield Token(raw.replace(",", "."), raw, "number")
            case "word":
                word = book.lexicon.folded(raw)
                parts = book.lexicon.split(word)
                # A word of an id is that before it is anything put together.
                if len(parts) < 2 or (word in known.parts and word not in book.lexicon.contractions):
                    yield Token(word, raw, "word")
                else:
                    yield from (Token(part, raw if k == 0 else "", "word") for k, part in enumerate(parts))
            case _:
                yield Token(raw, raw, "mark")


def _kept(tokens: Iterator[Token], book: Rulebook) -> tuple[Token, ...]:
    """Return the tokens without those of the classes that say nothing: SKIP, THEN, and FIRST in the first clause."""
    told = tuple(tokens)
    kept: list[Token] = []
    i = 0
    while i < len(told):
        hits = {name: end for end, name, _ in book.lexicon.phrases.at(told, i)}
        names = ["SKIP", "THEN"] if any(_joins(token, book) for token in kept) else ["SKIP", "THEN", "FIRST"]
        ends = [hits[name] for name in names if name in hits]
        counted = bool(kept) and kept[-1].kind == "number"
        if ends and not counted:
            i = max(ends)
        elif told[i].text == "," and (not kept or kept[-1].kind == "mark"):
            i += 1
        elif told[i].kind == "mark" and kept and kept[-1].text == ",":
            kept[-1] = told[i]
            i += 1
        else:
            kept.append(told[i])
            i += 1
    return tuple(kept)


def _joins(token: Token, book: Rulebook) -> bool:
    return token.text in MARKS or book.lexicon.is_form(token.text, "AND")


def _not_understood(chart: Derivation, book: Rulebook) -> Refusal:
    tokens, lexicon = chart.tokens, book.lexicon
    if tokens[0].kind == "word" and (
        lexicon.is_form(tokens[0].text, "QUESTION") or lexicon.is_form(tokens[0].text, "BE")
    ):
        return Refusal(
            code=RefusalCode.UNSUPPORTED,
            message="Questions are answered in English only; I carry out orders in this language.",
        )
    if any(tokens[end - 1 :] and chart.is_over(end) for end, _, _ in chart.rule("things", (), 0)):
        said = " ".join(token.raw for token in tokens if token.kind != "mark")
        return Refusal(code=RefusalCode.AMBIGUOUS, message=f"What should I do with “{said}”?")
    known = lexicon.words | book.words | chart.words.parts
    strange = [token.raw for token in tokens if token.kind == "word" and token.text not in known]
    if not strange and chart.reach < len(tokens) and tokens[chart.reach].kind != "mark":
        strange = [tokens[chart.reach].raw]
    if not strange:
        return _unrecognized(
            f"I know the words but not the sentence “{chart.said(0, len(tokens))}”; please say it differently."
        )
    quoted = listed([f"“{word}”{_perhaps(word, book)}" for word in strange])
    return _unrecognized(f"I do not understand {quoted} here.", strange)


def _perhaps(word: str, book: Rulebook) -> str:
    said = book.lexicon.folded(word)
    near = difflib.get_close_matches(said, book.lexicon.words, n=1, cutoff=_NEAR) if len(said) > _SHORT else []
    return f" ({near[0]}?)" if near and near[0] != said else ""


def _unrecognized(message: str, candidates: Sequence[str] = ()) -> Refusal:
    return Refusal(code=RefusalCode.UNRECOGNIZED, message=message, candidates=tuple(candidates), sure=False)
