"""Completion by Tab: verbs, names of what is seen, /commands, files and cameras."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from robosandbox.agent.language.front import ENGLISH
from robosandbox.agent.language.ruleset import ruleset

_MOST_PER_VERB = 12  # Number of completions of one verb. Chosen: what fits on a screen.
_CALLED = {"place": "put"}
# What is said to a skill whose name is no verb.
_SAID = {"home": ("go home",)}
_COMPOSED = ("swap", "sort", "line_up", "unstack", "tidy")


def verbs_for(skills: Iterable[str]) -> tuple[str, ...]:
    """Return what people say to a robot with these skills, as in "pick up"; the plainest words of each verb."""
    names = list(skills)
    canonical = [_CALLED.get(part, part) for part in (name.partition("_")[0] for name in names)]
    if "pick" in canonical and "put" in canonical:
        canonical += _COMPOSED
    classes = ruleset(ENGLISH).vocabulary.classes
    found: list[str] = []
    for name, verb in zip([*names, *_COMPOSED], canonical, strict=False):
        said = sorted(classes.get(f"V{verb.upper()}", ()), key=lambda phrase: phrase.split()[0] != verb)
        found += said[:_MOST_PER_VERB] or _SAID.get(name, (name.replace("_", " "),))
    return tuple(dict.fromkeys(word.strip() for word in found))


def endings(text: str, phrases: Sequence[str]) -> Iterator[tuple[str, int]]:
    """Yield the phrases that go on where the text ends, each with how many characters of it are there already.

    "put it on the red c" goes on with "red cube", of which 5 characters are there.
    """
    lowered = text.lower()
    starts = [0] + [index + 1 for index, character in enumerate(lowered) if character in " ,"]
    for phrase in phrases:
        for start in starts:
            if phrase.lower().startswith(lowered[start:]):
                yield phrase, len(text) - start
                break
