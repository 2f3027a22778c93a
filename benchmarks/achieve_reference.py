"""A model of the problems in STRIPS, solved by Fast Downward through unified-planning: a reference with no geometry in it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import chdir
from tempfile import TemporaryDirectory

from achieve_problems import SPOTS, Problem, left_shut
from unified_planning.engines import PlanGenerationResultStatus
from unified_planning.model import FNode
from unified_planning.shortcuts import (
    And,
    BoolType,
    Fluent,
    InstantaneousAction,
    Int,
    MinimizeActionCosts,
    Not,
    Object,
    OneshotPlanner,
    Problem as Model,
    UserType,
    get_environment,
)

from robosandbox.world.facts import TABLE

# Optimal search first; where that takes too long, greedier search whose plans may be longer than the shortest.
OPTIMAL = "astar(lmcut())"
GREEDY = "lazy_wastar([ff()],preferred=[ff()],w=2)"
THING, HOLDER, TRAY, SPOT = (UserType(name) for name in ("thing", "holder", "tray", "spot"))


def shortest(problem: Problem, seconds: float) -> tuple[int | None, bool]:
    """Return the number of calls of the reference's plan, None where it finds none, and whether that is proved the least.

    Args:
        problem: Which one.
        seconds: Of CPU time after which the proof is given up, and after which again the search is.
    """
    get_environment().credits_stream = None
    model = _model(problem)
    for config in (OPTIMAL, GREEDY):
        options = {"fast_downward_search_config": config, "fast_downward_search_time_limit": f"{seconds:g}s"}
        # It leaves its translation in the current folder.
        planner = OneshotPlanner(name="fast-downward", params=options)
        with TemporaryDirectory() as folder, chdir(folder), planner:
            answer = planner.solve(model)
        if answer.plan is not None:
            calls = sum(step.action.name != "place_on_thing" for step in answer.plan.actions)
            return calls, config == OPTIMAL
        if answer.status is PlanGenerationResultStatus.UNSOLVABLE_PROVEN:
            return None, True
        if answer.status is not PlanGenerationResultStatus.TIMEOUT:
            raise RuntimeError(f"the reference ended with {answer.status.name}; is its group installed?")
    return None, False


def _model(problem: Problem) -> Model:
    """Return a problem with an action for each call."""
    model = Model(problem.family)
    fluents = {
        name: Fluent(name, BoolType(), **kinds)
        for name, kinds in {
            "on": {"a": THING, "b": THING},
            "inside": {"a": THING, "c": HOLDER},
            "at": {"a": THING, "s": SPOT},
            "loose": {"a": THING},
            "clear": {"a": THING},
            "tabled": {"a": THING},
            "outside": {"a": THING},
            "holding": {"a": THING},
            "hand_empty": {},
            "free": {"s": SPOT},
            "open": {"c": HOLDER},
            "is_drawer": {"c": HOLDER},
            "lies": {"a": THING, "t": TRAY},
            "empty": {"t": TRAY},
        }.items()
    }
    for fluent in fluents.values():
        model.add_fluent(fluent, default_initial_value=False)
    _Actions(model, fluents).add()
    objects = {name: Object(name, THING) for name in problem.things}
    objects |= {name: Object(name, TRAY if kind == "tray" else HOLDER) for name, kind in problem.holders.items()}
    spots = [Object(f"spot_{k}", SPOT) for k in range(len(SPOTS))]
    model.add_objects([*objects.values(), *spots])
    holding = _Said(problem, fluents, objects, spots)
    for said in holding.begin():
        model.set_initial_value(said, True)
    for goal in holding.end():
        model.add_goal(goal)
    return model


class _Said:
    """What holds at first, and what is to hold."""

    def __init__(
        self, problem: Problem, fluents: dict[str, Fluent], objects: dict[str, Object], spots: list[Object]
    ) -> None:
        self._problem = problem
        self._is = fluents
        self._objects = objects
        self._spots = spots

    def begin(self) -> Iterator[FNode]:
        holds, problem = self._is, self._problem
        yield holds["hand_empty"]()
        taken = {place.spot for place in problem.start.values()} | {*problem.spots_of.values()}
        yield from (holds["free"](spot) for k, spot in enumerate(self._spots) if k not in taken)
        below = {place.name for place in problem.start.values() if place.kind == "on"}
        lain = {place.name for place in problem.start.values() if place.kind == "in"}
        for name, kind in problem.holders.items():
            if kind == "bin":
                yield holds["open"](self._objects[name])
            elif kind == "drawer":
                yield holds["is_drawer"](self._objects[name])
            elif name not in lain:
                yield holds["empty"](self._objects[name])
        for name, place in problem.start.items():
            thing = self._objects[name]
            if name not in below:
                yield holds["clear"](thing)
            if place.kind == "at":
                yield from (holds["at"](thing, self._spots[place.spot]), holds["tabled"](thing))
            else:
                yield self._in_or_on(name, place.name)
            if place.kind != "in":
                yield holds["outside"](thing)

    def _in_or_on(self, name: str, target: str) -> FNode:
        kind = self._problem.holders.get(target, "")
        relation = {"": "on", "tray": "lies"}.get(kind, "inside")
        return self._is[relation](self._objects[name], self._objects[target])

    def end(self) -> Iterator[FNode]:
        for goal in self._problem.goals:
            name = str(goal.arguments[0])
            if goal.relation == "open":
                yield self._is["open"](self._objects[name])
            elif goal.relation == "at":
                spot = self._spots[SPOTS.index((float(goal.arguments[1]), float(goal.arguments[2])))]
                yield self._is["at"](self._objects[name], spot)
            elif goal.arguments[1] == TABLE:
                yield self._is["tabled"](self._objects[name])
            else:
                yield self._in_or_on(name, str(goal.arguments[1]))
        for name in left_shut(self._problem):
            yield Not(self._is["open"](self._objects[name]))


class _Actions:
    """Takes things from where they are, and puts them elsewhere.

    Each is a call, but for standing a thing on another: that and the pick before it are one call, `stack`.
    """

    def __init__(self, model: Model, fluents: dict[str, Fluent]) -> None:
        self._model = model
        self._is = fluents
        self._sources = {"table": None, "spot": SPOT, "thing": THING, "holder": HOLDER, "tray": TRAY}

    def add(self) -> None:
        for source, kind in self._sources.items():
            given = {"a": THING} | ({"f": kind} if kind else {})
            pick = InstantaneousAction(f"pick_from_{source}", **given)
            self._take(pick, source)
            pick.add_effect(self._is["holding"](pick.a), True)
            pick.add_effect(self._is["clear"](pick.a), False)
            pick.add_effect(self._is["hand_empty"], False)
            place = InstantaneousAction(f"place_on_{source}", **({"a": THING} | ({"t": kind} if kind else {})))
            place.add_precondition(self._is["holding"](place.a))
            place.add_effect(self._is["holding"](place.a), False)
            place.add_effect(self._is["clear"](place.a), True)
            place.add_effect(self._is["hand_empty"], True)
            self._put(place, source)
            self._model.add_actions([pick, place])
        for name, state in (("open_drawer", True), ("close_drawer", False)):
            action = InstantaneousAction(name, c=HOLDER)
            action.add_precondition(And(self._is["is_drawer"](action.c), self._is["hand_empty"]))
            action.add_effect(self._is["open"](action.c), state)
            self._model.add_action(action)
        free = {action: Int(0 if action.name == "place_on_thing" else 1) for action in self._model.actions}
        self._model.add_quality_metric(MinimizeActionCosts(free))

    def _take(self, action: InstantaneousAction, source: str) -> None:
        holds, a = self._is, action.a
        action.add_precondition(holds["hand_empty"])
        action.add_precondition(holds["clear"](a))
        if source == "table":
            action.add_precondition(holds["loose"](a))
            action.add_effect(holds["loose"](a), False)
            action.add_effect(holds["tabled"](a), False)
        elif source == "spot":
            action.add_precondition(holds["at"](a, action.f))
            action.add_effect(holds["at"](a, action.f), False)
            action.add_effect(holds["free"](action.f), True)
            action.add_effect(holds["tabled"](a), False)
        elif source == "thing":
            action.add_precondition(holds["on"](a, action.f))
            action.add_effect(holds["on"](a, action.f), False)
            action.add_effect(holds["clear"](action.f), True)
        elif source == "holder":
            action.add_precondition(And(holds["inside"](a, action.f), holds["open"](action.f)))
            action.add_effect(holds["inside"](a, action.f), False)
            action.add_effect(holds["outside"](a), True)
        else:
            action.add_precondition(holds["lies"](a, action.f))
            action.add_effect(holds["lies"](a, action.f), False)
            action.add_effect(holds["empty"](action.f), True)
            action.add_effect(holds["outside"](a), True)

    def _put(self, action: InstantaneousAction, target: str) -> None:
        holds, a = self._is, action.a
        if target == "table":
            action.add_effect(holds["loose"](a), True)
            action.add_effect(holds["tabled"](a), True)
        elif target == "spot":
            action.add_precondition(holds["free"](action.t))
            action.add_effect(holds["free"](action.t), False)
            action.add_effect(holds["at"](a, action.t), True)
            action.add_effect(holds["tabled"](a), True)
        elif target == "thing":
            action.add_precondition(And(holds["clear"](action.t), holds["outside"](action.t)))
            action.add_effect(holds["clear"](action.t), False)
            action.add_effect(holds["on"](a, action.t), True)
        elif target == "holder":
            action.add_precondition(holds["open"](action.t))
            action.add_effect(holds["inside"](a, action.t), True)
            action.add_effect(holds["outside"](a), False)
        else:
            action.add_precondition(holds["empty"](action.t))
            action.add_effect(holds["empty"](action.t), False)
            action.add_effect(holds["lies"](a, action.t), True)
            action.add_effect(holds["outside"](a), False)
