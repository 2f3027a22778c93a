"""One checked fact about a robot and its sidecar."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Check:
    """The outcome of one check.

    Attributes:
        name: What was checked.
        ok: It is as it should be.
        detail: What was found, with figures; for a failure its cause.
        field: The field of the sidecar to change; None when none is to blame.
        counts: Whether a failure makes the robot unsound.
    """

    name: str
    ok: bool
    detail: str
    field: str | None = None
    counts: bool = True
