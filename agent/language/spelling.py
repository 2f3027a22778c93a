"""Typos: the nearest known word, if only one is near and the word is no other word of English."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

from rapidfuzz import process
from rapidfuzz.distance import OSA, Indel

from robosandbox.agent.language.lexicon import MEANING, VOCABULARY, WORDS


def nearest_word(word: str, extra: Iterable[str] = ()) -> str | None:
    """Return the known word that `word` is a slip of, or None.

    A slip keeps the first letter or swaps the first two; words of three letters may only be swapped or lack a letter.
    """
    return _nearest(word, frozenset(extra))


@lru_cache(maxsize=4096)
def _nearest(word: str, extra: frozenset[str]) -> str | None:
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


def suggestions(word: str, names: Iterable[str], limit: int = 3) -> tuple[str, ...]:
    """Return the names that look most like `word`, best first."""
    found = process.extract(word, list(names), scorer=Indel.normalized_similarity, limit=limit)
    return tuple(name for name, score, _ in found if score > 0.4)
