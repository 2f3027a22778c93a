"""Where an arm may be, whatever anybody plans: its tool centre point and its links, checked at every control tick."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robosandbox.driver.protocols import Arm
from robosandbox.errors import LimitError, Phase
from robosandbox.evidence import LimitEvidence
from robosandbox.types import Array, Workspace

# How far outside a TCP may be, metres; chosen well above the 0.6 mm by which the bundled arm was measured to leave its
# planned path, for arms with weaker servos; the line itself is the planner's business.
TOLERANCE = 0.01
# How much farther out than it was let be a part of the arm has to come to be stopped again, metres; chosen as a fifth of that,
# above what encoders' noise of 0.2 mrad makes of a TCP that stands (0.4 mm).
PROGRESS = 0.2 * TOLERANCE
AXES = "xyz"
_TCP = "the tool centre point"


class WorkspaceGuard:
    """A guard that stops the arm when its TCP or a link leaves the workspace; moving back in is always allowed.

    A link that is outside at the arm's home is not kept in on that side: an arm that stands beside its workspace cannot be in it.

    Args:
        arm: Which one.
        workspace: Where it may be.
    """

    def __init__(self, arm: Arm, workspace: Workspace) -> None:
        self._arm = arm
        self._workspace = workspace
        self._outline = arm.spec.outline
        bounds = [getattr(workspace, axis) or (-np.inf, np.inf) for axis in AXES]
        self._low, self._high = (np.array(side) for side in zip(*bounds, strict=True))
        if self._outline is not None:
            # What is kept of each point on each side, as the bound itself or one that is never passed.
            low, high = self._sides(arm.spec.home_q, self._low, self._high)
            self._low_of = np.where(self._of_links(low.T), -np.inf, self._low)
            self._high_of = np.where(self._of_links(high.T), np.inf, self._high)
        # How far outside the TCP, and the links on each side, were let be: where that was told of, or came back to since.
        self._outside: dict[tuple[str, str], float] = {}
        self._time = 0.0

    def __call__(self) -> LimitError | None:
        """Return what is wrong with where the arm is: a part of it is outside and went further out."""
        state = self._arm.state()
        if state.time < self._time:
            # A reset: wherever the arm was put, it may come in from there.
            self._outside.clear()
        self._time = state.time
        for axis, value in zip(AXES, state.tcp_pose.xyz, strict=True):
            if self._is_further_out(_TCP, axis, _outside(axis, value, self._workspace)):
                return violation(_TCP, axis, value, self._workspace, TOLERANCE, Phase.APPROACH)
        return self._links(state.q)

    def _links(self, q: Array) -> LimitError | None:
        outline = self._outline
        if outline is None:
            return None
        sides = self._sides(q, self._low_of, self._high_of)
        for side, past, bound, sign in zip(("low", "high"), sides, (self._low, self._high), (-1.0, 1.0), strict=True):
            for index, point in enumerate(past.argmax(axis=0).tolist()):
                out = max(float(past[point, index]), 0.0)
                if self._is_further_out(side, AXES[index], out):
                    link, value = outline.links[int(outline.link_of[point])], float(bound[index]) + sign * out
                    return violation(link, AXES[index], value, self._workspace, TOLERANCE, Phase.APPROACH)
        return None

    def _sides(self, q: Array, low: Array, high: Array) -> tuple[Array, Array]:
        """Return how far each point is past the lower and the upper bounds at a configuration (n,), metres, each (k, 3)."""
        assert self._outline is not None
        places, radii = self._outline.places(q), self._outline.radii[:, None]
        return low - (places - radii), (places + radii) - high

    def _of_links(self, past: Array) -> NDArray[np.bool_]:
        """Return whether any point of each point's link is past a bound, from how far each is, shape (3, k); shape (k, 3)."""
        assert self._outline is not None
        most = np.full((3, len(self._outline.links)), -np.inf)
        for axis in range(3):
            np.maximum.at(most[axis], self._outline.link_of, past[axis])
        beyond: NDArray[np.bool_] = (most > 0.0)[:, self._outline.link_of].T
        return beyond

    def _is_further_out(self, part: str, axis: str, now: float) -> bool:
        """Take note of how far a part is outside, and tell whether that is further than it was let be."""
        before = self._outside.get((part, axis), now)
        self._outside[part, axis] = min(now, before)
        if now <= max(TOLERANCE, before + PROGRESS):
            return False
        self._outside[part, axis] = now
        return True


def _outside(axis: str, value: float, workspace: Workspace) -> float:
    bounds = getattr(workspace, axis)
    return 0.0 if bounds is None else max(bounds[0] - value, value - bounds[1], 0.0)


def violation(
    what: str, axis: str, value: float, workspace: Workspace, tolerance: float, phase: str
) -> LimitError | None:
    """Return what is wrong with a coordinate of something that may be so far outside, metres; None where nothing is."""
    if _outside(axis, value, workspace) <= tolerance:
        return None
    low, high = getattr(workspace, axis)
    return LimitError(
        f"{what} is at {axis} = {value:.3f} m, outside the workspace's {low:g}..{high:g}; the arm does not go there: "
        "choose something inside, or widen limits.workspace in the task",
        phase=phase,
        evidence=LimitEvidence(quantity=f"{what}, {axis}", value=value, low=low, high=high),
    )
