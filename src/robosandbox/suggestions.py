"""Which of the valid names a misspelt one was probably meant to be."""

from __future__ import annotations

from collections.abc import Iterable


def nearest(name: str, choices: Iterable[str], *, limit: int = 3) -> tuple[str, ...]:
    """Return the choices that look like a misspelt `name`, the likeliest first."""
    from rapidfuzz import fuzz, process, utils

    found = process.extract(
        name[:200], list(choices), scorer=fuzz.WRatio, processor=utils.default_process, limit=limit, score_cutoff=60.0
    )
    return tuple(choice for choice, _, _ in found)


def did_you_mean(name: str, choices: Iterable[str]) -> str:
    """Return "; did you mean 'x'?", or nothing when no choice is near."""
    near = nearest(name, choices)
    if not near:
        return ""
    return f"; did you mean {' or '.join(repr(choice) for choice in near[:2])}?"
