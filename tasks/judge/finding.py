"""The answer of a check."""

from __future__ import annotations

from dataclasses import field

from robosandbox.values import frozen


@frozen
class Judgement:
    """Result of a check, and the measurements that say so.

    Attributes:
        holds: The answer.
        detail: Measurements by name; millimetres where the name ends in `_mm`.
    """

    holds: bool
    detail: dict[str, float] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return self.holds
