"""Plans for goals: the cheapest calls, by skills' contracts, after which the goals hold in the imagined scene.

A call whose promise is a goal is enabled by bringing about what it lacks first, call by call (means-ends analysis, Newell and
Simon 1961); over the order in which goals are reached A* is searched, with the number of goals that do not hold as its bound.
"""

from __future__ import annotations

import contextlib
import heapq
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from robosandbox.types import ObservedScene, Plan, Refusal, RefusalCode, SkillCall
from robosandbox.world.abilities import Abilities
from robosandbox.world.contracts import Contract, contract_of, find, first_refuted, imagined, lookup
from robosandbox.world.facts import HELD, TABLE, Fact, fact
from robosandbox.world.predicate import View, predicates, sentence
from robosandbox.world.verifier import MAX_STEPS, Constraints, verify

# Needs that take the hand are seen to last: it is free until then.
_OF_THE_HAND = ("holding", "hand_empty", "hand_ready")
# Number of needs within needs, such as a tower that is cleared level by level; chosen as two a level for a dozen
# levels; more only lengthens searches that go round in circles.
_DEEPEST = 24
# Values that are tried for arguments that a goal leaves open, such as a free spot.
_MOST_CHOICES = 3
# Number of states that the order of goals is searched over; chosen above the 128 ways in which some of seven goals are
# done.
_MOST_STATES = 200


class Plannable(Protocol):
    """What is asked of a skill here."""

    @property
    def name(self) -> str:
        """As calls name it."""
        ...

    @property
    def schema(self) -> Mapping[str, Any]:
        """JSON schema of its arguments."""
        ...

    def check(self, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the arguments converted to their types; raises InvalidArgumentError."""
        ...


class _NoWayError(Exception):
    """There are no calls that bring something about."""

    def __init__(self, cause: str, depth: int) -> None:
        super().__init__(cause)
        self.depth = depth


@dataclass(frozen=True, slots=True)
class _State:
    """Where calls lead.

    Attributes:
        calls: They themselves.
        scene: As they leave it.
        moved: What they move, by id, and what each was moved for last.
    """

    calls: tuple[SkillCall, ...]
    scene: ObservedScene
    moved: Mapping[str, Fact] = field(default_factory=dict)


def achieve(
    goals: Sequence[Fact],
    scene: ObservedScene,
    skills: Sequence[Plannable],
    *,
    constraints: Constraints | None = None,
    robot: Abilities | None = None,
) -> Plan | Refusal:
    """Return a plan after which goals hold, or why there is none; drawers that it opens on the way are closed again.

    Args:
        goals: What is to hold in the end.
        scene: What is seen now.
        skills: What may be called; those without a contract are not.
        constraints: What was asked besides.
        robot: What the robot can do; None denies nothing but what is far out of reach.

    Raises:
        InputError: A goal names no relation, or gives it other arguments than it takes.
    """
    for goal in goals:
        lookup(goal)
    asked = constraints or Constraints()
    search = _Search(scene, skills, asked, robot or Abilities())
    try:
        found = search.all(tuple(goals), _State((), scene))
    except _NoWayError as failure:
        return Refusal(code=RefusalCode.IMPOSSIBLE, message=f"There is no plan: {failure}.")
    shut = [one for one in _shut_before(scene, search.view(scene)) if not _speaks_of(goals, one)]
    # What is too tall for its drawer keeps that open.
    with contextlib.suppress(_NoWayError):
        found = search.all((*goals, *shut), found)
    plan = Plan(steps=found.calls)
    wrong = verify(plan, scene, skills, constraints=replace(asked, end=(*asked.end, *goals)), robot=robot).problems
    if wrong:
        return Refusal(code=RefusalCode.IMPOSSIBLE, message=f"There is no plan: {wrong[0]}.")
    return plan


def _shut_before(scene: ObservedScene, view: View) -> list[Fact]:
    """Return that the drawers which are shut now are shut."""
    facts = [fact("closed", item.id) for item in scene.objects if item.shape.opens]
    return [one for one in facts if find(one, view).holds]


def _speaks_of(goals: Sequence[Fact], one: Fact) -> bool:
    return any(goal.relation in ("open", "closed") and goal.arguments == one.arguments for goal in goals)


class _Search:
    """Finds calls that bring facts about."""

    def __init__(self, start: ObservedScene, skills: Sequence[Plannable], asked: Constraints, robot: Abilities) -> None:
        self._start = start
        self._skills = {skill.name: skill for skill in skills if getattr(skill, "contract", None) is not None}
        self._asked = asked
        self._robot = robot
        self._patterns = {name: _pattern(skill) for name, skill in self._skills.items()}

    def view(self, scene: ObservedScene) -> View:
        """Return what relations are told from in a scene."""
        return View(scene=scene, before=self._start, robot=self._robot)

    def all(self, goals: tuple[Fact, ...], start: _State) -> _State:
        """Return the cheapest state found in which all goals hold: A* over the order in which they are reached.

        Raises:
            _NoWayError: There is none.
        """
        count = itertools.count()
        queue: list[tuple[int, int, int, _State]] = []
        failure: _NoWayError | None = None
        least = {goal: self._least(goal) for goal in goals}

        def push(state: _State) -> None:
            view = self.view(state.scene)
            left = sum(least[goal] for goal in goals if not find(goal, view).holds)
            heapq.heappush(queue, (len(state.calls) + left, left, next(count), state))

        push(start)
        seen: set[tuple[object, ...]] = set()
        for _ in range(_MOST_STATES):
            if not queue:
                break
            _, left, _, state = heapq.heappop(queue)
            if left == 0:
                return state
            key = _key(state)
            if key in seen:
                continue
            seen.add(key)
            view = self.view(state.scene)
            for goal in _ready([goal for goal in goals if not find(goal, view).holds]):
                try:
                    push(self._bring_about(goal, state, (), goals))
                except _NoWayError as error:
                    failure = failure if failure is not None and failure.depth <= error.depth else error
        raise failure or _NoWayError("the goals exclude one another, as far as was searched", 0)

    def _least(self, goal: Fact) -> int:
        """Return how many calls a goal takes at least: what is put somewhere is picked first."""
        promising = (
            one for one in self._patterns.values() if any(_unified(gift, goal) is not None for gift in one.gives)
        )
        return min((2 if fact("holding", HELD) in one.needs else 1 for one in promising), default=1)

    def _bring_about(self, goal: Fact, state: _State, path: tuple[Fact, ...], goals: tuple[Fact, ...]) -> _State:
        """Return the cheapest state after calls that end in one which promises the goal.

        Raises:
            _NoWayError: There is none.
        """
        if goal in path or len(path) > _DEEPEST:
            raise _NoWayError(f"{goal} needs itself to hold first", len(path))
        best: _State | None = None
        failure = _NoWayError(f"no skill brings about {goal}", len(path))
        for call in self._ways(goal):
            if best is not None and len(best.calls) <= len(state.calls) + 1:
                break
            try:
                found = self._enabled(call, goal, state, (*path, goal), goals)
            except _NoWayError as error:
                failure = error
                continue
            if best is None or len(found.calls) < len(best.calls):
                best = found
        if best is None:
            raise failure
        return best

    def _enabled(
        self, call: SkillCall, goal: Fact, state: _State, path: tuple[Fact, ...], goals: tuple[Fact, ...]
    ) -> _State:
        """Return the state after a call, and before it what it lacks; what the goal leaves open is chosen at last.

        Raises:
            _NoWayError: What it lacks cannot be brought about.
        """
        contract = self._contract(call)
        subject = str(goal.arguments[0]) if goal.arguments else None
        needs = sorted(contract.resolved(replace(state.scene, held=subject)).needs, key=_takes_the_hand)
        settled, open_ones = [one for one in needs if not _marks(one)], [one for one in needs if _marks(one)]
        for _ in range(_DEEPEST):
            lacking = first_refuted(settled, self.view(state.scene))
            if lacking is None:
                return self._after(self._chosen(call, open_ones, state, len(path)), goal, state, len(path))
            _, finding = lacking
            if not finding.remedies or len(state.calls) >= MAX_STEPS:
                raise _NoWayError(sentence(finding), len(path))
            for remedy in finding.remedies:
                state = self._bring_about(remedy, state, path, goals)
        raise _NoWayError(f"what {call} needs cannot be had at once", len(path))

    def _chosen(self, call: SkillCall, needs: Sequence[Fact], state: _State, depth: int) -> SkillCall:
        """Return a call with values for what a goal leaves open, as the relations needed there choose them.

        Raises:
            _NoWayError: None of the first few values will do.
        """
        if not needs:
            return call
        view = self.view(state.scene)
        chooser = next((one for one in needs if predicates()[one.relation].choices is not None), None)
        choices = None if chooser is None else predicates()[chooser.relation].choices
        if chooser is None or choices is None:
            raise _NoWayError(f"{call} leaves open what {needs[0]} is", depth)
        marks = _marks(chooser)
        given = [value for value in chooser.arguments if value not in marks]
        for values in itertools.islice(choices(view, *given), _MOST_CHOICES):
            bound = dict(zip(marks, values, strict=True))
            filled = [Fact(one.relation, tuple(bound.get(str(v), v) for v in one.arguments)) for one in needs]
            if first_refuted(filled, view) is None:
                arguments = {key: bound.get(str(value), value) for key, value in call.arguments.items()}
                return SkillCall(skill=call.skill, arguments=arguments)
        raise _NoWayError(f"there is no free place for {given[0]}", depth)

    def _contract(self, call: SkillCall) -> Contract:
        skill = self._skills[call.skill]
        is_open = any(str(value).startswith("*") for value in call.arguments.values())
        return contract_of(skill, call.arguments if is_open else skill.check(call.arguments)) or Contract()

    def _after(self, call: SkillCall, goal: Fact, state: _State, depth: int) -> _State:
        contract = self._contract(call).resolved(state.scene)
        asked = self._asked
        for name in contract.moves:
            if name in asked.never or (asked.only is not None and name not in asked.only):
                raise _NoWayError(f"{call} would move {name}, which is not to be touched", depth)
            missing = [first for first, second in asked.order if second == name and first not in state.moved]
            if missing:
                raise _NoWayError(f"{missing[0]} is to be moved before {name}", depth)
        moved = {**state.moved, **dict.fromkeys(contract.moves, goal)}
        return _State((*state.calls, call), imagined(contract, state.scene), moved)

    def _ways(self, goal: Fact) -> Iterator[SkillCall]:
        """Yield calls that promise a goal; what it leaves open keeps its mark."""
        for name, pattern in self._patterns.items():
            bound = next((b for gift in pattern.gives if (b := _unified(gift, goal)) is not None), None)
            if bound is None:
                continue
            fields = self._skills[name].schema
            required = fields.get("required", ())
            arguments = {key: bound.get(f"*{key}", f"*{key}") for key in fields.get("properties", {})}
            kept = {key: value for key, value in arguments.items() if f"*{key}" in bound or key in required}
            yield SkillCall(skill=name, arguments=kept)


def _ready(goals: Sequence[Fact]) -> Sequence[Fact]:
    """Return the goals that no other one undoes: those on things that are not to be moved themselves; all if there are none.

    A tower's lower levels are landmarks of the upper ones.
    """
    subjects = {goal.arguments[0] for goal in goals if goal.arguments}
    return [goal for goal in goals if not subjects & {*goal.arguments[1:]}] or goals


def _pattern(skill: Plannable) -> Contract:
    """Return a skill's contract with a mark in place of each argument: its name behind a star."""
    names = skill.schema.get("properties", {})
    return contract_of(skill, {name: f"*{name}" for name in names}) or Contract()


def _unified(gift: Fact, goal: Fact) -> dict[str, Any] | None:
    """Return the values of marks with which a promise is the goal; None where there are none."""
    if gift.relation != goal.relation or len(gift.arguments) < len(goal.arguments):
        return None
    bound: dict[str, Any] = {}
    for mark, value in zip(gift.arguments, goal.arguments, strict=False):
        if isinstance(mark, str) and mark.startswith("*"):
            if value == TABLE or bound.setdefault(mark, value) != value:
                return None
        elif mark != value:
            return None
    return bound


def _marks(one: Fact) -> tuple[str, ...]:
    return tuple(str(value) for value in one.arguments if str(value).startswith("*") and value != HELD)


def _takes_the_hand(need: Fact) -> bool:
    return need.relation in _OF_THE_HAND


def _key(state: _State) -> tuple[object, ...]:
    """Return what tells one state from another, wherever on the table things were put aside."""
    openings = tuple(round(item.opening or 0.0, 3) for item in state.scene.objects)
    return (state.scene.held, openings, frozenset(state.moved.items()))
