"""Heuristic of the plan search: calls that some goals still take, by relaxed regression and its cyclic dependencies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from robosandbox.types import ObservedScene, SkillCall
from robosandbox.values import frozen
from robosandbox.world.achievers import Achievers, subject_of
from robosandbox.world.contracts import find, lookup
from robosandbox.world.facts import Fact
from robosandbox.world.predicate import Finding, View

# Calls that it takes at least to break a cycle: a thing in it is put aside, to be moved again later.
_CALLS_PER_CYCLE = 1


@dataclass(slots=True)
class SearchState:
    """State of the search after some calls.

    Attributes:
        calls: The calls.
        view: The view in which relations are evaluated.
        moved: The goal for which each thing was moved last, by its id.
        told: Findings so far, by fact.
    """

    calls: tuple[SkillCall, ...]
    view: View
    moved: dict[str, Fact]
    told: dict[Fact, Finding]

    @property
    def scene(self) -> ObservedScene:
        """The scene as the calls leave it."""
        return self.view.scene

    def find(self, one: Fact) -> Finding:
        """Return whether a fact holds there."""
        if one not in self.told:
            self.told[one] = find(one, self.view)
        return self.told[one]

    def first_refuted(self, facts: Sequence[Fact]) -> Finding | None:
        """Return why the first of some facts that surely does not hold does not."""
        return next((found for one in facts if (found := self.find(one)).is_refuted), None)


@frozen
class Estimate:
    """Estimate of the work that a state leaves.

    Attributes:
        calls: How many calls are needed at least, as far as can be told without trying.
        lacking: The goals that do not hold, those first that wait for nothing else.
    """

    calls: int
    lacking: tuple[Fact, ...]


def estimate(state: SearchState, goals: Sequence[Fact], achievers: Achievers) -> Estimate:
    """Return an estimate of the calls that some goals still take.

    Each goal that does not hold takes a call, and more for what its needs lack, each thing in the way once (landmarks: Hoffmann,
    Porteous and Sebastia 2004). Things that wait for one another are a cycle; to break it one of them is put aside.
    """
    return _RelaxedRegression(state, goals, achievers).estimate()


class _RelaxedRegression:
    def __init__(self, state: SearchState, goals: Sequence[Fact], achievers: Achievers) -> None:
        self._state = state
        self._achievers = achievers
        self._lacking = [goal for goal in goals if not state.find(goal).holds]
        self._kept = [goal for goal in goals if state.find(goal).holds]
        # Things that are moved in any case, and the things that each of them waits for.
        self._moving = {subject_of(goal) for goal in self._lacking}
        self._waits: dict[str, set[str]] = {name: set() for name in self._moving}
        self._counted = {*self._lacking}
        self._in_the_way: set[Fact] = set()
        self._calls = 0

    def estimate(self) -> Estimate:
        todo = list(self._lacking)
        while todo:
            todo += self._unmet_needs(todo.pop())
        placed = [goal for goal in self._lacking if not lookup(goal).is_last]
        names = {subject_of(goal) for goal in placed}
        for goal in placed:
            # A tower is built from below.
            known = lookup(goal).objects(goal.arguments)
            self._waits[subject_of(goal)].update(name for name in known[1:] if name in names)
        order = sorted(self._lacking, key=lambda goal: (self._comes_last(goal), len(self._waits[subject_of(goal)])))
        return Estimate(self._calls + _CALLS_PER_CYCLE * feedback_vertex_count(self._waits), tuple(order))

    def _comes_last(self, goal: Fact) -> bool:
        """Tell whether a goal waits for others: a drawer is shut at last, but before other parts of its cabinet are opened."""
        others = (self._state.scene.find(subject_of(one)) for one in self._lacking if one != goal)
        about_parts = all(item is not None and item.is_fixed and item.id not in goal.arguments for item in others)
        return lookup(goal).is_last and not (goal.arguments and about_parts)

    def _unmet_needs(self, goal: Fact) -> list[Fact]:
        """Return what has to be brought about before a goal that nothing counted yet brings about; count the goal's call."""
        achievers = self._achievers.of(goal)
        name = subject_of(goal)
        if achievers:
            # A thing in the way is put aside with one call, where there is something to stand it on.
            self._calls += goal not in self._in_the_way
        found = []
        for need in achievers[0].needs if achievers else (goal,):
            finding = self._state.find(need)
            if not finding.is_refuted:
                continue
            if not finding.remedies:
                # Later preconditions are undefined once this one fails.
                break
            remedy = preferred(finding.remedies, self._moving)[0]
            other = subject_of(remedy)
            if other == name:
                # A need about the same thing, such as to hold it.
                found.append(remedy)
                continue
            self._waits.setdefault(name, set()).add(other)
            if other not in self._moving:
                self._in_the_way.add(remedy)
                self._moving.add(other)
                self._waits.setdefault(other, set())
                # Goals that hold for it now have to be reached again once it has moved.
                found += [remedy, *(kept for kept in self._kept if subject_of(kept) == other and kept != remedy)]
        found = [one for one in found if one not in self._counted]
        self._counted.update(found)
        return found


def preferred(remedies: Sequence[Fact], moving: set[str]) -> list[Fact]:
    """Return facts each of which would help, first those about what is to be moved anyway."""
    return sorted(remedies, key=lambda remedy: subject_of(remedy) not in moving)


def feedback_vertex_count(waits: dict[str, set[str]]) -> int:
    """Return the size of a feedback vertex set, nodes without which a graph has no cycle, found greedily.

    Args:
        waits: Each node's successors.
    """
    left = {name: {other for other in others if other in waits and other != name} for name, others in waits.items()}
    count = 0
    while True:
        _trim(left)
        if not left:
            return count
        into = {name: sum(name in others for others in left.values()) for name in left}
        worst = max(left, key=lambda name: into[name] * len(left[name]))
        _remove(left, worst)
        count += 1


def _trim(graph: dict[str, set[str]]) -> None:
    """Take out, again and again, what waits for nothing and what nothing waits for."""
    while True:
        awaited = set().union(*graph.values()) if graph else set()
        loose = [name for name, others in graph.items() if not others or name not in awaited]
        if not loose:
            return
        for name in loose:
            _remove(graph, name)


def _remove(graph: dict[str, set[str]], name: str) -> None:
    del graph[name]
    for others in graph.values():
        others.discard(name)
