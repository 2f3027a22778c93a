"""Where the tool centre point may be, whatever anybody plans: checked at every control tick."""

from __future__ import annotations

from robosandbox.driver.protocols import Driver
from robosandbox.errors import LimitError, Phase
from robosandbox.evidence import LimitEvidence
from robosandbox.types import Workspace

# How far outside a TCP may be, metres; chosen well above the 0.6 mm by which the bundled arm was measured to leave its
# planned path, for arms with weaker servos; the line itself is the planner's business.
TOLERANCE = 0.01
# How much farther out than it was let be a TCP has to come to be stopped again, metres; chosen as a fifth of that, above what
# encoders' noise of 0.2 mrad makes of a TCP that stands (0.4 mm).
_PROGRESS = 0.2 * TOLERANCE
AXES = "xyz"


class WorkspaceGuard:
    """A guard that stops the arm when its TCP leaves the workspace; moving back in is always allowed.

    Args:
        sim: Whose arm.
        workspace: Where its TCP may be.
    """

    def __init__(self, sim: Driver, workspace: Workspace) -> None:
        self._sim = sim
        self._workspace = workspace
        # How far outside it was let be: where it was told of, or came back to since.
        self._outside: dict[str, float] = {}
        self._time = 0.0

    def __call__(self) -> LimitError | None:
        """Return what is wrong with where the TCP is: it is outside and went further out."""
        state = self._sim.state()
        if state.time < self._time:
            # A reset: wherever the arm was put, it may come in from there.
            self._outside.clear()
        self._time = state.time
        for axis, value in zip(AXES, state.tcp_pose.xyz, strict=True):
            now = _outside(axis, value, self._workspace)
            before = self._outside.get(axis, now)
            self._outside[axis] = min(now, before)
            if now > max(TOLERANCE, before + _PROGRESS):
                self._outside[axis] = now
                return violation("the tool centre point", axis, value, self._workspace, TOLERANCE, Phase.APPROACH)
        return None


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
