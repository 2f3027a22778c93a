"""Plans for goals: the cheapest calls, by skills' contracts, after which the goals hold in the scene as they would leave it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from robosandbox.types import ObservedScene, Plan, Refusal, RefusalCode, SkillCall
from robosandbox.world.abilities import Abilities, LateAbilities
from robosandbox.world.achievers import Achievers, subject_of
from robosandbox.world.contracts import find, lookup
from robosandbox.world.facts import TABLE, Fact, fact
from robosandbox.world.locations import location_of, point_of
from robosandbox.world.operators import Operator
from robosandbox.world.predicate import View
from robosandbox.world.search import NoWayError, Search
from robosandbox.world.verifier import Constraints, verify

# Plans that are proved by the robot's kinematics and grasps, one after the other: each shows what it cannot do. Chosen.
_MOST_PROOFS = 12
# How often things that were moved on the way are added to what is to be put back: putting back may move others. Chosen.
_MOST_PUT_BACK = 4


def plan_for(
    goals: Sequence[Fact],
    scene: ObservedScene,
    skills: Sequence[Operator],
    *,
    asked: Constraints | None = None,
    robot: LateAbilities | None = None,
    avoided: Sequence[SkillCall] = (),
) -> Plan | Refusal:
    """Return a plan after which goals hold and which the robot's kinematics and grasps do not deny, or why there is none.

    Drawers that it opens on the way are closed again.

    Args:
        goals: What is to hold in the end.
        scene: What is seen now.
        skills: What may be called.
        asked: What was asked besides.
        robot: What the robot can do; what it denies of a whole plan is searched around.
        avoided: Calls that are not planned.
    """
    asked, able = asked or Constraints(), robot or LateAbilities(Abilities.of(scene))
    achievers = Achievers(skills)
    postures = [goal for goal in goals if _is_posture(goal)]
    goals = [goal for goal in goals if goal not in postures]
    problem = ""
    for _ in range(_MOST_PROOFS):
        try:
            plan = _planned(tuple(goals), Search(scene, achievers, asked, able, avoided=avoided), scene, asked)
            plan = Plan(steps=(*plan.steps, *_moves(postures, plan, scene, skills, able)))
        except NoWayError as failure:
            problem = str(failure)
            break
        known = able.denied
        with able.asking():
            wrong = verify(
                plan, scene, skills, constraints=replace(asked, end=(*asked.end, *goals)), robot=able
            ).problems
        if not wrong:
            return plan
        problem = str(wrong[0])
        if able.denied == known:
            break
    return Refusal(
        code=RefusalCode.IMPOSSIBLE, message=f"There is no plan: {problem}{'' if problem.endswith('?') else '.'}"
    )


def _planned(goals: tuple[Fact, ...], search: Search, scene: ObservedScene, asked: Constraints) -> Plan:
    """Return a plan for goals and for what is asked of the rest: drawers as they were, and things where they were.

    Raises:
        NoWayError: There is none.
    """
    shut = tuple(one for one in _shut(scene) if not _speaks_of(goals, one))
    back: tuple[Fact, ...] = ()
    for _ in range(_MOST_PUT_BACK):
        try:
            found = search.reach((*goals, *back, *shut))
        except NoWayError:
            # A thing too tall for its drawer keeps the drawer open.
            found = search.reach((*goals, *back))
        moved = {*found.moved} - {subject_of(goal) for goal in (*goals, *back, *shut)}
        if not asked.put_back or not moved:
            return Plan(steps=found.calls)
        gone = {subject_of(goal) for goal in goals}
        back = (*back, *(_place_of(name, scene, gone) for name in sorted(moved)))
    raise NoWayError(f"{', '.join(map(subject_of, back))} cannot all be put back, since that moves other things", 0)


def _is_posture(goal: Fact) -> bool:
    """Say whether a fact is about the arm alone, which no scene shows and no call but its own changes for long."""
    relation = lookup(goal)
    return not relation.parameters and relation.is_last and relation.effect is None


def _moves(
    postures: Sequence[Fact], plan: Plan, scene: ObservedScene, skills: Sequence[Operator], robot: Abilities
) -> Iterator[SkillCall]:
    """Yield calls that bring about postures after a plan; none where nothing has moved and they surely hold.

    Raises:
        NoWayError: No skill without arguments promises one.
    """
    for goal in postures:
        now = find(goal, View.of(scene, robot))
        if not plan.steps and now.is_sure and now.holds:
            continue
        able = (skill for skill in skills if not skill.schema.get("properties"))
        name = next((skill.name for skill in able if goal in skill.contract().gives), None)
        if name is None:
            raise NoWayError(f"no skill brings about {goal}", 0)
        yield SkillCall(skill=name)


def _place_of(name: str, scene: ObservedScene, gone: set[str]) -> Fact:
    """Return that a thing is on or in what it is now, or at that point of the table where that is to go elsewhere."""
    item = scene.find(name)
    was = None if item is None else location_of(scene, item)
    if item is None or was is None:
        return fact("as_before", name)
    return point_of(item) if was.arguments[-1] in (TABLE, *gone) else was


def _shut(scene: ObservedScene) -> list[Fact]:
    """Return that the drawers which are shut now are shut."""
    view = View.of(scene)
    facts = [fact("closed", item.id) for item in scene.objects if item.shape.opens]
    return [one for one in facts if find(one, view).holds]


def _speaks_of(goals: Sequence[Fact], one: Fact) -> bool:
    return any(goal.relation in ("open", "closed") and goal.arguments == one.arguments for goal in goals)
