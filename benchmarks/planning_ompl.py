"""OMPL's RRT-Connect where `motion/sampling.py` has its own, for `benchmarks/planning.py --beside-ompl` (group `kinematics`)."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from ompl import base, geometric, util

from robosandbox.motion.sampling import Free
from robosandbox.types import Array

# Distances between examined configurations, rad, first and where that was too coarse.
_RESOLUTIONS = (0.02, 0.005)
_CHECKS = 20_000
_SHORTCUTS = 20


def find_knots(free: Free, q_start: Array, q_goal: Array, lower: Array, upper: Array) -> Array | None:
    """Return the knots (k, n) of a free polyline, or None when none was found."""
    for resolution in _RESOLUTIONS:
        knots = _sampled(free, q_start, q_goal, lower, upper, resolution)
        if knots is None or all(free(q, other) for q, other in itertools.pairwise(knots)):
            return knots
    return None


def _sampled(free: Free, q_start: Array, q_goal: Array, lower: Array, upper: Array, resolution: float) -> Array | None:
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(1)
    count, examined = len(q_start), 0
    bounds = base.RealVectorBounds(count)
    for index in range(count):
        bounds.setLow(index, float(min(lower[index], q_start[index], q_goal[index])))
        bounds.setHigh(index, float(max(upper[index], q_start[index], q_goal[index])))
    space = base.RealVectorStateSpace(count)
    space.setBounds(bounds)
    information = base.SpaceInformation(space)

    def valid(state: Any) -> bool:
        nonlocal examined
        examined += 1
        q = _read(state, count)
        return free(q, q)

    information.setStateValidityChecker(valid)
    information.setStateValidityCheckingResolution(resolution / space.getMaximumExtent())
    information.setup()
    problem = base.ProblemDefinition(information)
    problem.setStartAndGoalStates(_state(information, q_start), _state(information, q_goal), 1e-6)
    planner = geometric.RRTConnect(information)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(base.PlannerTerminationCondition(lambda: examined >= _CHECKS))
    if not problem.hasExactSolution():
        return None
    path: Any = problem.getSolutionPath()
    simplifier = geometric.PathSimplifier(information)
    simplifier.reduceVertices(path)
    simplifier.partialShortcutPath(path, _SHORTCUTS, _SHORTCUTS)
    return np.array([_read(path.getState(index), count) for index in range(path.getStateCount())])


def _state(information: Any, q: Array) -> Any:
    state = information.allocState()
    for index, value in enumerate(q.tolist()):
        state[index] = value
    return state


def _read(state: Any, count: int) -> Array:
    return np.array([state[index] for index in range(count)])
