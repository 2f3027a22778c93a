"""A goal in relations as a criterion: each relation judged by the check of the same meaning, on simulated state."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Literal

from pydantic import field_validator

from robosandbox.errors import InputError
from robosandbox.tasks.judge.attitude import Lying, Upright
from robosandbox.tasks.judge.checks import AtHome, Beside, Check, Closed, Inside, Lifted, On, Opened, TurnedTo
from robosandbox.tasks.judge.finding import Judgement
from robosandbox.tasks.judge.place_checks import At
from robosandbox.types import Truth
from robosandbox.world.contracts import lookup
from robosandbox.world.facts import Fact, parse_facts

# How far a drawer is open that counts as open, millimetres; chosen as half of the way of the smallest bundled one.
_OPEN_MM = 60.0

_CHECKS: dict[str, Callable[..., Check]] = {
    "on": lambda a, b: On(kind="on", object=a, target=b),
    "inside": lambda a, c: Inside(kind="inside", object=a, target=c),
    "at": lambda a, x, y, yaw=None: At(kind="at", object=a, x=x, y=y, yaw=yaw),
    "beside": lambda a, b, side: Beside(kind="beside", object=a, target=b, side=side),
    "open": lambda d, share=None: Opened(kind="opened", object=d, min_mm=_OPEN_MM, share=share),
    "closed": lambda d: Closed(kind="closed", object=d),
    "turned_to": lambda p, share: TurnedTo(kind="turned_to", object=p, share=share),
    "upright": lambda a: Upright(kind="upright", object=a),
    "lying": lambda a: Lying(kind="lying", object=a),
    "holding": lambda a, hand=None: Lifted(kind="lifted", object=a, hand=hand),
    "at_home": lambda: AtHome(kind="at_home"),
}


class GoalReached(Check):
    """Every relation of a goal, written as in "on(red_cube, blue_block), closed(drawer)"."""

    kind: Literal["goal"]
    relations: str

    @field_validator("relations")
    @classmethod
    def _relations_are_judged(cls, value: str) -> str:
        try:
            facts = parse_facts(value)
            for one in facts:
                lookup(one)
        except (ValueError, InputError) as error:
            raise ValueError(str(error)) from None
        strange = [one for one in facts if one.relation not in _CHECKS]
        if strange:
            raise ValueError(f"{strange[0]}: nobody judges that; there is {', '.join(_CHECKS)}")
        return value

    def children(self) -> Iterator[tuple[str, Check]]:
        """Return the check of each relation, by the relation itself."""
        yield from ((f"relations[{number}]", check) for number, check in enumerate(self._checks()))

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Evaluate each."""
        found = [check.evaluate(start, now) for check in self._checks()]
        detail: dict[str, float] = {}
        for one, finding in zip(parse_facts(self.relations), found, strict=True):
            detail.update({f"{one}.{key}": value for key, value in finding.detail.items()})
        return Judgement(all(found), detail)

    def settled(self, start: Truth, now: Truth) -> Iterator[str]:
        """Yield those of each."""
        for check in self._checks():
            yield from check.settled(start, now)

    def _checks(self) -> list[Check]:
        return [_check(one) for one in parse_facts(self.relations)]


def _check(one: Fact) -> Check:
    arguments: tuple[Any, ...] = one.arguments
    return _CHECKS[one.relation](*arguments)
