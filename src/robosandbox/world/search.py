"""Search for the calls after which goals hold: best first over the order of goals, means-ends analysis for each of them.

A call whose promise is a goal is enabled by bringing about what it lacks first, call by call (Newell and Simon 1961). Over the
order in which goals are reached the search is weighted A* (Pohl 1970), with what lies ahead as told by `estimate`; a state's
successors are made one at a time (partial expansion: Yoshizumi, Miura and Ishida 2000), since the first mostly leads on.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

from robosandbox.types import DetectedObject, ObservedScene, SkillCall
from robosandbox.world.abilities import Abilities
from robosandbox.world.achievers import Achiever, Achievers, marks, subject_of
from robosandbox.world.contracts import apply_effects, find, lookup
from robosandbox.world.facts import TABLE, Fact, fact
from robosandbox.world.goal_conflicts import find_conflict
from robosandbox.world.heuristic import SearchState, estimate, preferred
from robosandbox.world.parking_spots import parking_spots
from robosandbox.world.predicate import View, predicates, sentence
from robosandbox.world.relations import on_table
from robosandbox.world.verifier import MAX_STEPS, Constraints

# Number of needs within needs, such as a tower that is cleared level by level; chosen as two a level for a dozen
# levels.
_DEEPEST = 24
# Values that are tried for arguments that a goal leaves open, such as a free spot. Chosen.
_MOST_CHOICES = 8
# States that are tried at most, and for each goal beside; a goal that can be reached mostly takes one or two. Chosen.
_MOST_STATES = 100
# Likewise, number of them for each goal. Chosen.
_MOST_STATES_A_GOAL = 25
# Number of states for each goal after which it is asked whether the goals can hold together at all. Chosen: twice what
# mostly does.
_DOUBT = 3
# Factor by which what lies ahead counts more than the calls so far. Chosen: with 1 all that is as short would be looked
# through.
_WEIGHT = 1.5


class NoWayError(Exception):
    """There are no calls that bring something about.

    Attributes:
        depth: How far from the goals it was found: the nearest cause is told.
    """

    def __init__(self, cause: str, depth: int = 0) -> None:
        super().__init__(cause)
        self.depth = depth


@dataclass(order=True, slots=True)
class _SearchNode:
    """A state in the queue: with its rank, and the goals that have not been tried from it."""

    rank: float
    ahead: int
    number: int
    state: SearchState = field(compare=False)
    todo: list[Fact] = field(compare=False)
    is_new: bool = field(compare=False, default=True)


class Search:
    """Finds calls that bring facts about.

    Args:
        start: The scene as it is.
        achievers: What may be called.
        asked: What was asked besides.
        robot: What the robot can do.
        avoided: Calls that are not planned, since they have failed.
    """

    def __init__(
        self,
        start: ObservedScene,
        achievers: Achievers,
        asked: Constraints,
        robot: Abilities,
        *,
        avoided: Sequence[SkillCall] = (),
    ) -> None:
        self._avoided = avoided
        self._start = start
        self._achievers = achievers
        self._asked = asked
        self._robot = robot
        self._kept_free: list[DetectedObject] = []

    def first(self) -> SearchState:
        """Return the state before any call."""
        return self._state((), self._start, {})

    def reach(self, goals: Sequence[Fact]) -> SearchState:
        """Return the cheapest state found in which all goals hold.

        Raises:
            NoWayError: There is none.
        """
        start = self.first()
        self._kept_free = list(self._claimed(goals))
        count = itertools.count()
        queue: list[_SearchNode] = []
        failure: NoWayError | None = None
        reached: list[tuple[SearchState, Fact]] = []

        def push(state: SearchState) -> None:
            told = estimate(state, goals, self._achievers)
            rank = len(state.calls) + _WEIGHT * told.calls
            heapq.heappush(queue, _SearchNode(rank, told.calls, next(count), state, list(told.lacking)))

        push(start)
        seen: set[tuple[object, ...]] = set()
        for number in range(_MOST_STATES + _MOST_STATES_A_GOAL * len(goals)):
            if number == _DOUBT * len(goals) or not queue:
                cause = find_conflict(goals, self._start, self._achievers, self._robot)
                if cause is not None:
                    raise NoWayError(cause, 0)
            if not queue:
                break
            node = heapq.heappop(queue)
            if not node.todo:
                return node.state
            if node.is_new:
                key = _key(node.state)
                if key in seen:
                    continue
                seen.add(key)
                node.is_new = False
            goal = node.todo.pop(0)
            try:
                state = self._bring_about(goal, node.state, (), goals)
                push(state)
                reached.append((state, goal))
            except NoWayError as error:
                failure = failure if failure is not None and failure.depth <= error.depth else error
            if node.todo:
                node.number = next(count)
                heapq.heappush(queue, node)
        if failure is not None:
            raise failure
        for state, goal in reached:
            finding = find(goal, state.view)
            if finding.is_refuted:
                raise NoWayError(f"after {', '.join(map(str, state.calls))} it would not be so: {finding.cause}")
        raise NoWayError("the goals exclude one another, as far as was searched")

    def _state(self, calls: tuple[SkillCall, ...], scene: ObservedScene, moved: dict[str, Fact]) -> SearchState:
        return SearchState(calls, View(scene=scene, before=self._start, robot=self._robot), moved, {})

    def _bring_about(
        self, goal: Fact, state: SearchState, path: tuple[Fact, ...], goals: Sequence[Fact]
    ) -> SearchState:
        """Return a state after calls that end in one which promises the goal, by the first achiever that works.

        Raises:
            NoWayError: There is none.
        """
        if goal in path or len(path) > _DEEPEST:
            raise NoWayError(f"{goal} needs itself to hold first", len(path))
        achievers = self._achievers.of(goal)
        if not achievers:
            return self._mended(goal, state, path, goals)
        failure: NoWayError | None = None
        # Skills for what an object is come first, and so does why they fail: a drawer is no door.
        for achiever in sorted(achievers, key=lambda one: not _suits(one, state)):
            try:
                return self._enabled(achiever, goal, state, (*path, goal), goals)
            except NoWayError as error:
                failure = failure or error
        raise failure or NoWayError(f"no skill brings about {goal}", len(path))

    def _mended(self, goal: Fact, state: SearchState, path: tuple[Fact, ...], goals: Sequence[Fact]) -> SearchState:
        """Return a state in which a goal that no skill promises holds, as it says itself what would help.

        Raises:
            NoWayError: It does not say, or that cannot be done.
        """
        for _ in range(_DEEPEST):
            finding = state.find(goal)
            if finding.holds:
                return state
            if not finding.remedies:
                raise NoWayError(f"no skill brings about {goal}", len(path))
            state = self._helped(finding.remedies, state, (*path, goal), goals)
        raise NoWayError(f"{goal} cannot be had at once", len(path))

    def _helped(
        self, remedies: Sequence[Fact], state: SearchState, path: tuple[Fact, ...], goals: Sequence[Fact]
    ) -> SearchState:
        """Return a state after one of some facts was brought about, best one of a thing that has to be moved anyway.

        Raises:
            NoWayError: None of them can be brought about.
        """
        lacking = {subject_of(goal) for goal in goals if not state.find(goal).holds}
        settled = {subject_of(goal) for goal in goals} - lacking
        failure: NoWayError | None = None
        for remedy in sorted(preferred(remedies, lacking), key=lambda one: subject_of(one) in settled):
            try:
                if remedy.arguments[1:] == (TABLE,) and remedy not in goals and state.scene.held is None:
                    return self._put_aside(remedy, state, path, goals)
                return self._bring_about(remedy, state, path, goals)
            except NoWayError as error:
                failure = failure or error
        raise failure or NoWayError("nothing would help", len(path))

    def _put_aside(
        self, remedy: Fact, state: SearchState, path: tuple[Fact, ...], goals: Sequence[Fact]
    ) -> SearchState:
        """Return a state after a thing was put aside: on another where that saves a call, as to stack does, else on the table.

        Raises:
            NoWayError: It cannot be taken, or there is no place for it.
        """
        if remedy in path:
            raise NoWayError(f"{remedy} needs itself to hold first", len(path))
        name, path = subject_of(remedy), (*path, remedy)
        # Obstacles to it are put aside before its place is chosen, since they take places themselves.
        for achiever in self._achievers.of(fact("holding", name))[:1]:
            state = self._ready(achiever, state, path, goals)
        lacking = {_claim(subject_of(goal)) for goal in goals if not state.find(goal).holds}
        claimed = [claim for claim in self._kept_free if claim.id in lacking]
        for aside in parking_spots(state, name, goals, claimed):
            if any(not achiever.picks for achiever in self._achievers.of(aside)):
                with suppress(NoWayError):
                    return self._bring_about(aside, state, path, goals)
        return self._bring_about(remedy, state, path[:-1], goals)

    def _enabled(
        self, achiever: Achiever, goal: Fact, state: SearchState, path: tuple[Fact, ...], goals: Sequence[Fact]
    ) -> SearchState:
        """Return the state after a call, and before it what it lacks; what the goal leaves open is chosen at last.

        Raises:
            NoWayError: What it lacks cannot be brought about.
        """
        state = self._ready(achiever, state, path, goals)
        return self._after(self._chosen(achiever, goal, state, len(path)), goal, state, len(path))

    def _ready(
        self, achiever: Achiever, state: SearchState, path: tuple[Fact, ...], goals: Sequence[Fact]
    ) -> SearchState:
        """Return a state in which what an achiever needs holds, but for what it leaves open.

        Raises:
            NoWayError: That cannot be brought about.
        """
        for _ in range(_DEEPEST):
            finding = state.first_refuted(achiever.needs)
            if finding is None:
                return state
            if not finding.remedies or len(state.calls) >= MAX_STEPS:
                raise NoWayError(sentence(finding), len(path))
            state = self._helped(finding.remedies, state, path, goals)
        raise NoWayError(f"what {achiever.call} needs cannot be had at once", len(path))

    def _chosen(self, achiever: Achiever, goal: Fact, state: SearchState, depth: int) -> SkillCall:
        """Return an achiever's call with values for what its goal leaves open, as the relations needed there choose them.

        Raises:
            NoWayError: None of the first few values will do.
        """
        if not achiever.choices:
            return achiever.call
        chooser = next((one for one in achiever.choices if predicates()[one.relation].choices is not None), None)
        choices = None if chooser is None else predicates()[chooser.relation].choices
        if chooser is None or choices is None:
            raise NoWayError(f"{achiever.call} leaves open what {achiever.choices[0]} is", depth)
        names = marks(chooser)
        given = [value for value in chooser.arguments if value not in names]
        claimed = tuple(item for item in self._kept_free if item.id != _claim(subject_of(goal)))
        free = replace(state.view, scene=replace(state.scene, objects=(*state.scene.objects, *claimed)))
        for values in itertools.islice(choices(free, *given), _MOST_CHOICES):
            bound = dict(zip(names, values, strict=True))
            filled = [
                Fact(one.relation, tuple(bound.get(str(v), v) for v in one.arguments)) for one in achiever.choices
            ]
            if state.first_refuted(filled) is None:
                arguments = {key: bound.get(str(value), value) for key, value in achiever.call.arguments.items()}
                call = SkillCall(skill=achiever.call.skill, arguments=arguments)
                if call not in self._avoided:
                    return call
        raise NoWayError(f"there is no free place for {given[0]}", depth)

    def _after(self, call: SkillCall, goal: Fact, state: SearchState, depth: int) -> SearchState:
        contract = self._achievers.contract(call).resolved(state.scene)
        asked = self._asked
        if call in self._avoided:
            raise NoWayError(f"{call} has failed before", depth)
        for name in contract.moves:
            if name in asked.never or (asked.only is not None and name not in asked.only):
                raise NoWayError(f"{call} would move {name}, which is not to be touched", depth)
            missing = [first for first, second in asked.order if second == name and first not in state.moved]
            if missing:
                raise NoWayError(f"{missing[0]} is to be moved before {name}", depth)
        moved = {**state.moved, **dict.fromkeys(contract.moves, goal)}
        return self._state((*state.calls, call), apply_effects(contract, state.scene), moved)

    def _claimed(self, goals: Sequence[Fact]) -> list[DetectedObject]:
        """Return things as goals want them to stand on the table, where nothing else is put aside."""
        found = []
        for goal in goals:
            move = lookup(goal).effect
            item = None if move is None else move(self._start, *goal.arguments).find(subject_of(goal))
            if (
                item is not None
                and item.id not in self._start.in_hands
                and on_table(item, self._start.table_height).holds
            ):
                found.append(replace(item, id=_claim(item.id)))
        return found


def _claim(name: str) -> str:
    return f"{name}/claimed"


def _key(state: SearchState) -> tuple[object, ...]:
    """Return what tells one state from another, wherever on the table things were put aside."""
    openings = tuple(round(item.opening or 0.0, 3) for item in state.scene.objects)
    held = frozenset((hand, name) for hand, name in state.scene.hands.items() if name is not None)
    return (held, openings, frozenset(state.moved.items()))


def _suits(achiever: Achiever, state: SearchState) -> bool:
    """Tell whether objects are of the kind that a call is for."""
    return all(state.find(need).holds for need in achiever.needs if lookup(need).is_fixed)
