"""Heuristic of the plan search: calls that some goals still take, by relaxed regression and its cyclic dependencies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from robosandbox.types import ObservedScene, SkillCall
from robosandbox.world.contracts import find, lookup
from robosandbox.world.facts import Fact
from robosandbox.world.predicate import Finding, View
from robosandbox.world.ways import Ways, subject_of

# Calls that it takes at least to put a thing aside which has to be moved twice.
_ASIDE = 1


@dataclass(slots=True)
class State:
    """State of the search after some calls.

    Attributes:
        calls: They themselves.
        view: What relations are told from there.
        moved: What the calls move, by id, and what each was moved for last.
        told: What has been found there.
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


@dataclass(frozen=True, slots=True)
class Outlook:
    """Estimate of the work that a state leaves.

    Attributes:
        calls: How many calls are needed at least, as far as can be told without trying.
        lacking: The goals that do not hold, those first that wait for nothing else.
    """

    calls: int
    lacking: tuple[Fact, ...]


def outlook(state: State, goals: Sequence[Fact], ways: Ways) -> Outlook:
    """Return what is left to do for some goals.

    Each goal that does not hold takes a call, and more for what its needs lack, each thing in the way once (landmarks: Hoffmann,
    Porteous and Sebastia 2004). Things that wait for one another are a knot; to undo it one of them is put aside.
    """
    return _Outlook(state, goals, ways).told()


class _Outlook:
    def __init__(self, state: State, goals: Sequence[Fact], ways: Ways) -> None:
        self._state = state
        self._ways = ways
        self._lacking = [goal for goal in goals if not state.find(goal).holds]
        self._kept = [goal for goal in goals if state.find(goal).holds]
        # What is moved anyway, and what each of those waits for.
        self._moving = {subject_of(goal) for goal in self._lacking}
        self._waits: dict[str, set[str]] = {name: set() for name in self._moving}
        self._counted = {*self._lacking}
        self._in_the_way: set[Fact] = set()
        self._calls = 0

    def told(self) -> Outlook:
        todo = list(self._lacking)
        while todo:
            todo += self._before(todo.pop())
        placed = [goal for goal in self._lacking if not lookup(goal).is_last]
        names = {subject_of(goal) for goal in placed}
        for goal in placed:
            # A tower is built from below.
            known = lookup(goal).objects(goal.arguments)
            self._waits[subject_of(goal)].update(name for name in known[1:] if name in names)
        order = sorted(self._lacking, key=lambda goal: (lookup(goal).is_last, len(self._waits[subject_of(goal)])))
        return Outlook(self._calls + _ASIDE * knots(self._waits), tuple(order))

    def _before(self, goal: Fact) -> list[Fact]:
        """Return what has to be brought about before a goal that nothing counted yet brings about; count the goal's call."""
        ways = self._ways.of(goal)
        name = subject_of(goal)
        if ways:
            # A thing in the way is put aside with one call, where there is something to stand it on.
            self._calls += goal not in self._in_the_way
        found = []
        for need in ways[0].needs if ways else (goal,):
            finding = self._state.find(need)
            if not finding.is_refuted:
                continue
            if not finding.remedies:
                # What comes after it need not make sense: the grip of what is no drawer.
                break
            remedy = preferred(finding.remedies, self._moving)[0]
            other = subject_of(remedy)
            if other == name:
                # What it takes of the same thing, such as to pick it.
                found.append(remedy)
                continue
            self._waits.setdefault(name, set()).add(other)
            if other not in self._moving:
                self._in_the_way.add(remedy)
                self._moving.add(other)
                self._waits.setdefault(other, set())
                # What holds of it has to be reached anew.
                found += [remedy, *(kept for kept in self._kept if subject_of(kept) == other and kept != remedy)]
        found = [one for one in found if one not in self._counted]
        self._counted.update(found)
        return found


def preferred(remedies: Sequence[Fact], moving: set[str]) -> list[Fact]:
    """Return facts each of which would help, first those about what is to be moved anyway."""
    return sorted(remedies, key=lambda remedy: subject_of(remedy) not in moving)


def knots(waits: dict[str, set[str]]) -> int:
    """Return how many nodes have to be taken out of a graph so that nothing in it waits for itself, found greedily.

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
