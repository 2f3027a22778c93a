"""Workspace limit of the tool centre point, checked before a call and at every control tick."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robosandbox.driver import Driver
from robosandbox.errors import LimitError, Phase
from robosandbox.evidence import LimitEvidence
from robosandbox.types import DIRECTION_AXES, ObservedScene, SkillCall, Workspace
from robosandbox.world.relations import centre

# How far outside a TCP may be, metres; chosen well above the 0.6 mm by which the bundled arm was measured to leave its
# planned path, for arms with weaker servos; the line itself is the planner's business.
TOLERANCE = 0.01
# How much farther out a TCP has to come to be stopped again, metres; chosen far below the 1 mm that it moves in a tick
# at 0.1 m/s, and far above rounding.
_PROGRESS = 1e-4
_AXES = "xyz"


def check_call(call: SkillCall, scene: ObservedScene, workspace: Workspace) -> None:
    """Refuse a call whose place or object is outside before anything moves.

    Raises:
        LimitError: It is.
    """
    for what, point in _places(call.arguments, scene):
        for axis, value in zip(_AXES, point, strict=False):
            error = _violation(what, axis, value, workspace, 0.0, Phase.CHECK)
            if error is not None:
                raise error


class WorkspaceGuard:
    """A guard that stops the arm when its TCP leaves the workspace; moving back in is always allowed.

    Args:
        sim: Whose arm.
        workspace: Where its TCP may be.
    """

    def __init__(self, sim: Driver, workspace: Workspace) -> None:
        self._sim = sim
        self._workspace = workspace
        self._outside: dict[str, float] = {}
        self._time = 0.0

    def __call__(self) -> LimitError | None:
        """Return what is wrong with where the TCP is: it is outside and went further out."""
        state = self._sim.state()
        if state.time < self._time:
            # A reset: wherever the arm was put, it may come in from there.
            self._outside.clear()
        self._time = state.time
        for axis, value in zip(_AXES, state.tcp_pose.xyz, strict=True):
            now = _outside(axis, value, self._workspace)
            before = self._outside.get(axis, now)
            self._outside[axis] = now
            if now > max(TOLERANCE, before + _PROGRESS):
                return _violation("the tool centre point", axis, value, self._workspace, TOLERANCE, Phase.APPROACH)
        return None


def _places(arguments: Mapping[str, Any], scene: ObservedScene) -> list[tuple[str, tuple[float, ...]]]:
    """Return the points that a call is about: coordinates, objects, and where a push ends."""
    places: list[tuple[str, tuple[float, ...]]] = []
    if "x" in arguments and "y" in arguments:
        places.append(("the place", (float(arguments["x"]), float(arguments["y"]))))
    for key in ("object", "target", "container", "drawer"):
        thing = scene.find(str(arguments.get(key)))
        if thing is not None:
            places.append((thing.id, tuple(float(c) for c in centre(thing)[:2])))
    pushed = scene.find(str(arguments.get("object")))
    axis = DIRECTION_AXES.get(str(arguments.get("direction")))
    if pushed is not None and axis is not None:
        distance = float(arguments.get("distance", 0.1))
        at = centre(pushed)
        end = (float(at[0]) + axis[0] * distance, float(at[1]) + axis[1] * distance)
        places.append((f"where {pushed.id} would be pushed", end))
    return places


def _outside(axis: str, value: float, workspace: Workspace) -> float:
    bounds = getattr(workspace, axis)
    return 0.0 if bounds is None else max(bounds[0] - value, value - bounds[1], 0.0)


def _violation(
    what: str, axis: str, value: float, workspace: Workspace, tolerance: float, phase: Phase
) -> LimitError | None:
    if _outside(axis, value, workspace) <= tolerance:
        return None
    low, high = getattr(workspace, axis)
    return LimitError(
        f"{what} is at {axis} = {value:.3f} m, outside the workspace's {low:g}..{high:g}; the arm does not go there: "
        "choose something inside, or widen limits.workspace in the task",
        phase=phase,
        evidence=LimitEvidence(quantity=f"{what}, {axis}", value=value, low=low, high=high),
    )
