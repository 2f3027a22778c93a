"""Plans for goals, and for what is left after failures: the one place that answers what to do now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from robosandbox.errors import ErrorCode, Failure, Repair
from robosandbox.evidence import PlacementEvidence
from robosandbox.types import ObservedScene, Plan, Refusal, RefusalCode, SkillCall
from robosandbox.world.abilities import Abilities, LateAbilities
from robosandbox.world.alternatives import BEFORE_MOVING, NOT_OF_THE_WORLD, Attempt, FailedCall
from robosandbox.world.contracts import Contract, apply_effects, error_for, find, first_refuted, lookup
from robosandbox.world.facts import HELD, Fact
from robosandbox.world.goal_plan import plan_for
from robosandbox.world.means_ends import MeansEndsPlan
from robosandbox.world.operators import Operator, bind
from robosandbox.world.predicate import View
from robosandbox.world.search import NoWayError
from robosandbox.world.verifier import Constraints
from robosandbox.world.workarounds import Calls, likeliest

# Times that the same call is made again after the same failure.
RETRIES = 2
# Failures of geometry before anything moves: the same calls would meet the same again.
_GEOMETRIC = frozenset({ErrorCode.UNREACHABLE, ErrorCode.LIMIT, ErrorCode.COLLISION})
# Failures for which nothing is done that has not worked on the twin before: it knows the geometry as well as the world does.
_EXACT = frozenset({ErrorCode.UNREACHABLE, ErrorCode.LIMIT})


def solve(
    goals: Sequence[Fact] | Sequence[SkillCall],
    scene: ObservedScene,
    skills: Sequence[Operator],
    *,
    constraints: Constraints | None = None,
    robot: Abilities | None = None,
    tried: Sequence[Attempt] = (),
) -> Plan | Refusal:
    """Return a plan for goals, or why there is none.

    After a failure its untried repair comes first, since that has worked on the twin. Calls that failed are planned anew only
    where nothing else would do, not even an untried way around them.

    Args:
        goals: Relations that are to hold in the end, or calls that are to be made one after the other, what each lacks before it;
            after an attempt these are the call that failed and those behind it.
        scene: What is seen now.
        skills: What may be called.
        constraints: What was asked besides, of relations.
        robot: What the robot can do; None denies what the scene tells that it cannot. Its kinematics and grasps are asked about
            whole plans, and what they deny is searched around.
        tried: Plans that ended early, oldest first.

    Raises:
        InputError: A goal names no relation, or gives it other arguments than it takes.
    """
    facts = tuple(goal for goal in goals if isinstance(goal, Fact))
    calls = tuple(goal for goal in goals if isinstance(goal, SkillCall))
    for goal in facts:
        lookup(goal)
    able = LateAbilities(robot or Abilities.of(scene))
    solver = _Solver(scene, tuple(skills), constraints or Constraints(), able, tuple(tried))
    return solver.for_calls(calls) if calls else solver.for_facts(facts)


def untried_repair(tried: Sequence[Attempt], skills: Mapping[str, Operator]) -> Repair | None:
    """Return the repair of the last failure whose turn it is; each is begun once, the only one twice."""
    last = tried[-1]
    repairs = last.error.repairs
    begun = sum(one.failed == last.failed and bool(one.error.repairs) for one in tried) - 1
    if not repairs or begun >= max(RETRIES, len(repairs)):
        return None
    repair = repairs[min(begun, len(repairs) - 1)]
    return repair if all(call.skill in skills for call in repair.calls) else None


class _Solver:
    def __init__(
        self,
        scene: ObservedScene,
        skills: tuple[Operator, ...],
        asked: Constraints,
        robot: LateAbilities,
        tried: tuple[Attempt, ...],
    ) -> None:
        self._scene = scene
        self._skills = {skill.name: skill for skill in skills}
        self._asked = asked
        self._robot = robot
        self._tried = tried

    def for_facts(self, goals: tuple[Fact, ...]) -> Plan | Refusal:
        if not self._tried:
            return self._reached((), goals)
        repair = untried_repair(self._tried, self._skills)
        if repair is not None:
            return self._reached(repair.calls, goals)
        answer = self._reached((), goals)
        failed = [attempt.failed for attempt in self._tried]
        if isinstance(answer, Refusal) or any(call in failed for call in answer.steps):
            found = self._untried()
            if found is not None:
                return self._reached(found[0], goals)
        if isinstance(answer, Plan) and self._meets_the_same(answer.steps):
            return self._given_up()
        return answer

    def for_calls(self, calls: tuple[SkillCall, ...]) -> Plan | Refusal:
        if not self._tried:
            making = MeansEndsPlan(self._scene, self._skills)
            try:
                for call in calls:
                    making.call(call)
            except NoWayError as error:
                return Refusal(code=RefusalCode.IMPOSSIBLE, message=f"There is no plan: {error}.")
            return Plan(steps=tuple(making.calls))
        repair = untried_repair(self._tried, self._skills)
        if repair is not None:
            return Plan(steps=(*repair.calls, *calls[1:]))
        found = self._untried()
        if found is None:
            return self._given_up()
        return Plan(steps=(*found[0], *calls[found[1] :]))

    def _given_up(self) -> Refusal:
        last = self._tried[-1]
        return Refusal(code=RefusalCode.IMPOSSIBLE, message=f"{last.failed} failed: {last.error.message}")

    def _reached(self, first: Calls, goals: tuple[Fact, ...]) -> Plan | Refusal:
        """Return calls, and behind them what reaches goals from the scene that they would leave."""
        scene = self._scene
        for call in first:
            scene = apply_effects(bind(call, self._skills).contract, scene)
        skills, failed = tuple(self._skills.values()), [attempt.failed for attempt in self._tried]
        answer: Plan | Refusal | None = None
        if failed:
            answer = plan_for(goals, scene, skills, asked=self._asked, robot=self._robot, avoided=failed)
        if not isinstance(answer, Plan):
            answer = plan_for(goals, scene, skills, asked=self._asked, robot=self._robot)
        return Plan(steps=(*first, *answer.steps)) if isinstance(answer, Plan) else answer

    def _untried(self) -> tuple[Calls, int] | None:
        """Return calls that are left to try, and for how many of the calls from the failed one on they stand.

        Where the failed call was to clear the way for a later one, another way for that would do as well.
        """
        last = self._tried[-1]
        if last.error.code in NOT_OF_THE_WORLD:
            return None
        for number, call in enumerate((last.failed, *last.remaining)):
            error = self._met_by(call) if number else last.error
            calls = None if error is None else self._way(call, error)
            if calls is not None:
                return calls, number + 1
        return None

    def _meets_the_same(self, calls: Sequence[SkillCall]) -> bool:
        """Tell whether calls begin with what has just failed by geometry before anything moved."""
        last = self._tried[-1]
        begun = last.error.phase not in BEFORE_MOVING
        return bool(calls) and calls[0] == last.failed and not begun and last.error.code in _GEOMETRIC

    def _met_by(self, call: SkillCall) -> Failure | None:
        """Return the failure that a later call had before, or would have now since something stands in its way."""
        before = next((one.error for one in reversed(self._tried[:-1]) if one.failed == call), None)
        contract = self._contract(call)
        if before is not None or contract is None:
            return before
        view = View.of(self._scene)
        lacking = first_refuted(contract.resolved(self._scene).needs, view)
        return error_for(*lacking, view).failure if lacking is not None and lacking[1].blocking else None

    def _way(self, call: SkillCall, error: Failure) -> Calls | None:
        """Return the likeliest way left to what a call promised; no calls where that holds by now."""
        last, contract = self._tried[-1], self._contract(call)
        again = sum(one.failed == last.failed and one.error.code == last.error.code for one in self._tried) - 1
        if contract is None or again > RETRIES:
            return None
        before = self._scene.holding(self._held_before()) if HELD in contract.objects else self._scene
        resolved = contract.resolved(before)
        failed = FailedCall(call=call, error=error, contract=resolved, before=before, scene=self._scene)
        if failed.is_hopeless:
            return None
        if call == last.failed and self._holds(resolved):
            return ()
        if error.code in _EXACT:
            return None
        may_retry = again < RETRIES and (failed.had_begun or error.code not in _GEOMETRIC)
        begun = [made for one in self._tried for made in (*one.completed, one.failed)]
        for calls, _ in likeliest(failed, self._skills):
            if calls[0] not in begun or (may_retry and all(one in begun for one in calls)):
                return calls
        return None

    def _holds(self, contract: Contract) -> bool:
        """Tell whether all that a call promises is seen to hold, and will be when somebody looks again."""
        view = View.of(self._scene)
        findings = [find(gift, view) for gift in contract.gives]
        lasting = all(lookup(gift).lasts or lookup(gift).effect is None for gift in contract.gives)
        return bool(findings) and lasting and all(one.holds and one.is_sure for one in findings)

    def _held_before(self) -> str | None:
        """Return what the gripper held when the last failed call began, as far as the attempts tell."""
        if self._scene.held is not None:
            return self._scene.held
        evidence = self._tried[-1].error.evidence
        if isinstance(evidence, PlacementEvidence):
            return evidence.object
        held: str | None = None
        for call in (call for attempt in self._tried for call in attempt.completed):
            contract = self._contract(call)
            taken = [gift for gift in contract.gives if gift.relation == "holding"] if contract else []
            held = str(taken[-1].arguments[0]) if taken else held
        return held

    def _contract(self, call: SkillCall) -> Contract | None:
        return bind(call, self._skills).contract if call.skill in self._skills else None
