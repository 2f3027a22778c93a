"""Findings about a robot: why a field has its value, and whether one is right."""

from __future__ import annotations

from robosandbox.values import frozen


@frozen
class CheckResult:
    """The outcome of one check.

    Attributes:
        name: What was checked.
        ok: It is as it should be.
        detail: What was found, with figures; for a failure its cause.
        field: The field of the sidecar to change; None when none is to blame. Of a check that passed, the one to doubt
            first where the robot fails in simulation.
        counts: Whether a failure makes the robot unsound.
    """

    name: str
    ok: bool
    detail: str
    field: str | None = None
    counts: bool = True


@frozen
class FieldEvidence:
    """Reason for a field's value: how sure (0..1), and the evidence in words."""

    confidence: float
    evidence: str
