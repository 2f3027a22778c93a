"""From text to tokens: contractions, typos, ids, numbers; fillers go, everything else stays."""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

from robosandbox.agent.language import lazy_regex
from robosandbox.agent.language.hesitations import HESITATIONS, WAYS, takes_back
from robosandbox.agent.language.lexicon import (
    ASIDE_FILLERS,
    EDGE_FILLERS,
    END_FILLERS,
    FILLERS,
    JOINABLE,
    LEXICON,
    REAL_WORDS,
    START_FILLERS,
    WORDS,
    words_plural,
)
from robosandbox.agent.language.notation import written_out
from robosandbox.agent.language.places import TABLE
from robosandbox.agent.language.speech import CONDITIONS, CORRECTION, GRAMMAR_WORDS
from robosandbox.agent.language.spelling import nearest_word, sounding_part
from robosandbox.agent.language.things import COLOURS, NOUNS, POSITIONS, SHADES, SIZES, SUPERLATIVES, UNITS
from robosandbox.agent.language.typography import in_sentences, plain_text
from robosandbox.agent.language.verbs import BASE_FORMS
from robosandbox.agent.language.wordlist import phrase_list

MARKS = frozenset(",.;!?:")
MAX_CHARACTERS = 2_000  # Characters of a prompt. Chosen far above a spoken command.
MAX_TOKENS = 120  # Number of words of a prompt. Chosen far above a spoken command.


class TooLongError(ValueError):
    """The prompt is longer than anybody would say."""


class Token(NamedTuple):
    """One word, number, id or mark.

    Attributes:
        text: In its normal form: lower case, typos corrected.
        raw: As written.
        kind: word, number, id or mark.
    """

    text: str
    raw: str
    kind: str

    @property
    def number(self) -> float:
        """Its value; meaningful for numbers only."""
        return float(self.text)


ABBREVIATIONS = {
    "cyl": "cylinder", "cyls": "cylinders", "obj": "object", "objs": "objects", "btl": "bottle", "btls": "bottles",
    "drwr": "drawer", "lg": "large", "lrg": "large", "sml": "small", "ylw": "yellow", "yel": "yellow", "grn": "green",
    "wht": "white", "btwn": "between", "dist": "distance", "tgt": "target", "rtn": "return", "frm": "from", "jus": "just", "bg": "big", "orng": "orange",
    "smol": "small", "lil": "little", "thnx": "thanks", "thanx": "thanks", "tnx": "thanks", "tks": "thanks", "k": "ok", "kk": "ok",
}  # fmt: skip
_TAKING_BACK = frozenset(phrase.split()[-1] for phrase in CORRECTION.split(", ")) - {"that", "it", "on", "one", "say"}
"""Last words of what takes back what was said before: "oops", "I mean"."""
_BEFORE_RIGHT = frozenset({"the", "your", "its", "to", "far"})
_RUN_TOGETHER = lazy_regex.compile(
    r"(in|into|on|onto|to|up|of|off|from|at|and|with|by|over|next|down|behind|under|between|beside|around|all|both)"
    r"(the|it|them|that|this|those)|(cm|mm)(left|right|forward|back|backwards|away|to)|(a)(bit|little)"
)
_DRAWN_OUT = lazy_regex.compile(r"(.)\1{2,}")
_PIECES = lazy_regex.compile(
    r"(?P<ordinal>\d+(?:st|nd|rd|th)\b)"
    r"|(?P<number>(?<![\w.])[-+]?(?:\d+\.\d+|\d+|\.\d+))"
    r"|(?P<numeral>(?<=[^\W\d_])\d+)"
    r"|(?P<identifier>[^\W\d_]+(?:_[^\W_]+)+)"
    r"|(?P<word>[^\W\d_]+)"
    r"|(?P<mark>\S)"
)


@dataclass(frozen=True, eq=False)
class SceneWords:
    """The words of one scene's ids.

    Attributes:
        ids: Ids by their lower-case form.
        parts: Words that occur in ids.
        pattern: Finds ids in text.
        spoken: Ids of several words that end in a number or letter, or begin like the table does ("desk drawer"), or of two words that describe nothing ("fruit basket"), as words.
    """

    ids: dict[str, str]
    parts: frozenset[str]
    pattern: re.Pattern[str] | None
    spoken: tuple[tuple[tuple[str, ...], str], ...] = ()

    @cached_property
    def forms(self) -> frozenset[str]:
        """The words of ids, and their plurals."""
        return self.parts | {words_plural(part) for part in self.parts if part.isalpha() and len(part) > 2}

    @cached_property
    def single(self) -> frozenset[str]:
        """The words that call one thing alone what it is: where scissors are, "the scissors" are one thing."""
        last = [[part for part in id_parts(name) if part.isalpha()][-1:] for name in self.ids]
        count = Counter(part for parts in last for part in parts)
        return frozenset(part for part, n in count.items() if n == 1)

    @cached_property
    def hues(self) -> frozenset[str]:
        """The colours that a thing is called after and nothing else: "orange" where there is an orange."""
        names = [[part for part in id_parts(name) if part.isalpha() and len(part) > 1] for name in self.ids]
        return frozenset(name[0] for name in names if len(name) == 1 and name[0] in COLOURS)

    @cached_property
    def by_first_word(self) -> dict[str, list[tuple[tuple[str, ...], str]]]:
        """`spoken` by the first word."""
        table: dict[str, list[tuple[tuple[str, ...], str]]] = {}
        for parts, name in self.spoken:
            table.setdefault(parts[0], []).append((parts, name))
        return table

    @cached_property
    def stems(self) -> dict[str, list[tuple[tuple[str, ...], tuple[str, ...]]]]:
        """Names in full without their number, as they are said, with the words of the id, by the first word.

        Those of which a word describes and another says nothing, as "akita black bowl", and those of two colours, as "yellow and
        white mug": other readings take their words apart.
        """
        table: dict[str, list[tuple[tuple[str, ...], tuple[str, ...]]]] = {}
        for stem in dict.fromkeys(id_parts(name)[:-1] for name in self.ids if name[-1].isdigit()):
            told = [part in _TELLING or part in _NOUN_WORDS for part in stem]
            # "wine bottle" names by two nouns; the words of "red cube" describe.
            named = len(stem) > 1 and _DESCRIBING.isdisjoint(stem)
            ways = [stem] if named or (any(told) and not all(told)) else []
            colours = tuple(part for part in stem if part in _COLOUR_WORDS)
            if len(colours) == 2 and stem[:2] in (colours, colours[::-1]):
                ways += [
                    (one, *joint, other, *stem[2:])
                    for one, other in (colours, colours[::-1])
                    for joint in ((), ("and",))
                ]
            for way in ways:
                table.setdefault(way[0], []).append((way, stem))
            called = tuple(part for part in stem if part not in _DESCRIBING)
            if 1 < len(called) < len(stem):
                # "the tomato sauce" for white_tomato_sauce_1
                table.setdefault(called[0], []).append((called, called))
        return table

    @cached_property
    def lasts(self) -> frozenset[str]:
        """The words that ids end with, which name what they are."""
        return frozenset(id_parts(name)[-1] for name in self.ids)


_FORBIDDERS = frozenset({"AVOID", "NEGATION", "STILL"})
_OPENERS = frozenset({"VERB", "THE", "A", "PREAMBLE", "DESIRE", "PRON", "AVOID", "NEGATION"})
_FORBIDDING = frozenset("🚫❌⛔✋🛑")
_DESCRIBING = frozenset(
    word
    for table in (COLOURS, SHADES, SIZES, SUPERLATIVES, POSITIONS)
    for phrases in table.values()
    for phrase in phrase_list(phrases)
    for word in phrase.split()
)
_TELLING = _DESCRIBING | GRAMMAR_WORDS
_NOUN_WORDS = frozenset(word for phrases in NOUNS.values() for word in phrase_list(phrases))
_COLOUR_WORDS = frozenset(word for phrases in COLOURS.values() for word in phrase_list(phrases))
_ENDEARMENTS = frozenset({"honey", "sweetie", "sweetheart", "darling", "buddy", "pal", "dude", "boss"})
ASKED_FOR: dict[str, set[tuple[str, ...]]] = {}
"""Verbs of several words that skills say of themselves, by the first word: none of them is a filler."""
_JOINTS = frozenset({"and", "then", "but"})
WAITS = frozenset({"wait", "pause"})
WAITED_FOR = frozenset({"for", "until", "till", "to"})
_ONLY = frozenset({"just", "only", "simply", "merely", "really"})
_HAVING = frozenset({"is", "are", "see", "find", "has", "have", "contains", "holds", "holding"})
_STUTTERED = frozenset({"i", "want", "can", "could", "we", "please", "need"})
_HUES = _COLOUR_WORDS - {*COLOURS, "gray"}
_IN_NAMES = frozenset({"in", "out", "on", "off"})
_TABLES = frozenset(phrase_list(TABLE))


@lru_cache(maxsize=256)
def scene_words(ids: tuple[str, ...]) -> SceneWords:
    """Return the vocabulary that a scene's ids add."""
    parts = {part for name in ids for part in id_parts(name)}
    spelled = sorted((re.escape(name) for name in ids if len(id_parts(name)) > 1), key=len, reverse=True)
    pattern = re.compile(rf"(?<![\w.-])(?:{'|'.join(spelled)})(?![\w-])", re.IGNORECASE) if spelled else None
    spoken = tuple(
        (id_parts(name), name)
        for name in ids
        if len(id_parts(name)) > 2
        or (len(id_parts(name)) == 2 and (name[-1].isdigit() or len(id_parts(name)[-1]) == 1))
        or (len(id_parts(name)) == 2 and id_parts(name)[0] in _TABLES)
        # A "salmon roll" is called so, whatever its colour.
        or (len(id_parts(name)) == 2 and id_parts(name)[0] in _HUES)
        # "in tray" is a name and no place.
        or (len(id_parts(name)) == 2 and id_parts(name)[0] in _IN_NAMES)
        # "fruit basket" means the one called so, "block red" likewise; "red cube" describes.
        or (len(id_parts(name)) == 2 and not {*id_parts(name)} & _TELLING)
        or (len(id_parts(name)) == 2 and id_parts(name)[-1] in _COLOUR_WORDS)
    )
    return SceneWords({name.lower(): name for name in ids}, frozenset(parts), pattern, spoken)


@lru_cache(maxsize=1024)
def id_parts(name: str) -> tuple[str, ...]:
    """Return the words of an id: "blue_block2" -> blue, block, 2."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return tuple(re.findall(r"[a-z]+|\d+", spaced.lower()))


def tokenize(prompt: str, words: SceneWords) -> tuple[Token, ...]:
    """Return the tokens of a prompt, fillers removed; arguments and errors as those of `spoken`."""
    return without_fillers(spoken(prompt, words), words)


def spoken(prompt: str, words: SceneWords) -> tuple[Token, ...]:
    """Return every token of a prompt.

    Args:
        prompt: What was said.
        words: The scene's words, which count as known.

    Raises:
        TooLongError: The prompt has more than `MAX_CHARACTERS` characters or `MAX_TOKENS` tokens.
    """
    if len(prompt) > MAX_CHARACTERS:
        raise TooLongError(f"{len(prompt):,} characters")
    tokens: list[Token] = []
    start = 0
    prompt = in_sentences(written_out(prompt))
    for match in words.pattern.finditer(prompt) if words.pattern else ():
        tokens += _pieces(prompt[start : match.start()], words)
        tokens.append(Token(words.ids[match[0].lower()], match[0], "id"))
        start = match.end()
    tokens += _pieces(prompt[start:], words)
    tokens = _rejoined(tokens, words)
    if len(tokens) > MAX_TOKENS:
        raise TooLongError(f"{len(tokens)} words")
    return tuple(tokens)


def without_fillers(tokens: Sequence[Token], words: SceneWords) -> tuple[Token, ...]:
    """Return the tokens of a sentence without the words that say nothing where they stand: "please", "ok", "for me"."""
    kept = _without_fillers(tokens, words)
    # Twice: "would you please" ends a sentence once the "please" is gone.
    return kept if kept == tuple(tokens) else _without_fillers(kept, words)


class PassedOver(NamedTuple):
    """Words that the grammar passes over, though they say something of what is asked.

    Attributes:
        kind: manner, limit or repeat.
        words: As said.
        follows: Whether something was asked before them.
    """

    kind: str
    words: str
    follows: bool


def passed_over(prompt: str, words: SceneWords) -> list[PassedOver]:
    """Return what is passed over of a prompt and still has to be accounted for; arguments and errors as those of `spoken`."""
    said = spoken(prompt, words)
    kept = {id(token) for token in without_fillers(said, words)}
    found: list[PassedOver] = []
    i = 0
    while i < len(said):
        fillers = (*FILLERS.at(said, i), *END_FILLERS.at(said, i))
        dropped = [(end, kind or "") for end, _, kind in fillers if kept.isdisjoint(map(id, said[i:end]))]
        after = LEXICON.at(said, i + 1) if i + 1 < len(said) else []
        stroke = said[i].text in _STROKES and any(tag == "LIGHT_NOUN" for _, tag, _ in after)
        end, kind = max([*dropped, (i + 1, "manner" if stroke else "")])
        if kind:
            follows = any(token.kind == "mark" or token.text in ("and", "then") for token in said[:i])
            found.append(PassedOver(kind, " ".join(token.raw for token in said[i:end]), follows))
        i = end
    return found


_STROKES = frozenset({"gentle", "quick", "light", "soft", "careful", "firm", "hard"})
_FORBIDDEN = frozenset({"touch", "bump", "disturb"})


def _rejoined(tokens: Sequence[Token], words: SceneWords) -> list[Token]:
    """Return the tokens with "lunch box" as the scene's "lunchbox", and a word said twice over ("tap tap it") once."""
    made: list[Token] = []
    for token in tokens:
        for n in (2, 3):
            # "i want, i want the ball", "put the put the ball"
            if len(made) < 2 * n or made[-1].text != made[-n - 1].text:
                continue
            said = [word.text for word in made[-n:]]
            again = said == [word.text for word in made[-2 * n : -n]]
            if again and all(word in GRAMMAR_WORDS or word in BASE_FORMS or word in _STUTTERED for word in said):
                del made[-n:]
        last = made[-1] if made and made[-1].kind == token.kind == "word" else None
        if last and last.text == token.text and (token.text in BASE_FORMS or token.text in GRAMMAR_WORDS):
            continue
        whole = last.text + token.text if last else ""
        if last and last.text.removesuffix("ing") + token.text in words.parts:
            # "the frying pan" for what is called frypan
            whole = last.text.removesuffix("ing") + token.text
        known = last and all(word in words.parts or word in GRAMMAR_WORDS for word in (last.text, token.text))
        if last and not known and whole in words.parts and min(len(last.text), len(token.text)) > 2:
            made[-1] = Token(whole, f"{last.raw} {token.raw}", "word")
            continue
        if last and last.text == "no" and token.text in _FORBIDDEN:
            # "no tuoch brick" forbids, however it is spelled.
            made[-1:] = [Token("do", last.raw, "word"), Token("not", last.raw, "word")]
        made.append(token)
    return made


def _pieces(text: str, words: SceneWords) -> Iterable[Token]:
    for match in _PIECES.finditer(plain_text(text)):
        raw = match[0]
        match match.lastgroup:
            case "number" | "numeral":
                yield Token(str(float(raw)), raw, "number")
            case "identifier":
                yield Token(_nearest_id(raw, words) or raw, raw, "id" if _nearest_id(raw, words) else "word")
            case "word" | "ordinal":
                yield from _words(raw, words)
            case _ if unicodedata.category(raw) in ("So", "Sk", "Mn", "Cf") and raw not in _FORBIDDING:
                # A smile adds nothing.
                continue
            case _:
                yield Token({"+": "and"}.get(raw, raw), raw, "mark" if raw != "+" else "word")


def _nearest_id(raw: str, words: SceneWords) -> str | None:
    """Return the id of which this is a slip: each part equal, or a long word with a typo in it."""
    parts = raw.split("_")
    near = []
    for lower, name in words.ids.items():
        own = lower.split("_")
        same = all(a == b or (len(b) > 2 and nearest_word(a, (b,)) == b) for a, b in zip(parts, own, strict=False))
        if (len(own) == len(parts) and same) or sorted(own) == sorted(parts):
            near.append(name)
    return near[0] if len(near) == 1 else None


def _words(raw: str, words: SceneWords) -> tuple[Token, ...]:
    """Return the word, its correction, or the two words that were run together ("redcube")."""
    if raw in ABBREVIATIONS and raw not in words.parts:
        return (Token(ABBREVIATIONS[raw], raw, "word"),)
    if raw in WORDS or raw in words.parts or raw in REAL_WORDS or _is_plural(raw, words.parts):
        return (Token(raw, raw, "word"),)
    drawn = next(
        (w for w in (_DRAWN_OUT.sub(r"\1", raw), _DRAWN_OUT.sub(r"\1\1", raw)) if w in WORDS or w in words.parts), None
    )
    if drawn:
        return (Token(drawn, raw, "word"),)
    run = _RUN_TOGETHER.fullmatch(raw)
    if run:
        return tuple(Token(part, part, "word") for part in run.groups() if part)
    for k in range(2, len(raw) - 1):
        first, second = raw[:k], raw[k:]
        joined = first in JOINABLE and second in JOINABLE and JOINABLE[first] < JOINABLE[second]
        if joined or (first in words.parts and second in words.parts):
            return (Token(first, first, "word"), Token(second, second, "word"))
    known = sounding_part(raw, words.parts) or nearest_word(raw, words.forms) or _cut_short(raw, words)
    return (Token(known or raw, raw, "word"),)


def _cut_short(raw: str, words: SceneWords) -> str | None:
    """Return the one name of the scene that a word begins: "dino" for the dinosaur, "rhinos"."""
    if len(raw) < 4 or not raw.isalpha():
        return None
    found = [part for part in words.parts if part.startswith(raw) and len(part) > len(raw) + 1]
    if not found and raw.endswith("s") and len(raw) > 4:
        several = [part for part in words.parts if part.startswith(raw[:-1]) and len(part) > len(raw)]
        found = [words_plural(part) for part in several]
    return found[0] if len(found) == 1 else None


def _says_nothing(tokens: Sequence[Token], i: int) -> bool:
    """Say whether a "no" before token `i` is just an opening: "no, ...", "no the green one", "no put it there"."""
    if i >= len(tokens) or tokens[i].kind == "mark" or FILLERS.match(tokens, i) or START_FILLERS.match(tokens, i):
        return True
    tags = {tag for _, tag, _ in LEXICON.at(tokens, i)}
    return bool(tags & _OPENERS) and not tags & {"NOUN", "ABSENT", "COLOUR"}


def _counts(tokens: Sequence[Token], i: int, kept: Sequence[Token]) -> bool:
    """Say whether an "only" limits the number in a condition: "if there are only two cans"."""
    conditional = kept and kept[-1].text in _HAVING and any(token.text in CONDITIONS for token in kept)
    number = tokens[i + 1] if i + 1 < len(tokens) else None
    counted = number is not None and (_is_number(tokens, i + 1) or number.text == "one")
    return bool(conditional and counted)


def _asked_for(tokens: Sequence[Token], i: int) -> int:
    """Return how many words a verb of some skill has here, of which one alone might say nothing: "slow down", "be careful"."""
    for phrase in ASKED_FOR.get(tokens[i].text, ()):
        if tuple(token.text for token in tokens[i : i + len(phrase)]) == phrase:
            return len(phrase)
    return 0


def _is_number(tokens: Sequence[Token], i: int) -> bool:
    return i < len(tokens) and (tokens[i].kind == "number" or any(tag == "NUM" for _, tag, _ in LEXICON.at(tokens, i)))


def _is_plural(word: str, parts: frozenset[str]) -> bool:
    return (word.endswith("s") and word[:-1] in parts) or (word.endswith("es") and word[:-2] in parts)


def _without_fillers(tokens: Sequence[Token], words: SceneWords) -> tuple[Token, ...]:
    kept: list[Token] = []
    i = 0
    while i < len(tokens):
        edge = not kept or kept[-1].kind == "mark"
        if (
            tokens[i].text == "as"
            and i + 2 < len(tokens)
            and [t.text for t in tokens[i : i + 3]] == ["as", "well", "as"]
        ):
            kept += tokens[i : i + 3]
            i += 3
            continue
        length = FILLERS.match(tokens, i) or (EDGE_FILLERS.match(tokens, i) if edge else 0)
        length = length or (0 if kept else START_FILLERS.match(tokens, i))
        named = tokens[i].text in _ENDEARMENTS and tokens[i].text in words.parts
        length = 0 if named else length
        if tokens[i].text == "no" and i + 1 < len(tokens) and tokens[i + 1].text.endswith("ing"):
            # "no touching the can" forbids; elsewhere a "no" at the start says nothing.
            length = 0
        if (verb := _asked_for(tokens, i)) and (edge or kept[-1].text in _JOINTS):
            kept += tokens[i : i + verb]
            i += verb
            continue
        then = tokens[i + 1].text if i + 1 < len(tokens) else ""
        counts = then not in ("a", "an") and _is_number(tokens, i + 1)
        if tokens[i].text in WAITS and (counts or then in WAITED_FOR):
            # "wait for me, then ..." and "wait 5 seconds" ask for something.
            kept += tokens[i : i + 5]
            i += 5
            continue
        if tokens[i].text == "no" and not _says_nothing(tokens, i + 1):
            # "no pens in the box" forbids.
            kept.append(tokens[i])
            i += 1
            continue
        if tokens[i].text in ("only", "just") and _counts(tokens, i, kept):
            # "if there is only one block" does not say that there is one at least.
            length = 0
        if tokens[i].text in _ONLY and kept and kept[-1].text == "not":
            # "not just the red cube but also ..." leaves nothing out.
            length = 0
        if tokens[i].text == "right" and kept and (kept[-1].text in _BEFORE_RIGHT or kept[-1].text in UNITS):
            # "to the right now" and "an inch right now" name a direction.
            length = 0
        ending = i + (END_FILLERS.match(tokens, i) if length and edge and kept and not named else 0)
        if ending > i + length and (ending == len(tokens) or tokens[ending].kind == "mark"):
            # "..., so see to that": more than the "so" that it begins with.
            length = ending - i
        # "push it left, right?" asks for no second way.
        asked = i + 1 < len(tokens) and tokens[i + 1].text == "?"
        listed = tokens[i].text == "right" and not asked and any(token.text in WAYS for token in kept[-2:])
        cue = kept[-2].text if len(kept) > 1 and kept[-1].text == "," else ""
        if tokens[i].text == "right" and cue in _TAKING_BACK:
            # "to the left of the bowl, no, right, and ..."
            listed = listed or any(token.text in WAYS for token in kept)
        if tokens[i].text == "right" and [t.text in UNITS for t in kept[-2:-1]] == [True] and kept[-1].text == ",":
            # "the block, 3 cm, right"; but "..., right?"
            listed = i + 1 >= len(tokens) or tokens[i + 1].text != "?"
        if not length:
            # Some words are fillers only where nothing follows, or where they stand alone between commas.
            length = max(
                END_FILLERS.match(tokens, i) if kept and not named else 0, ASIDE_FILLERS.match(tokens, i) if edge else 0
            )
            after = i + length
            if listed or (after < len(tokens) and tokens[after].kind != "mark"):
                # "left, right, left"
                length = 0
            elif (
                length
                and kept
                and (after < len(tokens) - 1 or not END_FILLERS.match(tokens, i))
                and any(tag == "CORRECTION" for _, tag, _ in LEXICON.at(tokens, i))
            ):
                # "..., hang on, the blue one": corrects what was said before it.
                length = 0
        opening = (
            max((end for end, tag, _ in LEXICON.at(tokens, i) if tag in ("PREAMBLE", "DESIRE")), default=i)
            if edge
            else i
        )
        if opening > i + max(length, 1):
            # "your task is to": what would be a filler by itself belongs to the opening.
            kept += tokens[i:opening]
            i = opening
            continue
        if not length:
            if tokens[i].text != "," or (kept and kept[-1].kind != "mark"):
                kept.append(tokens[i])
            i += 1
            continue
        forbidding = max((end for end, tag, _ in LEXICON.at(tokens, i) if tag in _FORBIDDERS), default=i)
        aimed = forbidding == i + length and forbidding < len(tokens) and tokens[forbidding].kind != "mark"
        if forbidding > i + length or aimed:
            # "be careful not to hit the can" loses no word of it, nor "never mind the can".
            kept += tokens[i:forbidding]
            i = forbidding
        else:
            if tokens[i].text == "so" and kept and kept[-1].kind != "mark" and i + length < len(tokens):
                # "the can is empty so please bin it"
                kept.append(Token(",", ",", "mark"))
            if tokens[i].text in HESITATIONS and takes_back(
                [token.text for token in kept], [token.text for token in tokens[i + length :]]
            ):
                kept.append(Token("no", tokens[i].raw, "word"))
            i += length
    return tuple(kept)
