"""Cache of answers about objects, cleared when another episode begins."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import ParamSpec, TypeVar

_Params = ParamSpec("_Params")
_Answer = TypeVar("_Answer")

_clears: list[Callable[[], None]] = []


def cached_for_episode(most: int) -> Callable[[Callable[_Params, _Answer]], Callable[_Params, _Answer]]:
    """Return a decorator that caches the latest answers, so many at most, of a function of hashable values."""

    def decorate(function: Callable[_Params, _Answer]) -> Callable[_Params, _Answer]:
        cached = lru_cache(maxsize=most)(function)
        _clears.append(cached.cache_clear)
        # The cached one answers as the function does; its type says nothing of parameters.
        return cached  # type: ignore[return-value]

    return decorate


def clear_episode_caches() -> None:
    """Drop all cached answers: objects of another layout stand elsewhere, and nobody asks about these again."""
    for clear in _clears:
        clear()
