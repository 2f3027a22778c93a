"""A planner for goals in relations in place of sentences: the same search again after each failure."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.protocols import Attempt
from robosandbox.errors import InputError
from robosandbox.types import ObservedScene, Plan, Refusal, RefusalCode
from robosandbox.world.abilities import Abilities
from robosandbox.world.contracts import find, lookup
from robosandbox.world.facts import Fact, parse_facts
from robosandbox.world.operators import Operator
from robosandbox.world.predicate import View, predicates


class GoalPlanner:
    """Plans for prompts that list relations, as in "on(red_cube, blue_block), closed(drawer)".

    Args:
        skills: What it may call.
        robot: What the robot can do; None denies what the scene tells that it cannot.
    """

    def __init__(self, skills: Sequence[Operator], robot: Abilities | None = None) -> None:
        self._skills = tuple(skills)
        self._robot = robot

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal:
        """Return the cheapest calls found after which the goals hold.

        Raises:
            InputError: The prompt is no list of relations.
        """
        # Sentences need no search: commands that are given one start without it.
        from robosandbox.world.achievers import Achievers
        from robosandbox.world.solve import solve

        goals = read_goals(prompt)
        for goal in goals:
            known, finding = lookup(goal), find(goal, View.of(scene))
            if finding.holds and not (finding.is_sure or known.lasts or known.is_last):
                calls = ", ".join(str(one.call) for one in Achievers(self._skills).of(goal))
                message = f"Nobody sees whether {goal} holds; ask for what does it{f': {calls}' if calls else ''}."
                return Refusal(code=RefusalCode.UNSUPPORTED, message=message)
        answer = solve(goals, scene, self._skills, robot=self._robot, tried=history)
        if isinstance(answer, Refusal) or answer.steps:
            return answer
        return Plan(steps=(), answer=f"It is so already: {', '.join(map(str, goals))}.")


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
