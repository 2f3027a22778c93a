"""Success criteria of tasks: checks and what joins them, written in the task file and verified when it is loaded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

from pydantic import Field

from robosandbox.tasks.goals import GoalReached
from robosandbox.tasks.judge.attitude import Lying, Upright
from robosandbox.tasks.judge.checks import (
    AtHome,
    Beside,
    Check,
    Closed,
    Displaced,
    Inside,
    Lifted,
    MovedAbove,
    On,
    Opened,
    Tapped,
    TurnedTo,
    Undisturbed,
)
from robosandbox.tasks.judge.finding import Judgement
from robosandbox.tasks.judge.place_checks import At, InPlaceOf
from robosandbox.tasks.judge.poured import Poured
from robosandbox.types import Truth


class AllOf(Check):
    """Every one of the checks."""

    kind: Literal["all"]
    checks: Annotated[tuple[Criterion, ...], Field(min_length=1)]

    def children(self) -> Iterator[tuple[str, Check]]:
        """Return the checks inside this one, each with its field."""
        yield from ((f"checks[{index}]", check) for index, check in enumerate(self.checks))

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Evaluate each."""
        found = [check.evaluate(start, now) for check in self.checks]
        return Judgement(all(found), merged(self.checks, found))

    def settled(self, start: Truth, now: Truth) -> Iterator[str]:
        """Yield those of each."""
        for check in self.checks:
            yield from check.settled(start, now)


class AnyOf(Check):
    """At least one of the checks; with `hold_s`, at each moment at least one."""

    kind: Literal["any"]
    checks: Annotated[tuple[Criterion, ...], Field(min_length=1)]

    def children(self) -> Iterator[tuple[str, Check]]:
        """Return the checks inside this one, each with its field."""
        yield from ((f"checks[{index}]", check) for index, check in enumerate(self.checks))

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Evaluate each."""
        found = [check.evaluate(start, now) for check in self.checks]
        return Judgement(any(found), merged(self.checks, found))

    def settled(self, start: Truth, now: Truth) -> Iterator[str]:
        """Yield those of each that holds."""
        for check in self.checks:
            if check.evaluate(start, now):
                yield from check.settled(start, now)


class NotOf(Check):
    """The check is false."""

    kind: Literal["not"]
    check: Criterion

    def children(self) -> Iterator[tuple[str, Check]]:
        """Return the checks inside this one, each with its field."""
        yield "check", self.check

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Evaluate it and turn the answer round."""
        found = self.check.evaluate(start, now)
        return Judgement(not found.holds, found.detail)


Criterion = Annotated[
    Lifted
    | On
    | Inside
    | Beside
    | At
    | InPlaceOf
    | Displaced
    | MovedAbove
    | Opened
    | Closed
    | Upright
    | Lying
    | Poured
    | Tapped
    | TurnedTo
    | AtHome
    | Undisturbed
    | GoalReached
    | AllOf
    | AnyOf
    | NotOf,
    Field(discriminator="kind"),
]
# Their fields name the kinds above them: what an error calls a field is looked up there.
for _joined in (AllOf, AnyOf, NotOf):
    _joined.model_rebuild()


def merged(checks: Sequence[Check], found: Sequence[Judgement]) -> dict[str, float]:
    """Return the measurements of several checks, each under the object that it is about if they are about several."""
    found_by_name: dict[str, float] = {}
    subjects = [_subject(check) for check in checks]
    alone = len({subject for subject in subjects if subject}) < 2
    for subject, relation in zip(subjects, found, strict=True):
        subject = "" if alone else subject
        found_by_name.update({f"{subject}.{key}" if subject else key: value for key, value in relation.detail.items()})
    return found_by_name


def _subject(check: Check) -> str:
    if isinstance(check, NotOf):
        return _subject(check.check)
    if isinstance(check, Undisturbed) and check.object is None:
        return ""
    return next((name for _, name, _ in check.references()), "")
