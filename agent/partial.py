"""What the grammar is sure of in a sentence that it does not understand as a whole: bounds for whoever does, or a question.

The grammar is asked about clauses by themselves, as any planner is. What a clause forbids, what it says is alone to be moved, what
it names and how many it asks for hold for every plan for the sentence; where it is ambiguous, the person is asked first.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from robosandbox.agent.language.forbidden import forbidden
from robosandbox.protocols import Planner, Skill
from robosandbox.types import ObservedScene, Plan, Refusal, RefusalCode
from robosandbox.world.contracts import contract_of
from robosandbox.world.verifier import Constraints

# Where a clause may begin.
_BORDERS = re.compile(r"[,;:.!?\n]+|\b(?:(?<!nothing )but|and|while|then)\b", re.IGNORECASE)
# Beside these what a clause asks for may hold in a case only, or be taken back.
_OPEN = re.compile(
    r"\b(?:if|when|whenever|unless|until|till|once|or|whether|instead|rather|wait|no|actually|sorry|maybe|perhaps)\b",
    re.IGNORECASE,
)
_DENIES = re.compile(r"n['’]t\b|\b(?:not|never|without|except|leave|dont|avoid|nothing|only|how|why)\b", re.IGNORECASE)
_ONLY = re.compile(
    r"\b(?:only|just)\s+(?:move|touch|use|handle|take)\s+(.+)$"
    r"|\b(?:move|touch|use|handle|take)\s+(?:only|just|nothing\s+(?:but|except|other\s+than))\s+(.+)$",
    re.IGNORECASE,
)
# Words by which a clause leaves open which things, with how many it asks for where it says so.
_ANY = {"a": 1, "an": 1, "any": 1, "some": 1, "one": 1, "another": 1, "something": 1, "either": 1}
_NUMBERS = {"two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10}
# Number of clauses that are read. Chosen: reading one takes milliseconds.
_MOST_CLAUSES = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class PartialReading:
    """What is certain of a sentence.

    Attributes:
        constraints: What every plan for it keeps to.
        question: What only the person knows; None where nothing has to be asked.
    """

    constraints: Constraints = field(default_factory=Constraints)
    question: Refusal | None = None


def partial_reading(
    grammar: Planner, prompt: str, scene: ObservedScene, skills: Sequence[Skill[Any]]
) -> PartialReading:
    """Return what a grammar is sure of.

    Args:
        grammar: Plans for clauses, without memory of what was said before.
        prompt: What was said.
        scene: What perception sees.
        skills: What a plan may call.
    """
    names = [skill.name for skill in skills]
    clauses = [part.strip() for part in _BORDERS.split(prompt) if part.strip()][:_MOST_CLAUSES]
    moved: set[str] = set()
    fewest, question = 0, None
    for clause in () if _OPEN.search(prompt) else clauses:
        if _DENIES.search(clause):
            continue
        answer = grammar.plan(clause, scene, ())
        if isinstance(answer, Plan):
            named = _moved_by(answer, scene, skills)
            words = clause.lower().split()
            if not any(word in _ANY or word in _NUMBERS or word.isdigit() for word in words):
                moved |= named
            fewest = max(fewest, len(named))
        elif question is None and _asks_which(answer, scene):
            question = answer
    constraints = Constraints(
        never=forbidden(prompt, scene, names), only=_alone(clauses, scene, names), moved=frozenset(moved), fewest=fewest
    )
    return PartialReading(constraints=constraints, question=question)


def _moved_by(plan: Plan, scene: ObservedScene, skills: Sequence[Skill[Any]]) -> set[str]:
    """Return the ids of what a plan moves."""
    by_name = {skill.name: skill for skill in skills}
    contracts = [contract_of(by_name[call.skill], by_name[call.skill].check(call.arguments)) for call in plan.steps]
    ids = {item.id for item in scene.objects}
    return {name for contract in contracts if contract is not None for name in contract.moves if name in ids}


def _asks_which(answer: Refusal, scene: ObservedScene) -> bool:
    """Say whether a refusal is the question which of several things is meant."""
    ids = {item.id for item in scene.objects}
    return (
        answer.code is RefusalCode.AMBIGUOUS and answer.sure and bool(answer.candidates) and {*answer.candidates} <= ids
    )


def _alone(clauses: Sequence[str], scene: ObservedScene, names: Sequence[str]) -> frozenset[str] | None:
    """Return the ids of what alone may be moved; None where nobody says so, or the words for it are not understood."""
    found: frozenset[str] = frozenset()
    for number, clause in enumerate(clauses):
        match = _ONLY.search(clause)
        if match is None:
            continue
        # "the red cube and the blue cube" is two clauses.
        for end in range(len(clauses), number, -1):
            things = " and ".join([match[1] or match[2], *clauses[number + 1 : end]])
            # A description is resolved to all that it may mean where it is what must be spared.
            ids = forbidden(f"do not touch {things}", scene, names)
            if ids:
                found |= ids
                break
        else:
            return None
    return found or None
