"""Answers about objects that are kept while an episode may ask again, and forgotten when another begins."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import ParamSpec, TypeVar

_Params = ParamSpec("_Params")
_Answer = TypeVar("_Answer")

_forgets: list[Callable[[], None]] = []


def kept(most: int) -> Callable[[Callable[_Params, _Answer]], Callable[_Params, _Answer]]:
    """Return a decorator of functions of hashable values whose latest answers, so many at most, are kept."""

    def keep(function: Callable[_Params, _Answer]) -> Callable[_Params, _Answer]:
        cached = lru_cache(maxsize=most)(function)
        _forgets.append(cached.cache_clear)
        # The cached one answers as the function does; its type says nothing of parameters.
        return cached  # type: ignore[return-value]

    return keep


def forget() -> None:
    """Drop what was kept: objects of another layout stand elsewhere, and nobody asks about these again."""
    for each in _forgets:
        each()
