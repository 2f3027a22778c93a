"""Every word of a question and of an order is accounted for: it is used, told of in a note, or named in a refusal."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from robosandbox import open_session
from robosandbox.agent.planner import StubPlanner
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import ObservedScene, Plan, Pose, Refusal, RefusalCode
from robosandbox.world.contracts import find
from robosandbox.world.facts import fact
from robosandbox.world.predicate import View

UNSEEN = {
    "is the green cube magnetic?": "magnetic",
    "how many greasy cubes are there?": "greasy",
    "which one is the cheapest?": "cheapest",
    "is somebody there?": "somebody",
    "where is the radioactive cube?": "radioactive",
    "are there any poisonous things?": "poisonous",
    "is the blue cube beautiful?": "beautiful",
    "what colour is the brittle cube?": "brittle",
    "is only the blue cube on the table?": "only",
    "is the blue cube almost on the table?": "almost",
    "is the red cube a toy?": "toy",
    "is the red cube a die?": "die",
    "how many bricks are there?": "brick",
    "is there any water on the table?": "water",
}
LEFT_OVER = {
    "tap the magnetic green cube": "magnetic",
    "tap the green cube that is rotten": "rotten",
    "tap the green cube unless it is brittle": "brittle",
    "if there is a rotten cube, tap it": "rotten",
    "tap the green cube again": "again",
    "tap the green cube instead": "instead",
    "almost tap the green cube": "almost",
    "tap the green cube, my sister objects": "sister",
    "tap the green cube, though I doubt it": "doubt",
    "assuming nobody minds, tap the green cube": "assuming",
    "tap the hot green cube": "hot",
    "should it snow, tap the green cube": "should",
}
MANNERS = {
    "tap the green cube slowly": "slowly",
    "very carefully tap the green cube": "very carefully",
    "tap the green cube as softly as you can": "as softly as you can",
    "give the green cube a gentle tap": "gentle",
    "tap the green cube without a sound": "without a sound",
    "tap the ugly green cube": "ugly",
}
HARMLESS = (
    "could you tap the green cube for me, please",
    "hey robot, tap only the green cube, if you like",
    "tap the green cube because my sister wants to see it",
)


@cache
def scene(task: str) -> ObservedScene:
    with open_session(task) as session:
        return session.agent.ctx.look()


def said(prompt: str, seen: ObservedScene | None = None) -> Plan | Refusal:
    return StubPlanner(load_skills()).plan(prompt, seen or scene("pick_from_three"))


@pytest.mark.parametrize("question", UNSEEN)
def test_question_with_a_word_that_names_nothing_seen_is_refused_with_it(question: str) -> None:
    answer = said(question)
    assert isinstance(answer, Refusal) and f"“{UNSEEN[question]}”" in answer.message, answer


@pytest.mark.parametrize("order", LEFT_OVER)
def test_order_with_a_word_left_over_is_refused_with_it(order: str) -> None:
    answer = said(order)
    assert isinstance(answer, Refusal) and f"“{LEFT_OVER[order]}”" in answer.message, answer


@pytest.mark.parametrize("order", MANNERS)
def test_manner_is_planned_with_a_note(order: str) -> None:
    plan = said(order)
    assert isinstance(plan, Plan) and [str(call) for call in plan.steps] == ["tap(object=green_cube)"], plan
    assert f"“{MANNERS[order]}”" in plan.note and plan.note in str(plan)


@pytest.mark.parametrize("order", HARMLESS)
def test_politeness_leaves_no_note(order: str) -> None:
    plan = said(order)
    assert isinstance(plan, Plan) and len(plan.steps) == 1 and not plan.note, plan


def test_again_means_what_was_done_before() -> None:
    planner = StubPlanner(load_skills(), dialogue=True)
    for prompt in ("tap the green cube", "tap it again"):
        plan = planner.plan(prompt, scene("pick_from_three"))
        assert isinstance(plan, Plan) and [str(call) for call in plan.steps] == ["tap(object=green_cube)"], plan


def test_question_never_moves_anything() -> None:
    for question in (
        "do the cubes touch?",
        "is the green cube easy to lift?",
        "is something behind the red cube moving?",
    ):
        answer = said(question)
        assert isinstance(answer, Refusal) and answer.code is RefusalCode.UNSUPPORTED, answer


def test_reach_is_answered_as_a_pick_finds_it() -> None:
    with open_session("pick_from_three") as session:
        ctx = session.agent.ctx
        seen, robot, told = ctx.look(), ctx.abilities(), set()
        cube = seen.objects[0]
        for tenth in range(1, 20):
            there = replace(cube, pose=Pose(xyz=(seen.base_xy[0] + 0.1 * tenth, seen.base_xy[1], cube.pose.xyz[2])))
            moved = replace(seen, objects=(there, *seen.objects[1:]))
            asked = said(f"can you reach {cube.id}?", moved)
            needed = find(fact("reachable", cube.id), View.of(moved, robot)).holds
            if isinstance(asked, Plan):
                told.add(needed)
                assert asked.answer.startswith("Yes" if needed else "No"), (tenth, asked)
        assert told == {True, False}


def test_reach_that_only_kinematics_tell_is_not_guessed() -> None:
    seen = scene("pick_from_three")
    cube = seen.objects[0]
    edge = replace(cube, pose=Pose(xyz=(seen.base_xy[0] + 1.1 * seen.reach[1], seen.base_xy[1], cube.pose.xyz[2])))
    answer = said(f"is {cube.id} in reach?", replace(seen, objects=(edge, *seen.objects[1:])))
    assert isinstance(answer, Refusal) and "edge of my reach" in answer.message, answer
