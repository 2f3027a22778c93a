"""Verification of a plan before anything moves: contracts run over the scene, step by step."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from robosandbox.errors import ErrorCode, Failure, InvalidArgumentError, Phase
from robosandbox.types import ObservedScene, Plan, SkillCall
from robosandbox.values import frozen
from robosandbox.world.abilities import Abilities
from robosandbox.world.contracts import apply_effects, error_for, find, first_refuted, lookup
from robosandbox.world.facts import HELD, Fact, fact
from robosandbox.world.operators import BoundCall, Operator, bind
from robosandbox.world.predicate import View, sentence

# Number of calls that a plan may have; chosen because nobody asks for more in one sentence: a model that plans more has
# run away.
MAX_STEPS = 40
# Characters of the longest call that is shown whole; chosen as a line of a terminal or two.
_SHOWN = 120


@frozen(kw_only=True)
class Constraints:
    """Constraints of a person on a plan beside its goal.

    Attributes:
        never: Ids of what must not be moved or touched.
        only: Ids of what alone may be moved; None allows everything.
        moved: Ids of what has to be moved.
        fewest: How many things are to be moved at least.
        exactly: How many things are to be moved; None is any number.
        order: Pairs of ids: the first is to be moved before the second.
        end: What has to hold in the end.
        put_back: Whether whatever else is moved is to be back in its place in the end.
    """

    never: frozenset[str] = frozenset()
    only: frozenset[str] | None = None
    moved: frozenset[str] = frozenset()
    fewest: int = 0
    exactly: int | None = None
    order: tuple[tuple[str, str], ...] = ()
    end: tuple[Fact, ...] = ()
    put_back: bool = False


@frozen(kw_only=True)
class Problem:
    """Failure that a plan would end in, and where.

    Attributes:
        step: Number of the step, from 1; 0 for the plan as a whole.
        call: That step; None for the plan as a whole.
        relation: What would have to hold.
        error: The failure for want of it.
        is_final: Whether it lies in what objects and robot are, so that nothing done first can mend it.
    """

    step: int
    call: SkillCall | None
    relation: Fact
    error: Failure
    is_final: bool = False

    def record(self) -> dict[str, Any]:
        """Return the problem as JSON data."""
        return {
            "step": self.step,
            "call": None if self.call is None else str(self.call),
            "relation": str(self.relation),
            "error": self.error.model_dump(mode="json"),
        }

    def __str__(self) -> str:
        said = self.error.message
        return f"step {self.step} {_short(self.call)}: {said}" if self.call else said


@frozen(kw_only=True)
class Verification:
    """Result of verifying a plan.

    Attributes:
        problems: What is wrong, in the order of the steps; empty where the plan can be right.
        end: The scene as the plan would leave it, or as it is before the first step with a problem.
        calls: The steps, bound; empty where one of them is wrong in itself.
    """

    problems: tuple[Problem, ...]
    end: ObservedScene
    calls: tuple[BoundCall, ...] = ()


def verify(
    plan: Plan,
    scene: ObservedScene,
    skills: Sequence[Operator],
    *,
    constraints: Constraints | None = None,
    robot: Abilities | None = None,
) -> Verification:
    """Run a plan over a scene by its skills' contracts.

    Wrong calls are told of every step. What a step needs is told up to the first step that lacks something, since all that
    follows would happen in another scene; steps behind one that promises nothing are not followed.

    Args:
        plan: Whose it may be.
        scene: What is seen now.
        skills: What the plan may call.
        constraints: What was asked besides.
        robot: What the robot can do; None denies what the scene tells that it cannot.
    """
    if len(plan.steps) > MAX_STEPS:
        cause = f"the plan has {len(plan.steps)} steps; at most {MAX_STEPS} are carried out"
        return Verification(problems=(_of_the_plan(fact("at_most", float(MAX_STEPS)), cause),), end=scene)
    by_name = {skill.name: skill for skill in skills}
    bound = [_bound(number, call, by_name, scene) for number, call in enumerate(plan.steps, start=1)]
    wrong = tuple(found for found in bound if isinstance(found, Problem))
    if wrong:
        return Verification(problems=wrong, end=scene)
    calls = tuple(found for found in bound if isinstance(found, BoundCall))
    return _Run(scene, constraints or Constraints(), robot or Abilities.of(scene)).follow(calls)


class _Run:
    """The scene and what was moved, step by step."""

    def __init__(self, scene: ObservedScene, constraints: Constraints, robot: Abilities) -> None:
        self._start = self._scene = scene
        self._asked = constraints
        self._robot = robot
        self._moved: dict[str, None] = {}

    def follow(self, calls: tuple[BoundCall, ...]) -> Verification:
        return Verification(problems=tuple(self._problems(calls)), end=self._scene, calls=calls)

    def _problems(self, calls: Sequence[BoundCall]) -> Iterator[Problem]:
        for number, bound in enumerate(calls, start=1):
            call, contract = bound.call, bound.contract.resolved(self._scene)
            view = View.of(self._scene, self._robot)
            lacking = first_refuted(contract.needs, view)
            if lacking is not None:
                final = lookup(lacking[0]).is_fixed
                error = error_for(*lacking, view).failure
                yield Problem(step=number, call=call, relation=lacking[0], error=error, is_final=final)
                return
            forbidden = self._forbidden(number, call, contract.moves)
            if forbidden is not None:
                yield forbidden
                return
            if not contract.gives:
                return
            self._moved.update(dict.fromkeys(contract.moves))
            self._scene = apply_effects(contract, self._scene)
        yield from self._unkept()

    def _forbidden(self, number: int, call: SkillCall, moves: Iterable[str]) -> Problem | None:
        asked = self._asked
        for name in moves:
            if name in asked.never or (asked.only is not None and name not in asked.only):
                error = _unasked(f"{name} is not to be touched")
                return Problem(step=number, call=call, relation=fact("untouched", name), error=error, is_final=True)
            for first, second in asked.order:
                if name == second and first not in self._moved:
                    error = _unasked(f"{first} is to be moved before {second}")
                    return Problem(step=number, call=call, relation=fact("before", first, second), error=error)
        return None

    def _unkept(self) -> Iterable[Problem]:
        asked, view = self._asked, View(scene=self._scene, before=self._start, robot=self._robot)
        if asked.exactly is not None and len(self._moved) != asked.exactly:
            cause = f"the plan moves {len(self._moved)} things; {asked.exactly} were asked for"
            yield _of_the_plan(fact("exactly", float(asked.exactly)), cause)
        if len(self._moved) < asked.fewest:
            cause = f"the plan moves {len(self._moved)} things; at least {asked.fewest} were asked for"
            yield _of_the_plan(fact("at_least", float(asked.fewest)), cause)
        for name in sorted(asked.moved - self._moved.keys()):
            yield _of_the_plan(fact("moved", name), f"{name} was asked for and is not moved")
        spoken_of = {goal.arguments[0] for goal in asked.end if goal.arguments}
        back = [fact("as_before", name) for name in self._moved if asked.put_back and name not in spoken_of]
        for goal in (*asked.end, *back):
            finding = find(goal, view)
            if finding.is_refuted:
                yield _of_the_plan(goal, f"in the end {sentence(finding)}")


def _bound(number: int, call: SkillCall, skills: Mapping[str, Operator], scene: ObservedScene) -> BoundCall | Problem:
    """Return a call bound, or the problem that lies in the call itself."""
    try:
        bound = bind(call, skills)
    except InvalidArgumentError as error:
        wrong = fact("arguments" if call.skill in skills else "skill", call.skill)
        return Problem(step=number, call=call, relation=wrong, error=error.failure)
    view = View.of(scene)
    lacking = first_refuted(_seen(bound.contract.objects), view)
    if lacking is None:
        return bound
    return Problem(step=number, call=call, relation=lacking[0], error=error_for(*lacking, view).failure)


def _of_the_plan(relation: Fact, cause: str) -> Problem:
    return Problem(step=0, call=None, relation=relation, error=_unasked(cause))


def _unasked(cause: str) -> Failure:
    """Return the failure of a plan that is not what was asked for."""
    return Failure(code=ErrorCode.REFUSED, phase=Phase.PLAN, message=cause)


def _seen(names: Iterable[str]) -> list[Fact]:
    return [fact("seen", name) for name in names if name != HELD]


def _short(call: SkillCall | None) -> str:
    text = " ".join(str(call).split())
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."
