"""A planner for goals in relations in place of sentences: the same search again after each failure."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.protocols import Attempt
from robosandbox.errors import InputError
from robosandbox.types import ObservedScene, Plan, Refusal, SkillCall
from robosandbox.world.abilities import Abilities
from robosandbox.world.contracts import apply_effects, lookup
from robosandbox.world.facts import Fact, parse_facts
from robosandbox.world.operators import Operator, bind
from robosandbox.world.predicate import predicates


class GoalPlanner:
    """Plans for prompts that list relations, as in "on(red_cube, blue_block), closed(drawer)".

    Args:
        skills: What it may call.
        robot: What the robot can do; None denies nothing but what is far out of reach.
    """

    def __init__(self, skills: Sequence[Operator], robot: Abilities | None = None) -> None:
        self._skills = {skill.name: skill for skill in skills}
        self._robot = robot

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal:
        """Return the cheapest calls found after which the goals hold.

        After a failure its first repair, which was tried on the twin, comes before what is planned for the scene that it would
        leave; calls that failed are planned anew only where nothing else would do, not even an untried way around them.

        Raises:
            InputError: The prompt is no list of relations.
        """
        goals = read_goals(prompt)
        if history and history[-1].error.repairs:
            return self._after(history[-1].error.repairs[0].calls, goals, scene, history)
        answer = self._after((), goals, scene, history)
        failed = [attempt.failed for attempt in history]
        if history and (isinstance(answer, Refusal) or any(call in failed for call in answer.steps)):
            # It searches, too.
            from robosandbox.agent.detours import Detours

            detours = Detours(history, scene, self._skills)
            found = detours.around_clearing()
            if way := found[0] if found else detours.around_failure():
                return self._after(way, goals, scene, history)
        return answer

    def _after(
        self, calls: tuple[SkillCall, ...], goals: Sequence[Fact], scene: ObservedScene, history: Sequence[Attempt]
    ) -> Plan | Refusal:
        """Return calls, and behind them what reaches the goals from the scene that they would leave."""
        # Sentences need no search: commands that are given one start without it.
        from robosandbox.world.achieve import achieve

        for call in calls:
            scene = apply_effects(bind(call, self._skills).contract, scene)
        failed = tuple(attempt.failed for attempt in history)
        answer = achieve(goals, scene, list(self._skills.values()), robot=self._robot, failed=failed)
        if isinstance(answer, Refusal):
            return answer
        so = "" if calls or answer.steps else f"It is so already: {', '.join(map(str, goals))}."
        return Plan(steps=(*calls, *answer.steps), answer=so)


def is_goal(prompt: str) -> bool:
    """Say whether a prompt lists known relations, as in "on(red_cube, blue_block)", and is no sentence."""
    try:
        goals = parse_facts(prompt)
    except ValueError:
        return False
    # "open" alone is a word of a sentence; what takes no argument has a name that no sentence has.
    return all(goal.relation in predicates() and ("(" in prompt or "_" in goal.relation) for goal in goals)


def read_goals(text: str) -> tuple[Fact, ...]:
    """Return the goals that a text lists.

    Raises:
        InputError: It is no list of relations, or one of them is not known or takes other arguments.
    """
    try:
        goals = parse_facts(text)
    except ValueError as error:
        raise InputError(f"--goal: {error}") from None
    for goal in goals:
        lookup(goal)
    return goals
