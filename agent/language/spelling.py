"""Typos: the nearest known word, if only one is near and the word is no other word of English."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import lru_cache

from robosandbox.agent.language.lexicon import MEANING, REAL_WORDS, VOCABULARY, WORDS
from robosandbox.agent.language.speech import GRAMMAR_WORDS
from robosandbox.agent.language.verbs import BASE_FORMS, UNSUPPORTED_VERBS


def nearest_word(word: str, extra: Iterable[str] = ()) -> str | None:
    """Return the known word that `word` is a slip of, or None.

    A slip keeps the first letter or swaps the first two; words of three letters may only be swapped or lack a letter.
    """
    return _nearest(word, frozenset(extra))


@lru_cache(maxsize=4096)
def _nearest(word: str, extra: frozenset[str]) -> str | None:
    from rapidfuzz import process
    from rapidfuzz.distance import OSA, Indel

    if len(word) < 3 or len(word) > 24 or not word.isalpha():
        return None
    allowed = 1 if len(word) < 7 else 2
    found = process.extract(word, [*VOCABULARY, *sorted(extra)], scorer=OSA.distance, score_cutoff=allowed, limit=12)
    near = {candidate: distance for candidate, distance, _ in found if _is_slip(word, candidate, int(distance))}
    if not near:
        return _swapped(word)

    def cost(candidate: str) -> tuple[float, ...]:
        rank = 0 if candidate in extra else 1
        return near[candidate], rank, sorted(word) != sorted(candidate), -Indel.normalized_similarity(word, candidate)

    best, *others = sorted(near, key=cost)
    rivals = [other for other in others if cost(other) == cost(best) and MEANING.get(other) != MEANING.get(best)]
    return None if rivals else best


def _swapped(word: str) -> str | None:
    """Return the known word of which two neighbouring letters are swapped, if there is just one."""
    if len(word) < 4:
        return None
    swaps = {word[:k] + word[k + 1] + word[k] + word[k + 2 :] for k in range(len(word) - 1)} & WORDS
    return swaps.pop() if len(swaps) == 1 else None


def _is_slip(word: str, candidate: str, distance: int) -> bool:
    swapped = sorted(word) == sorted(candidate)
    if len(candidate) < 3 or (word[0] != candidate[0] and not (swapped and word[:2] == candidate[1::-1])):
        return False
    if len(word) == 3:
        return swapped or len(candidate) == 4
    return distance <= (1 if min(len(word), len(candidate)) < 7 else 2)


def respelled(words: Sequence[str], parts: frozenset[str]) -> tuple[str, ...]:
    """Return the words of a sentence that was not understood with what its place in the sentence tells of their spelling.

    Where a command begins, the nearest verb is meant ("pik up"); elsewhere letters may have been left out ("rd cube").
    """
    made: list[str] = []
    for i, word in enumerate(words):
        if word.removesuffix("s") in parts:
            made.append(word)
            continue
        opens = i == 0 or words[i - 1] in _BEFORE_COMMANDS
        better = None
        if (
            opens
            and word.isalpha()
            and len(word) > 2
            and ((word not in _KNOWN and word not in parts) or _REAL_SLIPS.get(word))
        ):
            better = _nearest_verb(word)
        if better is None and word.isalpha() and word not in _KNOWN and word not in parts and len(word) > 1:
            better = _filled(word, parts) if len(word) < 6 else None
            better = better or _vowels_left_out(word, parts)
        if better is None and word.isalpha() and len(word) > 3 and (word not in _KNOWN or word in REAL_WORDS):
            better = _sounding(word, parts) if word not in parts else None
        better = better or _ACCENTS.get(word) or (_SLIPS.get(word) if word not in parts else None)
        if better is None and word not in parts and _single(word) in GRAMMAR_WORDS and word not in GRAMMAR_WORDS:
            better = _single(word)
        if better is None and word == "i" and made and words[i + 1 : i + 2] in (["the"], ["a"], ["my"]):
            # "put it i the bowl"
            better = "in"
        if better is None and len(word) > 2 and word not in _KNOWN and word not in parts:
            better = _beheaded(word, parts)
        if better is None and len(word) > 4 and word not in _KNOWN and word not in parts:
            better = _function_word(word)
        if word == "an" and 0 < i < len(words) - 1 and words[i + 1][0] not in "aeiouh" and _names(words[i - 1], parts):
            # "salt an pepper"
            better = "and"
        if made and made[-1] == word and word in _TWICE:
            better = ""
        made.append(word if better is None else better)
    return tuple(made)


def _single(word: str) -> str:
    """Return a word with one letter for each two that are the same: "upp", "inn"."""
    return re.sub(r"(.)\1", r"\1", word)


@lru_cache(maxsize=1024)
def _beheaded(word: str, parts: frozenset[str]) -> str | None:
    """Return the one colour or name of the scene that this is without its first letter: "lue", "ube"."""
    whole = {*(w for w, m in MEANING.items() if m.startswith("colour") and " " not in w), *parts}
    near = [known for known in whole if known[1:] == word]
    return near[0] if len(near) == 1 else None


def _names(word: str, parts: frozenset[str]) -> bool:
    return word in parts or word.removesuffix("s") in parts or MEANING.get(word, "").startswith("noun")


@lru_cache(maxsize=1024)
def _function_word(word: str) -> str | None:
    from rapidfuzz.distance import OSA

    near = [known for known in _FUNCTION_WORDS if known[0] == word[0] and OSA.distance(word, known) == 1]
    return near[0] if len(near) == 1 else None


_FUNCTION_WORDS = (
    "except", "between", "behind", "beside", "inside", "instead", "before", "without", "together", "everything", "another",
    "underneath", "towards", "forward", "backwards", "bottom", "middle", "against", "because", "after", "first",
    "different", "separate", "opposite", "remaining", "leftmost", "rightmost",
)  # fmt: skip
_SLIPS = {
    "te": "the", "tje": "the", "thr": "the", "tha": "the", "eht": "the", "ths": "this", "nad": "and", "ni": "in", "ot": "to", "fo": "of",
    "thn": "then", "wth": "with", "nto": "into", "rigth": "right", "agian": "again", "leav": "leave", "levae": "leave",
}  # fmt: skip
_ACCENTS = {"d": "the", "de": "the", "ze": "the", "dis": "this", "dat": "that", "dem": "them", "intae": "into"}
_KNOWN = WORDS | REAL_WORDS
_TWICE = frozenset({"the", "a", "in", "on", "up", "to", "and", "pick", "put", "push", "cube", "of"})
_BEFORE_COMMANDS = frozenset({",", ".", "!", ";", ":", "and", "then", "please", "to", "you"})
_VERBS = ("pick", "put", "push", "place", "take", "grab", "move", "stack", "drop", "lift", "get", "open", "close", "tap", "touch", "pull", "slide", "set", "swap", "pour")  # fmt: skip
_MORE_VERBS = tuple(verb for verb in BASE_FORMS | UNSUPPORTED_VERBS if len(verb) > 3)
"""What is not done counts too: "stik" is no more "stack" for it, and what may be either is neither."""
_REAL_SLIPS = {
    "mov": "move",
    "por": "pour",
    "giv": "give",
    "pic": "pick",
    "puck": "pick",
    "pink": "",
    "pip": "",
    "plate": "",
    "plane": "",
    "lace": "",
}


@lru_cache(maxsize=1024)
def _nearest_verb(word: str) -> str | None:
    from rapidfuzz.distance import OSA

    if word in _REAL_SLIPS:
        slip: str = _REAL_SLIPS[word]
        return slip or None
    near = [verb for verb in _VERBS if verb[0] == word[0] and OSA.distance(word, verb) == 1]
    if not near and len(word) > 3:
        sound = _sound(word)
        near = [verb for verb in _MORE_VERBS if _sound(verb) == sound]
        near = near or [
            verb
            for verb in _MORE_VERBS
            # Not for another letter: "hire" and "lease" are words.
            if verb[0] == word[0]
            and OSA.distance(word, verb) == 1
            and (len(verb) != len(word) or sorted(verb) == sorted(word))
        ]
    return near[0] if len(near) == 1 else None


@lru_cache(maxsize=1024)
def _sounding(word: str, parts: frozenset[str]) -> str | None:
    """Return the one word of the scene that sounds like this, or lies a letter beside it: "qube", "bowel" for "bowl"."""
    from rapidfuzz.distance import OSA

    sound = _sound(word)
    same: list[str] = list({*_sounds().get(sound, ()), *_sounding_alike(sound, parts)})
    if len(same) == 1:
        return same[0]
    near = [w for w in parts if w.isalpha() and len(w) > 3 and w[0] == word[0] and OSA.distance(word, w) == 1]
    return near[0] if len(near) == 1 and not same else None


def _sounding_alike(sound: str, parts: Iterable[str]) -> list[str]:
    return [part for part in parts if len(part) > 2 and part.isalpha() and _sound(part) == sound]


@lru_cache(maxsize=1024)
def sounding_part(word: str, parts: frozenset[str]) -> str | None:
    """Return the one word of the scene that sounds like this: "froot" for "fruit"."""
    same = _sounding_alike(_sound(word), parts) if len(word) > 3 and word.isalpha() else []
    return same[0] if len(same) == 1 else None


@lru_cache(maxsize=1)
def _sounds() -> dict[str, list[str]]:
    """Return the words for things and colours by how they sound."""
    table: dict[str, list[str]] = {}
    for word, meaning in MEANING.items():
        if meaning.startswith(("colour", "noun")) and word.isalpha() and len(word) > 2:
            table.setdefault(_sound(word), []).append(word)
    return table


def _sound(word: str) -> str:
    """Return a rough image of how a word sounds."""
    for old, new in (("ph", "f"), ("th", "f"), ("ck", "c"), ("qu", "cu"), ("q", "c"), ("k", "c"), ("z", "s"), ("y", "i"), ("ee", "i"), ("ea", "i"), ("oo", "u"), ("ui", "u"), ("ue", "u")):  # fmt: skip
        word = word.replace(old, new)
    return re.sub(r"(.)\1", r"\1", word)


@lru_cache(maxsize=1024)
def _filled(word: str, parts: frozenset[str]) -> str | None:
    """Return the one word of which this has the consonants: "rd" for "red", "th" for "the"."""
    words = {*_VERBS, *(w for w, m in MEANING.items() if m.startswith("colour")), *parts, "the", "and", "with", "from"}
    if any(letter in "aeiou" for letter in word):
        return None
    near = [w for w in words if w.isalpha() and w[0] + "".join(c for c in w[1:] if c not in "aeiou") == word]
    return near[0] if len(near) == 1 else None


@lru_cache(maxsize=1024)
def _vowels_left_out(word: str, parts: frozenset[str]) -> str | None:
    """Return the one word of the scene that this is but for some of its vowels: "notebk" for "notebook"."""
    if len(word) < 4:
        return None
    pattern = re.compile("[aeiou]*".join(word))
    near = [part for part in parts if part[0] == word[0] and part[-1] == word[-1] and pattern.fullmatch(part)]
    return near[0] if len(near) == 1 else None


def suggestions(word: str, names: Iterable[str], limit: int = 3) -> tuple[str, ...]:
    """Return the names that look most like `word`, best first."""
    from rapidfuzz import process
    from rapidfuzz.distance import Indel

    found = process.extract(word, list(names), scorer=Indel.normalized_similarity, limit=limit)
    return tuple(name for name, score, _ in found if score > 0.4)
