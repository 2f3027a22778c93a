"""Suggestions for misspelt names, from the valid ones."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

# Percent of characters that two names have in common in order, where they share no word. Chosen: below it lie pairs with
# nothing to do with each other, as "dsl" and "slow" (57) or "foo" and "mujoco" (44).
_LEAST_LETTERS = 60.0


def nearest(name: str, choices: Iterable[str], *, limit: int = 3) -> tuple[str, ...]:
    """Return the choices that look like a misspelt `name`, the likeliest first."""
    wanted = name[:200]
    near = [choice for choice in choices if _is_near(wanted, choice)]
    return tuple(sorted(near, key=lambda choice: -_likeness(wanted, choice))[:limit])


def did_you_mean(name: str, choices: Iterable[str]) -> str:
    """Return "; did you mean 'x'?", or nothing when no choice is near."""
    near = nearest(name, choices)
    if not near:
        return ""
    return f"; did you mean {' or '.join(repr(choice) for choice in near[:2])}?"


def did_you_mean_file(path: Path) -> str:
    """Return "; did you mean 'x'?" with files beside a missing one that end like it, or nothing when none is near."""
    try:
        there = {item.stem: item.name for item in path.parent.iterdir() if item.suffix == path.suffix}
    except OSError:
        # A folder that cannot be read has nothing to suggest; that the file is missing is told all the same.
        return ""
    near = [there[stem] for stem in nearest(path.stem, there)]
    return did_you_mean(path.name, near)


def no_file(path: Path) -> str:
    """Return what is wrong with a path that is no file: what it is instead, or that nothing is there, and what is near."""
    if path.exists():
        return f"{path}: is {'a folder' if path.is_dir() else 'a pipe or device'}; name a file"
    return f"{path}: no such file{did_you_mean_file(path)}"


def _is_near(name: str, choice: str) -> bool:
    """Tell whether two names share a word, one begins with the other, or most letters are the same."""
    from rapidfuzz import fuzz

    one, other = _words(name), _words(choice)
    if not one or not other:
        return False
    shared = set(one.split()) & set(other.split())
    begun = one.startswith(other) or other.startswith(one)
    return bool(shared) or begun or fuzz.ratio(one, other) >= _LEAST_LETTERS


def _likeness(name: str, choice: str) -> float:
    """Return how much of two names is the same, percent: of their words in any order, or of their letters without gaps."""
    from rapidfuzz import fuzz

    one, other = _words(name), _words(choice)
    return max(fuzz.token_sort_ratio(one, other), fuzz.ratio(one.replace(" ", ""), other.replace(" ", "")))


def _words(name: str) -> str:
    """Return a name in small letters, its parts as words."""
    return " ".join("".join(letter if letter.isalnum() else " " for letter in name.lower()).split())
