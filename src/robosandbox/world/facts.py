"""Facts: relations with their arguments, as skills promise them, planners reach for them and people write them."""

from __future__ import annotations

import re
from collections.abc import Mapping

from robosandbox.values import frozen

Argument = str | float

# Stands for whatever the gripper holds when a step begins; no object has such an id.
HELD = "*held"
# The table, on which everything stands in the end.
TABLE = "table"

_FACT = re.compile(r"\s*([a-z_]+)\s*(?:\(([^()]*)\))?\s*(?:,|;|and\b|$)")


@frozen
class Fact:
    """A relation between named things.

    Attributes:
        relation: Its name, as in `predicates()`.
        arguments: Ids of objects, numbers in SI units, or words such as "left".
    """

    relation: str
    arguments: tuple[Argument, ...] = ()

    def resolved(self, names: Mapping[str, str | None]) -> Fact:
        """Return the fact with these arguments replaced, such as HELD by what is held; None leaves one as it is."""
        return Fact(self.relation, tuple(names.get(str(value)) or value for value in self.arguments))

    def __str__(self) -> str:
        return f"{self.relation}({', '.join(_written(value) for value in self.arguments)})"


def fact(relation: str, *arguments: Argument) -> Fact:
    """Return the fact that a relation holds between these."""
    return Fact(relation, arguments)


def parse_facts(text: str) -> tuple[Fact, ...]:
    """Return the facts that a text lists, as in "on(red_cube, blue_block), closed(drawer)".

    Raises:
        ValueError: It is not such a list.
    """
    found: list[Fact] = []
    at = 0
    while text[at:].strip():
        match = _FACT.match(text, at)
        if match is None:
            raise ValueError(f"{text[at:].strip()[:60]!r} is no relation; write it as on(red_cube, blue_block)")
        arguments = [part.strip() for part in (match[2] or "").split(",") if part.strip()]
        found.append(Fact(match[1], tuple(_value(part) for part in arguments)))
        at = match.end()
    if not found:
        raise ValueError("there is no relation in it; write it as on(red_cube, blue_block), closed(drawer)")
    return tuple(found)


def _value(text: str) -> Argument:
    try:
        return float(text)
    except ValueError:
        return text


def _written(value: Argument) -> str:
    if value == HELD:
        return "what is held"
    return f"{value:.3f}" if isinstance(value, float) else str(value)
