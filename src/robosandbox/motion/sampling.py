"""Ways around obstacles by random sampling; OMPL does the sampling, on the project's own collision check."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from robosandbox.types import Array

_SEED = 1
# Rounds of cutting corners, and rounds without an effect after which that ends; chosen as about the knots of a sampled way.
_SHORTCUTS = 20
# Distance at which a state counts as the goal, rad; chosen below what any servo resolves.
_AT_GOAL = 1e-6

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
    space = _space(base, np.stack([q_start, q_goal]), lower, upper)
    information = base.SpaceInformation(space)
    examined = 0

    def valid(state: Any) -> bool:
        nonlocal examined
        examined += 1
        return bool(free(_read(state, len(q_start))))

    information.setStateValidityChecker(valid)
    information.setStateValidityCheckingResolution(resolution / space.getMaximumExtent())
    information.setup()
    problem = base.ProblemDefinition(information)
    problem.setStartAndGoalStates(_state(information, q_start), _state(information, q_goal), _AT_GOAL)
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
    return np.array([_read(path.getState(index), len(q_start)) for index in range(path.getStateCount())])


def _space(base: Any, ends: Array, lower: Array, upper: Array) -> Any:
    """Return the joint space around two configurations (2, n)."""
    # A start at its limit may lie a hair outside; a joint without limits gets half a turn to either side.
    low = np.minimum(np.where(np.isfinite(lower), lower, ends.min(axis=0) - np.pi), ends.min(axis=0))
    high = np.maximum(np.where(np.isfinite(upper), upper, ends.max(axis=0) + np.pi), ends.max(axis=0))
    bounds = base.RealVectorBounds(len(low))
    for index in range(len(low)):
        bounds.setLow(index, float(low[index]))
        bounds.setHigh(index, float(high[index]))
    space = base.RealVectorStateSpace(len(low))
    space.setBounds(bounds)
    return space


def _state(information: Any, q: Array) -> Any:
    state = information.allocState()
    for index, value in enumerate(q.tolist()):
        state[index] = value
    return state


def _read(state: Any, count: int) -> Array:
    return np.array([state[index] for index in range(count)])
