"""Partial reading of a sentence that the grammar does not understand as a whole: bounds for a planner, or a question.

What the sentence forbids, and what it says is alone to be moved, are read in the grammar's chart (`language/bounds.py`). Beside that
clauses are planned for by themselves: the thing that one names and how many it asks for hold for every plan for the sentence; where
one is ambiguous, the person is asked first.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import field

from robosandbox.agent.language.bounds import bounds_of, is_corrected
from robosandbox.agent.language.wordlist import word_set
from robosandbox.agent.protocols import Planner
from robosandbox.types import ObservedScene, Plan, Refusal, RefusalCode
from robosandbox.values import frozen
from robosandbox.world.operators import Operator, bind
from robosandbox.world.verifier import Constraints

# Where a clause may begin.
_BORDERS = re.compile(r"[,;:.!?\n]+|\b(?:(?<!nothing )but|and|while|then)\b", re.IGNORECASE)
# Beside these what a clause asks for may hold in a case only, or be taken back.
_OPEN = re.compile(
    r"\b(?:if|when|whenever|unless|until|till|once|or|whether|instead|rather|wait|no|nah|forget|actually|sorry|maybe|perhaps)\b",
    re.IGNORECASE,
)
_DENIES = re.compile(r"n['’]t\b|\b(?:not|never|without|except|leave|dont|avoid|nothing|only|how|why)\b", re.IGNORECASE)
# Words by which a clause leaves open which things it is about.
_ANY = word_set("a an any some one another something either two three four five six seven eight nine ten")
# Number of clauses that are read. Chosen: reading one takes milliseconds.
_MOST_CLAUSES = 10


@frozen(kw_only=True)
class PartialReading:
    """Certain parts of a sentence's meaning.

    Attributes:
        constraints: What every plan for it keeps to.
        question: What only the person knows; None where nothing has to be asked.
    """

    constraints: Constraints = field(default_factory=Constraints)
    question: Refusal | None = None


def partial_reading(grammar: Planner, prompt: str, scene: ObservedScene, skills: Sequence[Operator]) -> PartialReading:
    """Return what a grammar is sure of.

    Args:
        grammar: Plans for clauses, without memory of what was said before.
        prompt: What was said.
        scene: What perception sees.
        skills: What a plan may call.
    """
    moved: set[str] = set()
    fewest, question = 0, None
    for clause in _asking(prompt, scene):
        answer = grammar.plan(clause, scene, ())
        if isinstance(answer, Plan):
            named = _moved_by(answer, scene, skills)
            is_open = any(word in _ANY or word.isdigit() for word in clause.lower().split())
            # A plural may lose some to an exception in another clause: "all the fruit, but the lime does not".
            if is_open or len(named) == 1:
                moved |= set() if is_open else named
                fewest = max(fewest, len(named))
        elif question is None and _asks_which(answer, scene):
            question = answer
    bounds = bounds_of(prompt, scene, [skill.name for skill in skills])
    # What is forbidden holds against what a clause by itself seems to ask for.
    free = moved - bounds.never if bounds.only is None else moved & bounds.only
    constraints = Constraints(never=bounds.never, only=bounds.only, moved=frozenset(free), fewest=fewest)
    return PartialReading(constraints=constraints, question=question)


def _asking(prompt: str, scene: ObservedScene) -> list[str]:
    """Return the clauses that ask for something by themselves; none where any of it may not hold."""
    if _OPEN.search(prompt) or is_corrected(prompt, scene):
        return []
    clauses = [part.strip() for part in _BORDERS.split(prompt) if part.strip()][:_MOST_CLAUSES]
    return [clause for clause in clauses if not _DENIES.search(clause)]


def _moved_by(plan: Plan, scene: ObservedScene, skills: Sequence[Operator]) -> set[str]:
    """Return the ids of what a plan moves."""
    by_name = {skill.name: skill for skill in skills}
    contracts = [bind(call, by_name).contract for call in plan.steps]
    ids = {item.id for item in scene.objects}
    return {name for contract in contracts for name in contract.moves if name in ids}


def _asks_which(answer: Refusal, scene: ObservedScene) -> bool:
    """Say whether a refusal is the question which of several things is meant."""
    ids = {item.id for item in scene.objects}
    return (
        answer.code is RefusalCode.AMBIGUOUS and answer.sure and bool(answer.candidates) and {*answer.candidates} <= ids
    )
