"""Guard of an arm against itself and what stands there fixed: nothing is commanded into that, and the arm stops where it comes into it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robosandbox.driver.protocols import Arm
from robosandbox.driver.workspace import PROGRESS, TOLERANCE
from robosandbox.errors import LimitError, Phase
from robosandbox.evidence import LimitEvidence
from robosandbox.types import Array, Trajectory
from robosandbox.values import frozen


@frozen
class Meeting:
    """Part of an arm that is within something.

    Attributes:
        part: Of the arm.
        other: Another part of the arm, or a fixture.
        depth: How far, metres.
    """

    part: str
    other: str
    depth: float


Meets = Callable[[Array], Meeting | None]
"""Returns the deepest that an arm meets at a configuration (n,), or None."""


class SurroundingsGuard:
    """A guard that keeps an arm out of itself and of what stands there; moving out of it is always allowed.

    Args:
        arm: Which one.
        meets: What it meets at a configuration.
    """

    def __init__(self, arm: Arm, meets: Meets) -> None:
        self._arm, self._meets = arm, meets
        # How deep in something it was let be: as it was found, where that was told of, or as far as it came out since.
        self._let_be: float | None = None

    def check(self, rows: Array) -> None:
        """Check configurations, shape (k, n), before they are commanded.

        Raises:
            LimitError: One of them is in something, deeper than the arm is now; nothing has moved.
        """
        now = self._depth(self._meets(self._arm.state().q))
        for row in rows:
            met = self._meets(row)
            if met is not None and met.depth > max(TOLERANCE, now + PROGRESS):
                raise self._error(met, "would be", "; nothing has moved: choose a way that clears it")

    def check_trajectory(self, trajectory: Trajectory) -> None:
        """Check the rows of a trajectory between which no point of the arm goes farther than it may be in something; errors as of `check`."""
        gone = self._arm.spec.reach[1] * np.abs(np.diff(trajectory.q, axis=0)).sum(axis=1)
        numbers = np.unique((np.concatenate([[0.0], np.cumsum(gone)]) / TOLERANCE).astype(int), return_index=True)[1]
        self.check(np.concatenate([trajectory.q[numbers], trajectory.q[-1:]]))

    def __call__(self) -> LimitError | None:
        """Return what is wrong with where the arm is: it is in something and went deeper."""
        met = self._meets(self._arm.state().q)
        depth = self._depth(met)
        before = depth if self._let_be is None else self._let_be
        self._let_be = min(depth, before)
        if met is None or depth <= max(TOLERANCE, before + PROGRESS):
            return None
        self._let_be = depth
        return self._error(met, "is", "; the arm holds: move it out of there")

    @staticmethod
    def _depth(met: Meeting | None) -> float:
        return 0.0 if met is None else max(met.depth, 0.0)

    def _error(self, met: Meeting, how: str, then: str) -> LimitError:
        return LimitError(
            f"{met.part} {how} {1e3 * met.depth:.0f} mm deep in {met.other}{then}",
            phase=Phase.CHECK,
            evidence=LimitEvidence(
                quantity=f"depth of {met.part} in {met.other}, m", value=met.depth, low=0.0, high=TOLERANCE
            ),
        )
