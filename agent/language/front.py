"""A sentence of a language that is a pair of files: its readings, or a refusal that names what was not understood."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import Protocol, runtime_checkable

from robosandbox.agent.language.binding import Binder
from robosandbox.agent.language.chat import add_chat
from robosandbox.agent.language.discourse import RefusedError, listed
from robosandbox.agent.language.intent import Sentence
from robosandbox.agent.language.logic import Question, Reply
from robosandbox.agent.language.parser import Parser, TooComplicatedError
from robosandbox.agent.language.ruleset import COSTS, GRAMMARS, Ruleset, bring, languages, ruleset
from robosandbox.agent.language.scene_words import SceneWords, scene_words
from robosandbox.agent.language.skill_words import Worded, known_verbs, learn, lines_of, ways_of
from robosandbox.agent.language.text import ENDS, MAX_CHARACTERS, Said, TooLongError, classes_of, said
from robosandbox.agent.language.vocabulary import Token, logical_lines, spelled
from robosandbox.types import Refusal, RefusalCode

ENGLISH = "english"
VERBS_FOR_PEOPLE = "pick up, place, stack, push, pour, open, close, tap, swap, sort, go home"
# How alike a word has to be to one of the language to be offered for it, a share, and the number of letters
# up to which none is: a slip in a word of six letters.
_NEAR, _SHORT = 0.8, 3
# Share of a sentence's words that a language has to know for it to be that sentence's: what is not known is refused in that
# language, and an English sentence has more words of English.
_LEAST_KNOWN = 1.0 / 3.0
# Words; ids, which have underscores, are of no language.
_WORD = re.compile(r"(?<![\w_])[^\W\d_]+(?![\w_])")
# Number of words among which a question without its mark has one of a question: "could you please tell me where it is".
_OPENING = 4
_OF_THE_HAND = "“move up 5 cm”, “hover over” and a thing, “open the gripper to 4 cm” or “turn the hand by 90 degrees”"
_SLOT = re.escape("{}")
Readings = tuple[tuple[float, Sentence], ...]


@runtime_checkable
class Translated(Protocol):
    """A skill that says how people ask for it in languages that are data."""

    name: str
    translations: Mapping[str, str]


def learn_words(skills: Iterable[object]) -> None:
    """Take in what skills say for themselves, in each language; a plan still calls only what its planner was given."""
    known = tuple(skills)
    learn(known)
    for skill in known:
        if isinstance(skill, Translated) and skill.translations:
            bring(skill.name, skill.translations)
        if isinstance(skill, Worded) and skill.words:
            ways = skill.words if isinstance(skill.words, tuple) else (skill.words,)
            bring(f"{skill.name}, words", {ENGLISH: lines_of(skill.name, ways)})


@lru_cache(maxsize=2)
def _signs(of: str = "signs") -> dict[str, frozenset[str]]:
    """The words by which each language is known, or a question of it, from the first lines of its lexicon; no more of it is read."""
    found: dict[str, frozenset[str]] = {}
    for name in languages():
        spelling: dict[str, str] = {}
        words: set[str] = set()
        for _, line in logical_lines((GRAMMARS / f"{name}.lexicon").read_text(encoding="utf-8")):
            kind, _, rest = line.partition(" ")
            if kind == "spelling":
                spelling = {a.strip(): b.strip() for pair in rest.split(",") for a, b in [pair.split("=")]}
            elif kind == of:
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
        if not signs.isdisjoint(words):
            vocabulary = ruleset(name).vocabulary
            own = sum(bool(vocabulary.split(vocabulary.folded(word))) for word in words)
            known = ruleset(ENGLISH).known
            if own >= _LEAST_KNOWN * len(words) and own > sum(word in known for word in words):
                return name
    return ENGLISH


def _may_ask(language: str, prompt: str) -> bool:
    """Say whether a sentence ends or begins as questions do; most orders do not."""
    first = _WORD.findall(prompt[:MAX_CHARACTERS].lower())[:_OPENING]
    return "?" in prompt or not _signs("asks")[language].isdisjoint(first)


def read_in(language: str, prompt: str, ids: tuple[str, ...]) -> Readings | Refusal:
    """Return the readings of a sentence, the plainest first, or a refusal that names what was not understood.

    Args:
        language: Its name.
        prompt: What was said.
        ids: Those of the scene.
    """
    return _read_by(ruleset(language), prompt, ids)


# By the rules themselves: a skill that brings its words makes other ones of them, and what was read before is read anew.
@lru_cache(maxsize=32)
def _read_by(book: Ruleset, prompt: str, ids: tuple[str, ...]) -> Readings | Refusal:
    words = scene_words(ids)
    try:
        told = said(prompt, words, book)
        if not told.tokens:
            return _unrecognized("Tell me what to do, for example: pick up the red cube.")
        parser, readings = _read(told, words, book)
        if book.vocabulary.has_gender and not readings:
            # Whoever learns the language may have a noun's gender wrong.
            lenient, readings = _read(told, words, book, lenient=True)
            parser = lenient if readings else parser
        if not readings and any(token.text == "er" for token in told.tokens):
            told = Said(tuple(_without_hesitations(told.tokens)), told.manners)
            parser, readings = _read(told, words, book)
            # "on the tray, er, to the left": a hesitation only where the rest is plain.
            readings = [reading for reading in readings if reading[0] <= COSTS[1]]
        if not readings or readings[0][0] >= COSTS[-1]:
            mended = said(prompt, words, book, mend=True)
            if mended.tokens and mended.tokens != told.tokens:
                told = mended
                parser, better = _read(told, words, book)
                readings = sorted([*better, *readings], key=lambda reading: reading[0])
    except TooLongError as error:
        return _unrecognized(f"That is too long to be one command ({error}); say it in a few sentences.")
    except TooComplicatedError:
        return _unrecognized("That is too complicated for me; please say it in shorter sentences.")
    bound: dict[Sentence, float] = {}
    refused: Refusal | None = None
    binder_of = parser.genders
    for cost, sentence in readings:
        try:
            made = Binder(binder_of, book.vocabulary).bound(sentence)
            bound.setdefault(replace(made, manners=told.manners), cost)
        except RefusedError as error:
            refused = refused or error.refusal
    if bound:
        return tuple((cost, sentence) for sentence, cost in bound.items())
    return refused or _not_understood(parser, book, words)


def questions_in(language: str, prompt: str, ids: tuple[str, ...]) -> tuple[Question, ...] | Refusal:
    """Return what a sentence may ask, the plainest first, or a refusal of a question that is not known; nothing for an order.

    Args:
        language: Its name.
        prompt: What was said.
        ids: Those of the scene.
    """
    return _asked_by(ruleset(language), prompt, ids) if _may_ask(language, prompt) else ()


@lru_cache(maxsize=32)
def _asked_by(book: Ruleset, prompt: str, ids: tuple[str, ...]) -> tuple[Question, ...] | Refusal:
    words = scene_words(ids)
    try:
        told = said(prompt, words, book)
        if not told.tokens:
            return ()
        parser = Parser(told.tokens, book, classes_of(told.tokens, words, book))
        readings = parser.readings("question")
        if not readings or readings[0][0] >= COSTS[-1]:
            mended = said(prompt, words, book, mend=True)
            again = Parser(mended.tokens, book, classes_of(mended.tokens, words, book))
            # "how many friends do you see": what is set right to a greeting was none.
            better = again.readings("question") if len(mended.tokens) >= len(told.tokens) else []
            readings = sorted([*better, *readings], key=lambda reading: reading[0])
    except (TooLongError, TooComplicatedError):
        return ()
    if readings and told.manners:
        return _unsupported(f"I do not know what {_quoted(told.manners)} asks here; say the question without it.")
    if readings or told.tokens[-1].text != "?" or not parser.rule("no_order", 0):
        return tuple(question for _, question in readings)
    operators = book.vocabulary.lists.get("always", frozenset()) | book.vocabulary.lists.get("operators", frozenset())
    bare = [token.raw for token in told.tokens if token.text in operators]
    if bare:
        return _unsupported(f"I do not know what {_quoted(bare)} asks here; say the question without it.")
    strange = [
        t.raw for t in told.tokens if t.kind == "word" and t.text not in book.known and t.text not in words.parts
    ]
    strange = strange or [token.raw for token in told.tokens[parser.reach :][:1] if token.kind == "word"]
    return _unsupported(
        "I say where things are, how many, how big, how far apart and what holds of them, and not "
        f"{_quoted(strange) if strange else 'this'}."
    )


def _quoted(words: Sequence[str]) -> str:
    return listed([f"“{word}”" for word in words], "or")


def _without_hesitations(tokens: Sequence[Token]) -> Iterator[Token]:
    """Yield the tokens without "er" and the pauses around it: "put the cube, er, in the bin" takes nothing back."""
    texts = ["", *(token.text for token in tokens), ""]
    for k, token in enumerate(tokens, 1):
        if token.text != "er" and not (token.text == "," and "er" in (texts[k - 1], texts[k + 1])):
            yield token


def _read(
    told: Said, words: SceneWords, book: Ruleset, *, lenient: bool = False
) -> tuple[Parser, list[tuple[float, Sentence]]]:
    classes = classes_of(told.tokens, words, book, lenient=lenient)
    add_chat(classes, told.tokens, words, book)
    parser = Parser(told.tokens, book, classes)
    readings = [(cost, sentence) for cost, sentence in parser.readings() if sentence.steps or sentence.avoid]
    if lenient:
        parser.genders.clear()
    return parser, readings


def reply_in(language: str, prompt: str, ids: tuple[str, ...]) -> Reply | None:
    """Return what a prompt says that is no sentence of its own; None where it is one."""
    book, words = ruleset(language), scene_words(ids)
    try:
        told = said(prompt[:MAX_CHARACTERS], words, book)
        found = Parser(told.tokens, book, classes_of(told.tokens, words, book)).readings("reply")
    except (TooLongError, TooComplicatedError):
        return None
    return found[0][1] if found and not told.manners else None


def says_in_turn(language: str, prompt: str) -> bool:
    """Say whether a word tells that one step follows another."""
    vocabulary = ruleset(language).vocabulary
    return any(vocabulary.is_form(vocabulary.folded(word), "IN_TURN") for word in _WORD.findall(prompt))


def told_in(language: str, refusal: Refusal) -> Refusal:
    """Return a refusal in a language, where its lexicon has the words for it."""
    for english, own in ruleset(language).vocabulary.says:
        match = re.fullmatch(re.escape(english).replace(_SLOT, "(.+?)"), refusal.message)
        if match:
            return refusal.model_copy(
                update={"message": own.format(*(_listed_in(language, t) for t in match.groups()))}
            )
    return refusal


def _listed_in(language: str, text: str) -> str:
    """Return "a, b and c" with the language's own word between the last two."""
    words = ruleset(language).vocabulary.classes
    last, word = next(((w, name) for w, name in ((" and ", "AND"), (" or ", "OR")) if w in text), ("", ""))
    if not last or word not in words:
        return text
    return text.replace(last, f" {next(iter(words[word].values()))[0]} ")


def _not_understood(parser: Parser, book: Ruleset, words: SceneWords) -> Refusal:
    """Say which part was not understood, or why it cannot be done."""
    tokens, classes = parser.tokens, parser.classes
    strange = [t.raw for t in tokens if t.kind == "word" and t.text not in book.known and t.text not in words.parts]
    quoted = [f"“{word}”{_perhaps(word, book)}" for word in strange]
    if {"QUESTION", "BE"} & {*classes[0]} and book.vocabulary.has_gender:
        return _unsupported("Questions are answered in English only; I carry out orders in this language.")
    if "QUESTION" in classes[0]:
        return _unsupported(
            "I say where things are, how many, how big, how far apart and what holds of them, and not "
            f"{listed(quoted, 'or') if quoted else 'this'}; or tell me what to do."
        )
    if not strange and any(_is_over(tokens, reading.end) for reading in parser.rule("things", 0) if reading.end):
        told = " ".join(token.raw for token in tokens if token.kind != "mark")
        return Refusal(code=RefusalCode.AMBIGUOUS, message=f"What should I do with “{told}”?")
    refusal = _unable(parser, book, words)
    if refusal is not None:
        return refusal
    condition = next((k for k, hits in enumerate(classes) if {"IF", "UNLESS", "UNTIL"} & {*hits}), None)
    if condition is not None and not book.vocabulary.has_gender:
        told = f"{listed(quoted)} after" if quoted else "what follows"
        return _unsupported(
            f"I cannot make out {told} “{tokens[condition].raw}”: I follow conditions on what is there, where it is and how it looks."
        )
    if (
        not strange
        and parser.reach < len(tokens)
        and tokens[parser.reach].kind != "mark"
        and book.vocabulary.has_gender
    ):
        strange = [tokens[parser.reach].raw]
        quoted = [f"“{word}”{_perhaps(word, book)}" for word in strange]
    if not strange:
        return _unrecognized(
            f"I know the words but not the sentence “{parser.said(0, len(tokens))}”; please say it differently."
        )
    return _unrecognized(f"I do not understand {listed(quoted)} here.", strange)


def _unable(parser: Parser, book: Ruleset, words: SceneWords) -> Refusal | None:
    """Say which verb no skill has, or what stays where it is; None where there is no such thing."""
    tokens, classes, acting = parser.tokens, parser.classes, book.vocabulary.lists.get("cues", frozenset())
    base = book.vocabulary.bits.get(("base",), 0)
    for k, hits in enumerate(classes):
        begins = k == 0 or tokens[k - 1].text in ENDS or tokens[k - 1].text in acting
        verbs = [name for name in hits if name[0] == "V" and name != "VCANNOT"]
        if (
            begins
            and any(hit.mask & base for hit in (*hits.get("VCANNOT", ()), *hits.get("VTHROW", ())))
            and (not verbs or k == 0)
            and tokens[k].text not in words.parts
        ):
            if tokens[k].text in known_verbs():
                return _unrecognized(f"To {tokens[k].raw} takes a thing, and how: say which and how far, or where to.")
            return _unsupported(f"I cannot “{tokens[k].raw}”; I can {VERBS_FOR_PEOPLE}.")
        if "FLOOR" in hits and tokens[k].text not in words.parts:
            return Refusal(code=RefusalCode.IMPOSSIBLE, message="The floor is out of my reach; I work on the table.")
        for end in {hit.end for name in verbs for hit in hits[name]}:
            start = end + 1 if end < len(tokens) and "THE" in classes[end] else end
            moved = classes[start] if start < len(tokens) else {}
            if "TABLE" in moved and begins:
                return Refusal(code=RefusalCode.IMPOSSIBLE, message="The table stays where it is.")
            if "ARM" in moved and begins:
                told = tokens[start].raw
                if ways_of("move_by"):
                    return _unrecognized(
                        f"I do not understand what to do with the {told}; say for example {_OF_THE_HAND}."
                    )
                return _unsupported(f"I move the {told} as the skills need it; I can {VERBS_FOR_PEOPLE}.")
    if "NOT" in classes[0]:
        return _unsupported(
            "That asks me to leave something undone, and I had not begun anything; say it beside an order, "
            "or name what I must not touch."
        )
    # "make me a coffee", but "build me a tower"
    giving = ("VGIVE", "VPICK", "VMOVE", "VGIVE" if any("TOWER" in hits for hits in classes) else "VBUILD")
    if any("RECIPIENT" in hits and not {*giving}.isdisjoint(before) for before, hits in pairwise(classes)):
        return _unsupported(f"I cannot hand things over; I can {VERBS_FOR_PEOPLE}.")
    for end in {hit.end for hit in classes[0].get("VPUT", ())}:
        ends = [
            r.end
            for r in parser.rule("things", end)
            if _is_over(tokens, r.end) and not any(ref.relations for ref in r.fields[0].value)
        ]
        if ends:
            told = parser.said(end, max(ends))
            return Refusal(code=RefusalCode.AMBIGUOUS, message=f"Where should “{told}” go?")
    return None


def _is_over(tokens: Sequence[Token], i: int) -> bool:
    return all(token.kind == "mark" for token in tokens[i:])


def _unsupported(message: str) -> Refusal:
    return Refusal(code=RefusalCode.UNSUPPORTED, message=message, sure=False)


def _perhaps(word: str, book: Ruleset) -> str:
    from rapidfuzz import process
    from rapidfuzz.distance import Indel

    folded = book.vocabulary.folded(word)
    # Of two that are as near the first by letters, and not the first of a set, whose order changes from run to run.
    known = sorted(book.vocabulary.words) if len(folded) > _SHORT else ()
    near = process.extractOne(folded, known, scorer=Indel.normalized_similarity, score_cutoff=_NEAR)
    return f" ({near[0]}?)" if near and near[0] != folded else ""


def _unrecognized(message: str, candidates: Sequence[str] = ()) -> Refusal:
    return Refusal(code=RefusalCode.UNRECOGNIZED, message=message, candidates=tuple(candidates), sure=False)
