"""What a sentence forbids to touch, as far as the grammar is sure of it, whatever else it may say: a bound for anybody's plan."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from robosandbox.agent.language.interpret import interpret, read
from robosandbox.types import ObservedScene, Refusal, RefusalCode

# Where a clause may begin. What is forbidden in a clause by itself is forbidden in the sentence.
_BORDERS = re.compile(r"[,;:.!?\n]+|\b(?:but|and|while|then)\b|(?=\bwithout\b)", re.IGNORECASE)
_FORBIDS = re.compile(
    r"n['’]t\b|\b(?:not|never|without|leave|leaving|keep|spare|avoid|alone|hands|stay|off|dont)\b", re.IGNORECASE
)
# Beside these a prohibition may hold for a while, or in a case only.
_CONDITIONS = re.compile(
    r"\b(?:until|till|unless|if|when|once|before|after|except|first|yet|instead|only|because)\b", re.IGNORECASE
)
# Number of clauses that are read. Chosen: reading takes milliseconds, and every run of clauses is read.
_MOST_CLAUSES = 10


def forbidden(prompt: str, scene: ObservedScene, skills: Iterable[str]) -> frozenset[str]:
    """Return the ids of what a sentence forbids to touch.

    Args:
        prompt: What was said.
        scene: What perception sees.
        skills: Names of the skills at hand.
    """
    if not _FORBIDS.search(prompt) or _CONDITIONS.search(prompt):
        return frozenset()
    clauses = [part.strip() for part in _BORDERS.split(prompt)]
    clauses = [part for part in clauses if part][:_MOST_CLAUSES]
    names = tuple(skills)
    found: set[str] = set()
    for start, clause in enumerate(clauses):
        if not _FORBIDS.search(clause):
            continue
        # The longest run that forbids and asks for nothing: "do not touch the cup and the bowl".
        for end in range(len(clauses), start, -1):
            spared = _spared(" and ".join(clauses[start:end]), scene, names)
            if spared:
                found |= spared
                break
    return frozenset(found)


def _spared(clauses: str, scene: ObservedScene, skills: Sequence[str]) -> frozenset[str]:
    """Return what words forbid to touch; nothing where they ask for something as well, or are not understood."""
    readings = read(clauses, scene, skills)
    if isinstance(readings, Refusal) or any(sentence.steps or not sentence.avoid for _, sentence in readings[:1]):
        return frozenset()
    answer = interpret(clauses, scene, skills)
    if not isinstance(answer, Refusal) or answer.code is not RefusalCode.UNSUPPORTED or not answer.sure:
        return frozenset()
    ids = {item.id for item in scene.objects}
    return frozenset(answer.candidates) if {*answer.candidates} <= ids else frozenset()
