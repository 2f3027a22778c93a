"""A plan in the making, with the choices that were free."""

from __future__ import annotations

from dataclasses import dataclass, field

from robosandbox.agent.language.discourse import Discourse
from robosandbox.agent.language.intent import Command, Ref
from robosandbox.types import Refusal, SkillCall


@dataclass(frozen=True)
class Step:
    """A skill call and what would do in its place.

    Attributes:
        call: The call.
        others: Calls that mean the same to the person: another side, another free spot.
    """

    call: SkillCall
    others: tuple[SkillCall, ...] = ()


@dataclass(frozen=True)
class Rest:
    """What of a sentence only time can tell.

    Attributes:
        steps: What is to be done, the first of it under the condition that is decided then.
        avoid: What is not to be touched.
        discourse: What was spoken of before.
        text: The condition, as said.
    """

    steps: tuple[Command, ...]
    avoid: tuple[Ref, ...]
    discourse: Discourse
    text: str


@dataclass(frozen=True)
class Draft:
    """A plan with the choices that were free.

    Attributes:
        steps: In order.
        substitutes: For objects chosen among several ("a cube"): what would do as well.
        rest: What is decided when the steps are done and the robot has looked again.
        nothing: Why there are no steps, where a condition does not hold and nothing else is told.
        note: What of the sentence the steps take no account of, or how it is obeyed beside them, for the person; "" for nothing.
        tempo: How fast the steps are gone through; "" at the usual tempo.
        question: What is to be told when the steps are done; "" for nothing.
    """

    steps: tuple[Step, ...]
    substitutes: dict[str, tuple[str, ...]] = field(default_factory=dict)
    rest: Rest | None = None
    nothing: Refusal | None = None
    note: str = ""
    tempo: str = ""
    question: str = ""

    @property
    def calls(self) -> tuple[SkillCall, ...]:
        """The skill calls."""
        return tuple(step.call for step in self.steps)
