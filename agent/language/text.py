"""From text to tokens in a language, and which classes of its words begin at each."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

from robosandbox.agent.language.real_words import REAL_WORDS
from robosandbox.agent.language.ruleset import Ruleset
from robosandbox.agent.language.scene_words import SceneWords, id_parts
from robosandbox.agent.language.vocabulary import EVERYTHING, Hit, Token, Vocabulary

# Characters and words of a prompt: far above a spoken command.
MAX_CHARACTERS, MAX_TOKENS = 2_000, 120
# Number of letters up to which a word may have one slip, not two; shorter ones than the least are never mended.
LONG_WORD, LEAST_LETTERS = 7, 3
_MARKS = str.maketrans({
    "’": "'", "‘": "'", "`": "'", "–": " - ", "—": " , ", "→": " -> ", "…": " , ", "×": "x", "−": "-",
    "&": " and ", "\n": " . ", "•": " . ", "*": " . ", "“": " ", "”": " ", "„": " ",
})  # fmt: skip
_PIECE = re.compile(
    r"(?P<ordinal>\d+(?:st|nd|rd|th)\b)|(?P<number>(?<![\w.])[-+]?(?:\d+\.\d+|\d+|\.\d+))|(?P<numeral>(?<=[^\W\d_])\d+)"
    r"|(?P<mark>->|[,.;:!?()=\[\]+])|(?P<word>[^\W\d_]+(?:_[^\W_]+)*|°)|(?P<other>\S)"
)
_KINDS = {"numeral": "number", "ordinal": "word", "other": "mark"}
ENDS = frozenset(",.;:!?")
_NOUNS = frozenset({"NOUN", "COLOUR", "ONE", "COLOURED", "TOWER"})
_STOPS = ENDS - {","}
# Letters that lie beside each other: a finger slips to these, and writes no other word that was meant.
_ROWS = ("qwertyuiop", "asdfghjkl", "zxcvbnm")
_BESIDE = frozenset(
    frozenset(pair)
    for k, row in enumerate(_ROWS)
    for pair in (*pairwise(row), *(p for below in _ROWS[k + 1 : k + 2] for shift in (0, 1) for p in zip(row[shift:], below, strict=False)))
)  # fmt: skip


class TooLongError(ValueError):
    """Longer than anybody would say."""


class Said(NamedTuple):
    """A sentence as tokens.

    Attributes:
        tokens: Those that rules account for.
        manners: Words of speed and care, which no skill is told: a plan is made, and its note says so.
    """

    tokens: tuple[Token, ...]
    manners: tuple[str, ...]


def said(prompt: str, words: SceneWords, book: Ruleset, *, mend: bool = False) -> Said:
    """Return the tokens of a text.

    Args:
        prompt: The text.
        words: Those of the scene's ids, which count as known.
        book: The language.
        mend: Take a word that nobody knows for the one that it is a slip of.

    Raises:
        TooLongError: It is longer than anybody would say.
    """
    if len(prompt) > MAX_CHARACTERS:
        raise TooLongError(f"{len(prompt):,} characters")
    found: list[Token] = []
    start = 0
    for match in words.pattern.finditer(prompt) if words.pattern else ():
        found += _pieces(prompt[start : match.start()], book.vocabulary)
        found.append(Token(words.ids[match[0].lower()], match[0], "id"))
        start = match.end()
    found += _pieces(prompt[start:], book.vocabulary)
    told = list(
        _joined(
            [
                part
                for k, token in enumerate(found)
                for part in _known(token, words, book, mend and not is_called(found, k))
            ],
            words,
        )
    )
    if len(told) > MAX_TOKENS:
        raise TooLongError(f"{len(told)} words")
    return _without_courtesies(told, words, book.vocabulary)


def _pieces(text: str, vocabulary: Vocabulary) -> Iterator[Token]:
    raw = unicodedata.normalize("NFKC", text).translate(_MARKS)
    lower = raw.lower()
    for pattern, by in vocabulary.writes:
        lower = pattern.sub(by, lower)
    written: dict[str, str] = {}
    for match in _PIECE.finditer(raw):
        written.setdefault(match[0].lower(), match[0])
    for match in _PIECE.finditer(lower):
        kind = match.lastgroup or "word"
        if kind == "other" and unicodedata.category(match[0]) in ("So", "Sk", "Mn", "Cf"):
            # A smile adds nothing.
            continue
        yield Token(match[0], written.get(match[0], match[0]), _KINDS.get(kind, kind))


def _known(token: Token, words: SceneWords, book: Ruleset, mend: bool) -> Iterator[Token]:
    """Yield a token in its normal form: as the words that it is put together of, or the one that it is a slip of."""
    if token.kind != "word":
        yield token
        return
    word = book.vocabulary.folded(token.text)
    if word in words.parts and word not in book.vocabulary.contractions:
        yield Token(word, token.raw, "word")
        return
    parts = book.vocabulary.split(word) or _run_together(words).get(word, ())
    if mend and "_" in word:
        from rapidfuzz.distance import OSA

        named = sorted((OSA.distance(word, name, score_cutoff=2), name) for name in words.ids)
        if named and named[0][0] <= 2 and (len(named) == 1 or named[1][0] > named[0][0]):
            yield Token(words.ids[named[0][1]], token.raw, "id")
            return
    if not parts and mend and word not in book.known and word not in named_in(words, book.vocabulary):
        parts = (nearest(word, book, words) or word,)
    for k, part in enumerate(parts or (word,)):
        yield Token(part, token.raw if k == 0 else "", "word")


def is_called(tokens: Sequence[Token], k: int) -> bool:
    """Say whether a word is written as a name and set apart, as who is spoken to is: no slip of anything."""
    return tokens[k].raw[:1].isupper() and k + 1 < len(tokens) and tokens[k + 1].text == ","


def _joined(tokens: Sequence[Token], words: SceneWords) -> Iterator[Token]:
    """Yield the tokens with "frying pan" as the scene's "frypan"."""
    i = 0
    while i < len(tokens):
        pair = tokens[i : i + 2]
        one = "".join(token.text.removesuffix("ing") if token is pair[0] else token.text for token in pair)
        whole = next((name for name in ("".join(token.text for token in pair), one) if name in words.parts), "")
        apart = all(token.text in words.parts for token in pair)
        if len(pair) == 2 and whole and not apart and all(t.kind == "word" and len(t.text) > 2 for t in pair):
            yield Token(whole, f"{pair[0].raw} {pair[1].raw}", "word")
            i += 2
        else:
            yield tokens[i]
            i += 1


@lru_cache(maxsize=256)
def _run_together(words: SceneWords) -> Mapping[str, tuple[str, str]]:
    """Return the pairs of words of ids that people write as one."""
    names = (pairwise(id_parts(name)) for name in words.ids.values())
    return {a + b: (a, b) for pairs in names for a, b in pairs if a.isalpha() and b.isalpha()}


@lru_cache(maxsize=256)
def named_in(words: SceneWords, vocabulary: Vocabulary) -> Mapping[str, tuple[str, int]]:
    """Return the words of a scene's ids, inflected as the language's names are, with what each agrees with."""
    # "the cookie box" for what is called cookies
    singles = {
        part[:-1]: (part, vocabulary.singular)
        for part in words.parts
        if len(part) > 3 and part.endswith("s") and not part.endswith("ss")
    }
    return singles | {
        form: (part, mask) for part in sorted(words.parts) for form, mask in vocabulary.named(part).items() if form not in words.parts
    } | {part: (part, vocabulary.named(part)[part]) for part in words.parts}  # fmt: skip


@lru_cache(maxsize=4096)
def nearest(word: str, book: Ruleset, words: SceneWords) -> str | None:
    """Return the one known word that this is a slip of: letters more, less, swapped, or other ones beside them."""
    from rapidfuzz.distance import OSA

    lists = book.vocabulary.lists
    operators = (lists[name] for name in ("operators", "always", "bearing", "binding") if name in lists)
    if len(word) < LEAST_LETTERS or not word.isalpha() or word in REAL_WORDS or any(word in each for each in operators):
        return None
    most = 1 if len(word) < LONG_WORD else 2
    names = named_in(words, book.vocabulary)
    # "bone" is a thing that is not there, and no slip of "one".
    pronouns = lists.get("pronouns", frozenset[str]())
    near: list[tuple[float, str]] = []
    begun = (other for letter in {*word[:2]} for other in book.by_letter.get(letter, ()))
    for known in {*(name for name in names if name[0] in word[:2]), *begun}:
        if abs(len(known) - len(word)) > 2 or len(known) < LEAST_LETTERS:
            continue
        # What is in the scene is known by its consonants: "froot", "notebk".
        most_here = 2 if known in names and _consonants(known) == _consonants(word) else most
        far = OSA.distance(word, known, score_cutoff=most_here)
        same = sorted(known) == sorted(word)
        if far <= most_here and (known in names or (_slipped(word, known) and (same or known not in pronouns))):
            near.append(
                (
                    far
                    - 0.5 * (known in names)
                    - 0.25 * (same or _lacks_letters(word, known))
                    + 0.25 * (known[0] != word[0])
                    - 0.1 * (known[-1] == word[-1]),
                    known,
                )
            )
    near.sort()
    return near[0][1] if near and (len(near) == 1 or near[1][0] > near[0][0]) else None


def _consonants(word: str) -> str:
    return word[0] + "".join(letter for letter in word[1:] if letter not in "aeiou")


def _lacks_letters(word: str, known: str) -> bool:
    left = iter(known)
    return len(word) < len(known) and all(letter in left for letter in word)


def _slipped(word: str, known: str) -> bool:
    """Say whether a word may be typed for a known one: where letters are other ones, they lie beside those."""
    if len(word) != len(known) or sorted(word) == sorted(known):
        return True
    other = [frozenset(pair) for pair in zip(word, known, strict=True) if pair[0] != pair[1]]
    return all(pair in _BESIDE or pair <= frozenset("aeiouy") for pair in other)


def _without_courtesies(told: Sequence[Token], words: SceneWords, vocabulary: Vocabulary) -> Said:
    """Return the tokens without greetings, thanks and hesitations, and those of manner apart; of marks that meet one stays.

    What says that the order of the words is that of doing goes as well, where a language has it as IN_TURN and AT_FIRST.
    """
    kept: list[Token] = []
    manners: list[str] = []
    i = 0
    while i < len(told):
        token = told[i]
        hits = list(vocabulary.at(told, i))
        verbs = [(name, hit.end) for name, hit in hits if name.startswith("V_")]
        own = max(
            (hit.end for verb, end in verbs for name, hit in vocabulary.at(told, end) if name == f"WITH_{verb}"),
            default=i,
        )
        if own > i:
            # "go half as fast", "slow down": no word of a skill's own verb goes.
            kept += told[i:own]
            i = own
            continue
        joined = any(each.text in ENDS or vocabulary.is_form(each.text, "AND") for each in kept)
        passing = ("COURTESY", "MANNER", "IN_TURN" if joined else "AT_FIRST")
        ends = {name: hit.end for name, hit in hits if name in passing}
        following = told[max(ends.values())].text if ends and max(ends.values()) < len(told) else ""
        described = kept and kept[-1].text in vocabulary.lists.get("determiners", ())
        # "the gentle giant" is called so, "a gentle push" is how.
        stroke = "MANNER" in ends and vocabulary.is_form(following, "LIGHT_NOUN")
        named = token.text in words.parts or (described and not stroke)
        if ends and not named and not (kept and kept[-1].text in vocabulary.lists.get("deniers", ())):
            name, end = max(ends.items(), key=lambda pair: pair[1])
            if name == "MANNER":
                manners.append(" ".join(each.raw for each in told[i:end] if each.raw))
            i = end
            continue
        if vocabulary.is_form(token.text, "HESITATION"):
            # Between two pauses it may take back what was said before.
            if kept and kept[-1].text in ENDS and told[i + 1 : i + 2] and told[i + 1].text == ",":
                kept.append(Token("er", token.raw, "word"))
            i += 1
            continue
        if token.text in ENDS and (not kept or kept[-1].text in ENDS):
            if kept and kept[-1].text == ",":
                kept[-1] = token
        else:
            kept.append(token)
        i += 1
    while kept and kept[-1].text in ENDS and kept[-1].text != "?":
        kept.pop()
    return Said(tuple(kept), tuple(manners))


Classes = dict[str, list[Hit]]


def classes_of(tokens: Sequence[Token], words: SceneWords, book: Ruleset, *, lenient: bool = False) -> list[Classes]:
    """Return the hits of each class that begin at each token.

    Args:
        tokens: The sentence.
        words: Those of the scene's ids.
        book: The language.
        lenient: A noun stands for every gender: who learns the language may have it wrong.
    """
    found: list[Classes] = []
    vocabulary = book.vocabulary
    for i, token in enumerate(tokens):
        here: Classes = {}
        for name, hit in vocabulary.at(tokens, i):
            if lenient and name == "NOUN":
                hit = hit._replace(mask=vocabulary.same_case(hit.mask))
            here.setdefault(name, []).append(hit)
        match token.kind:
            case "id":
                here["ID"] = [Hit(i + 1, token.text, vocabulary.singular)]
            case "number":
                number = float(token.text)
                here["NUMERAL"] = [Hit(i + 1, int(number) if number.is_integer() else number, EVERYTHING)]
                if token.text in words.parts:
                    here["SUFFIX"] = [Hit(i + 1, token.text, vocabulary.singular)]
            case "mark" if token.text in ENDS:
                here["MARK"] = [Hit(i + 1, token.text, EVERYTHING)]
                if token.text in _STOPS:
                    here["END"] = [Hit(i + 1, token.text, EVERYTHING)]
            case "word":
                _add_word(here, tokens, i, words, book)
        found.append(here)
    return found


def _add_word(here: Classes, tokens: Sequence[Token], i: int, words: SceneWords, book: Ruleset) -> None:
    """Add what a word is by the ids of the scene, or that nobody knows it."""
    word, vocabulary = tokens[i].text, book.vocabulary
    here["WORD"] = [Hit(i + 1, word, EVERYTHING)]
    following = tokens[i + 1].text if i + 1 < len(tokens) else ""
    if word in words.ids and i and tokens[i - 1].text in vocabulary.lists.get("articles", ()):
        # "the orange and the red mug": the fruit, unless a noun comes behind it.
        behind = {name for name, _ in vocabulary.at(tokens, i + 1)}
        if following not in words.parts and not behind & _NOUNS:
            here.pop("COLOUR", None)
    named = named_in(words, vocabulary)
    function = vocabulary.lists.get("function", frozenset())
    if word in named and len(word) > 1:
        part, mask = named[word]
        called = any(hit.value == word for hit in here.get("NOUN", ()))
        own = word in words.parts and "NOUN" in here and not called
        plain = own or ("NOUN" not in here and "COLOUR" not in here and word not in function)
        if own or (plain and word in words.parts):
            here.pop("NOUN", None)
        hue = word in words.hues and following not in vocabulary.lists.get("pronouns", ())
        packed = following in vocabulary.lists.get("packages", ()) and following not in words.parts
        if word in vocabulary.lists.get("sides", ()):
            here["SIDENAME"] = [Hit(i + 1, word, vocabulary.singular)]
        elif plain or hue or (packed and "NOUN" in here):
            here["NAME"] = [Hit(i + 1, part, mask)]
    elif vocabulary.is_strange(tokens[i], book.known, only={*here}):
        here["UNKNOWN"] = [Hit(i + 1, word, vocabulary.number_of(word))]
    numbers = [str(hit.value) for hit in here.get("NUMBER", ()) if hit.end == i + 1]
    for part in (word, *numbers):
        after = tokens[i + 1] if i + 1 < len(tokens) else None
        article = part == "a" and after is not None and after.kind == "word" and after.text not in function
        if part in words.parts and (len(part) == 1 or part.isdigit()) and not article:
            name = "ONE_NAME" if word == "one" else "SUFFIX"
            here.setdefault(name, []).append(Hit(i + 1, part, vocabulary.singular))
    if word in words.parts:
        here["PART_OF_ID"] = [Hit(i + 1, word, EVERYTHING)]
    for spoken, stem in words.stems.get(word, ()):
        if tuple(token.text for token in tokens[i : i + len(spoken)]) == spoken:
            # Said in full it means that one: "the yellow and white mug", "the cream cheese".
            for name in ("NOUN", "NAME", "COLOUR", "HUE", "TINT"):
                here.pop(name, None)
            here.setdefault("STEM", []).append(Hit(i + len(spoken), stem, vocabulary.singular))
    for spoken, name in words.by_first_word.get(word, ()):
        if tuple(token.text for token in tokens[i : i + len(spoken)]) == spoken:
            here.setdefault("ID", []).append(Hit(i + len(spoken), name, vocabulary.singular))
