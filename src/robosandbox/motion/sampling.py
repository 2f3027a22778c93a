"""Ways around obstacles by random sampling: two trees that grow towards each other, and corners cut afterwards."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robosandbox.types import Array

# Longest edge of a tree, in joint space; tried with benchmarks/planning.py: with half of it or twice as much the slowest take longer.
_RANGE = 1.0
# Share of all the ways that may be examined after which a tree that has not grown in between is taken for enclosed; tried with
# benchmarks/planning.py: what is found there is found as before.
_ENCLOSED = 0.05
# Rounds of cutting corners after each of which the way is as short or shorter; chosen as about twice the knots of a sampled way.
_SHORTCUTS = 40
# Share of a way's length below which a corner is not worth cutting; chosen: far below what anybody sees.
_WORTH = 1e-3

# Tells whether the straight way in joint space between two configurations (n,) touches nothing.
Free = Callable[[Array, Array], bool]


def find_knots(
    free: Free, q_start: Array, q_goal: Array, lower: Array, upper: Array, *, ways: int = 4_000, seed: int = 1
) -> Array | None:
    """Return the knots (k, n) of a free polyline in joint space, or None when none was found.

    RRT-Connect (Kuffner and LaValle, "RRT-Connect: An Efficient Approach to Single-Query Path Planning", 2000), then
    corners are cut between random points of it (Geraerts and Overmars, "Creating High-quality Paths for Motion
    Planning", 2007). The same question gives the same answer.

    Args:
        free: Tells whether a straight way touches nothing.
        q_start: Shape (n,).
        q_goal: Shape (n,).
        lower: Joint limits, shape (n,).
        upper: Joint limits, shape (n,).
        ways: The most straight ways to examine.
        seed: Of what is sampled.
    """
    rng = np.random.default_rng(seed)
    left = ways

    def counted(q: Array, other: Array) -> bool:
        nonlocal left
        left -= 1
        return free(q, other)

    # A start at its limit may lie a hair outside; a joint without limits gets half a turn to either side.
    low = np.where(np.isfinite(lower), lower, np.minimum(q_start, q_goal) - np.pi)
    high = np.where(np.isfinite(upper), upper, np.maximum(q_start, q_goal) + np.pi)
    growing, other = _Tree(q_start), _Tree(q_goal)
    while left > 0 and growing.in_vain < _ENCLOSED * ways:
        reached, _ = growing.step(rng.uniform(low, high), counted)
        growing.in_vain = growing.in_vain + 1 if reached is None else 0
        if reached is not None:
            met = other.connect(growing.nodes[reached], counted)
            if met is not None:
                knots = [*reversed(growing.back(reached)), *other.back(met)[1:]]
                if growing.nodes[0] is not q_start:
                    knots.reverse()
                return _shortened(np.array(knots), free, rng)
        growing, other = other, growing
    return None


class _Tree:
    """Configurations that are joined by free ways to the first.

    Attributes:
        nodes: All of them, each of shape (n,).
        in_vain: How often in a row it was to grow and did not.
    """

    def __init__(self, root: Array) -> None:
        self.nodes, self._parents = [root], [0]
        self.in_vain = 0
        self._all = np.empty((64, len(root)))
        self._all[0] = root

    def step(self, target: Array, free: Free) -> tuple[int | None, bool]:
        """Grow by one edge towards `target` (n,); return the new node, if there is one, and whether it is the target."""
        nearest = int(((self._all[: len(self.nodes)] - target) ** 2).sum(axis=1).argmin())
        return self._grow(nearest, target, free)

    def connect(self, target: Array, free: Free) -> int | None:
        """Grow towards `target` (n,) as far as the way is free; return its node when that is all the way."""
        node, there = self.step(target, free)
        while node is not None and not there:
            node, there = self._grow(node, target, free)
        return node

    def back(self, node: int) -> list[Array]:
        """Return the configurations from a node to the root."""
        found = [self.nodes[node]]
        while node != 0:
            node = self._parents[node]
            found.append(self.nodes[node])
        return found

    def _grow(self, node: int, target: Array, free: Free) -> tuple[int | None, bool]:
        begin = self.nodes[node]
        way = target - begin
        length = float(np.sqrt(way @ way))
        there = length <= _RANGE
        end = target if there else begin + (_RANGE / length) * way
        if not free(begin, end):
            return None, False
        count = len(self.nodes)
        if count == len(self._all):
            self._all = np.concatenate([self._all, np.empty_like(self._all)])
        self._all[count] = end
        self.nodes.append(end)
        self._parents.append(node)
        return count, there


def _shortened(knots: Array, free: Free, rng: np.random.Generator) -> Array:
    """Return the knots of a way that is as long or shorter."""
    for _ in range(_SHORTCUTS):
        if len(knots) < 3:
            break
        steps = np.linalg.norm(np.diff(knots, axis=0), axis=1)
        gone = np.concatenate([[0.0], np.cumsum(steps)])
        ends = np.sort(rng.uniform(0.0, gone[-1], 2))
        first, last = (_at(knots, gone, end) for end in ends)
        if ends[1] - ends[0] - np.linalg.norm(last - first) < _WORTH * gone[-1]:
            continue
        if free(first, last):
            kept = (knots[gone < ends[0]], [first, last], knots[gone > ends[1]])
            knots = np.concatenate(kept)
    return knots


def _at(knots: Array, gone: Array, distance: float) -> Array:
    """Return the configuration (n,) so far along a polyline."""
    index = min(int(np.searchsorted(gone, distance, side="right")) - 1, len(knots) - 2)
    share = (distance - gone[index]) / max(gone[index + 1] - gone[index], 1e-12)
    found: Array = knots[index] + share * (knots[index + 1] - knots[index])
    return found
