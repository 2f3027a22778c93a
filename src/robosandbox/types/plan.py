"""Skill calls, the plans made of them, a planner's refusals, and what came of a call."""

from __future__ import annotations

from enum import StrEnum
from typing import Any

from pydantic import Field

from robosandbox.spatial import StrictModel

# Characters of a prompt; chosen above any paragraph that a person dictates.
MAX_PROMPT_LENGTH = 4000


class SkillCall(StrictModel):
    """A call of a skill.

    Attributes:
        skill: Its name.
        arguments: As its schema says.
    """

    skill: str
    arguments: dict[str, Any] = Field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.skill}({', '.join(f'{k}={v}' for k, v in self.arguments.items())})"


class Plan(StrictModel):
    """Skill calls in the order in which they run.

    Attributes:
        steps: The calls; none where nothing has to move.
        answer: What the person is told, where a question was asked.
        then: What only time can tell, and the planner looks at when the steps are done; "" where all is decided.
        note: What of the prompt the steps take no account of, or how it is obeyed beside them; "" where there is nothing.
        tempo: How fast they are gone through, by the name of a tempo; "" at the usual one.
    """

    steps: tuple[SkillCall, ...]
    answer: str = ""
    then: str = ""
    note: str = ""
    tempo: str = ""

    def __str__(self) -> str:
        steps = ", ".join(map(str, self.steps)) or self.answer or "nothing to do"
        steps += f", then look: “{self.then}”" if self.then else ""
        return f"{steps} ({self.note})" if self.note else steps


class RefusalCode(StrEnum):
    """Reason of a refusal to plan."""

    OBJECT_NOT_FOUND = "object_not_found"
    AMBIGUOUS = "ambiguous"
    UNSUPPORTED = "unsupported"
    UNRECOGNIZED = "unrecognized"
    IMPOSSIBLE = "impossible"


class Refusal(StrictModel):
    """A planner's no.

    Attributes:
        code: Its kind.
        message: A sentence for the person.
        candidates: What could have been meant: object ids or verbs.
        sure: Whether the planner understood all that was said, so that asking another one cannot help.
    """

    code: RefusalCode
    message: str
    candidates: tuple[str, ...] = ()
    sure: bool = True


class SkillResult(StrictModel):
    """A skill's checked outcome.

    Attributes:
        skill: Its name.
        detail: The measured post-condition.
        side_effects: What else changed, in sentences.
        found: What it has found out, in a sentence, where somebody asks for that; "" for what only does something.
    """

    skill: str
    detail: dict[str, float | str | bool] = Field(default_factory=dict)
    side_effects: tuple[str, ...] = ()
    found: str = ""
