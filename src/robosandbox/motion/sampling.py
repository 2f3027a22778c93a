"""Ways around obstacles by random sampling; OMPL does the sampling, on the project's own collision check."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from robosandbox.types import Array

_SEED = 1
_SHORTCUTS = 20

Free = Callable[[Array], bool]


def find_knots(
    free: Free,
    q_start: Array,
    q_goal: Array,
    lower: Array,
    upper: Array,
    *,
    checks: int = 20_000,
    resolution: float = 0.02,
) -> Array | None:
    """Return the knots of a free polyline in joint space, or None when none was found.

    RRT-Connect (Kuffner and LaValle, 2000), then its corners are cut. The same question gives the same answer.

    Args:
        free: Tells whether a configuration (n,) touches nothing.
        q_start: Shape (n,).
        q_goal: Shape (n,).
        lower: Joint limits, shape (n,).
        upper: Joint limits, shape (n,).
        checks: The most configurations to examine.
        resolution: Distance between examined configurations, in joint space.
    """
    try:
        from ompl import base, geometric, util
    except ImportError:
        # There are no wheels for this platform; the caller's own detours have to do.
        return None
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(_SEED)
    count = len(q_start)
    space = base.RealVectorStateSpace(count)
    bounds = base.RealVectorBounds(count)
    for index in range(count):
        ends = q_start[index], q_goal[index]
        # A start at its limit may lie a hair outside; a joint without limits gets half a turn to either side.
        low = lower[index] if np.isfinite(lower[index]) else min(ends) - np.pi
        high = upper[index] if np.isfinite(upper[index]) else max(ends) + np.pi
        bounds.setLow(index, float(min(low, *ends)))
        bounds.setHigh(index, float(max(high, *ends)))
    space.setBounds(bounds)
    information = base.SpaceInformation(space)
    examined = 0

    def valid(state: Any) -> bool:
        nonlocal examined
        examined += 1
        return bool(free(np.array([state[index] for index in range(count)])))

    information.setStateValidityChecker(valid)
    information.setStateValidityCheckingResolution(resolution / space.getMaximumExtent())
    information.setup()
    problem = base.ProblemDefinition(information)
    start: Any = information.allocState()
    goal: Any = information.allocState()
    for index in range(count):
        start[index], goal[index] = float(q_start[index]), float(q_goal[index])
    problem.setStartAndGoalStates(start, goal, 1e-6)
    planner = geometric.RRTConnect(information)
    planner.setProblemDefinition(problem)
    planner.setup()
    # Counted, not timed: a slow machine finds what a fast one finds.
    planner.solve(base.PlannerTerminationCondition(lambda: examined >= checks))
    if not problem.hasExactSolution():
        return None
    path: Any = problem.getSolutionPath()
    simplifier = geometric.PathSimplifier(information)
    simplifier.reduceVertices(path)
    simplifier.partialShortcutPath(path, _SHORTCUTS, _SHORTCUTS)
    states = (path.getState(index) for index in range(path.getStateCount()))
    return np.array([[state[index] for index in range(count)] for state in states])
