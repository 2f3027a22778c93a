"""Conflicts between goals that cannot hold together, told in a scene with nothing else in the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from robosandbox.types import ObservedScene
from robosandbox.world.abilities import Abilities
from robosandbox.world.achievers import HAND_RELATIONS, Achievers, subject_of
from robosandbox.world.contracts import find, lookup
from robosandbox.world.effects import taken
from robosandbox.world.facts import TABLE, Fact, fact
from robosandbox.world.placement_sampling import free_placements
from robosandbox.world.predicate import View, sentence


def find_conflict(goals: Sequence[Fact], start: ObservedScene, achievers: Achievers, robot: Abilities) -> str | None:
    """Return why some goals cannot hold together; None where nothing is found that speaks against it.

    What goals are about is brought about in order, supports first, in a scene from which all that could be put away is gone;
    what could be done first, such as to open a drawer, is taken for done.
    """
    return _ConflictSearch(goals, start, achievers, robot).first()


class _ConflictSearch:
    def __init__(self, goals: Sequence[Fact], start: ObservedScene, achievers: Achievers, robot: Abilities) -> None:
        self._start = start
        self._achievers = achievers
        self._robot = robot
        self._all = tuple(goals)
        self._goals = [goal for goal in goals if lookup(goal).effect is not None and not lookup(goal).is_last]
        named = {name for goal in goals for name in lookup(goal).objects(goal.arguments)}
        self._left = {subject_of(goal) for goal in self._goals}
        kept = (item for item in start.objects if item.id in named or item.shape.stays_put)
        emptied = dict.fromkeys(start.hands)
        self._scene = replace(start, hands=emptied, objects=tuple(item for item in kept if item.id not in self._left))
        # By which goal each thing has been placed.
        self._placed: dict[str, Fact] = {}

    def first(self) -> str | None:
        for goal in self._goals:
            cause = self._untakeable(goal)
            if cause is not None:
                return cause
        todo = list(self._goals)
        while todo:
            ready = [one for one in todo if not self._rests_on_what_is_left(one)]
            if not ready:
                return f"{' and '.join(map(str, todo))} each need another of them to hold first"
            todo.remove(ready[0])
            cause = self._against(ready[0])
            if cause is not None:
                return cause
        return self._undone_at_last()

    def _undone_at_last(self) -> str | None:
        """Return which goal another undoes that is brought about at last, such as that a drawer is shut."""
        for last in self._all:
            move = lookup(last).effect
            if not lookup(last).is_last or move is None:
                continue
            scene = move(self._scene, *last.arguments)
            view = View(scene=scene, before=self._start, robot=self._robot)
            undone = next((goal for goal in self._all if goal != last and find(goal, view).is_refuted), None)
            if undone is not None and subject_of(undone) == subject_of(last):
                return f"{undone} and {last} exclude one another"
        return None

    def _rests_on_what_is_left(self, goal: Fact) -> bool:
        return bool(self._left & {*lookup(goal).objects(goal.arguments)[1:]})

    def _untakeable(self, goal: Fact) -> str | None:
        """Return why what a goal is about cannot be had in the hand, whatever is done first."""
        view = View(scene=self._start, before=self._start, robot=self._robot)
        if find(goal, view).holds:
            return None
        name = subject_of(goal)
        causes = []
        for achiever in self._achievers.of(goal):
            picks = self._achievers.of(fact("holding", name))[:1] if achiever.picks else ()
            needs = [need for one in (*picks, achiever) for need in one.needs]
            own = [need for need in needs if {*lookup(need).objects(need.arguments)} <= {name}]
            finding = next((found for need in own if (found := find(need, view)).is_refuted), None)
            if finding is None or finding.remedies:
                return None
            causes.append(sentence(finding))
        return causes[0] if causes else None

    def _against(self, goal: Fact) -> str | None:
        """Return what speaks against a goal among those placed before; place what it is about where nothing does."""
        name = subject_of(goal)
        if name in self._placed:
            finding = find(goal, View.of(self._scene, self._robot))
            return f"{self._placed[name]} and {goal} exclude one another" if finding.is_refuted else None
        item = self._start.find(name)
        if item is None:
            return sentence(find(goal, View.of(self._start)))
        there = replace(self._scene, objects=(*self._scene.objects, item))
        cause: str | None = None
        for achiever in self._achievers.of(goal):
            held = taken(there, name)
            why = None
            for need in achiever.needs:
                if need.relation in HAND_RELATIONS or {*lookup(need).objects(need.arguments)} <= {name}:
                    continue
                finding = find(need, View(scene=held, before=self._start, robot=self._robot))
                if not finding.is_refuted:
                    continue
                in_the_way = [remedy for remedy in finding.remedies if subject_of(remedy) not in self._placed]
                if not in_the_way:
                    why = sentence(finding)
                    break
                move = lookup(in_the_way[0]).effect
                held = held if move is None else move(held, *in_the_way[0].arguments)
            if why is None:
                self._place(goal, held)
                return None
            cause = cause or why
        return cause

    def _place(self, goal: Fact, held: ObservedScene) -> None:
        name = subject_of(goal)
        item = held.find(name)
        spot = next(free_placements(held, item), None) if item is not None and goal.arguments[1:] == (TABLE,) else None
        # A goal that leaves the place on the table open gets a free one.
        there = goal if spot is None else fact("at", name, *spot.xy)
        move = lookup(there).effect
        self._scene = held if move is None else move(held, *there.arguments)
        self._placed[name] = goal
        self._left.discard(name)
