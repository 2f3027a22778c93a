"""LIBERO's sentences, read without LIBERO: how many bring about the goal of their task, and none that bring about another."""

from __future__ import annotations

from collections import Counter

import pytest
from support.scored import libero_sentences

from robosandbox.agent.language.viewer import turned_attempts, turned_calls, turned_scene
from robosandbox.agent.planner import StubPlanner
from robosandbox.agent.protocols import Attempt
from robosandbox.errors import InputError
from robosandbox.skill_errors import Failure, Repair
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import Plan, Refusal, SkillCall

# What does something else than its goal: the sentence has "to the right compartment of the caddy" of a place beside the caddy (84, 85), and
# PRO's "left moka pot" is the one that LIBERO calls the right one.
OF_ANOTHER_MIND = {("libero_90", 84), ("libero_90", 85), ("libero_10_task", 8)}


@pytest.fixture(scope="module")
def verdicts() -> list[libero_sentences.Verdict]:
    return libero_sentences.run()


def test_all_290_sentences_are_there() -> None:
    suites = Counter(case.suite.count("_") > 1 for case in libero_sentences.cases())
    assert suites == {False: 130, True: 160}


def test_no_plan_brings_about_another_goal(verdicts: list[libero_sentences.Verdict]) -> None:
    wrong = {(one.case.suite, one.case.task) for one in verdicts if one.verdict == "wrong"}
    assert wrong == OF_ANOTHER_MIND


@pytest.mark.parametrize(("is_pro", "share"), [(False, 0.85), (True, 0.85)])
def test_most_sentences_are_right(verdicts: list[libero_sentences.Verdict], is_pro: bool, share: float) -> None:
    own = [one.verdict for one in verdicts if (one.case.suite.count("_") > 1) == is_pro]
    assert own.count("right") >= share * len(own)


def _asked(sentence: str, *, suite: str, task: int, frame: str = "viewer") -> Plan | Refusal:
    case = next(one for one in libero_sentences.cases() if (one.suite, one.task) == (suite, task))
    return StubPlanner(load_skills(), frame=frame).plan(sentence, case.scene)  # type: ignore[arg-type]


def _calls(answer: Plan | Refusal) -> str:
    assert isinstance(answer, Plan), answer.message
    return "; ".join(map(str, answer.steps))


def test_left_and_right_are_those_of_the_frame() -> None:
    sentence = "put the white bowl to the right of the plate"
    assert "side=left" in _calls(_asked(sentence, suite="libero_90", task=37))
    assert "side=right" in _calls(_asked(sentence, suite="libero_90", task=37, frame="robot"))


def test_front_is_the_viewers_and_nearest_the_robots() -> None:
    front, nearest = "pick up the black bowl at the front", "pick up the nearest black bowl"
    assert _calls(_asked(front, suite="libero_90", task=12)) != _calls(
        _asked(front, suite="libero_90", task=12, frame="robot")
    )
    assert _calls(_asked(nearest, suite="libero_90", task=12)) == _calls(
        _asked(nearest, suite="libero_90", task=12, frame="robot")
    )


def test_half_a_turn_twice_is_none() -> None:
    case = libero_sentences.cases()[0]
    again = turned_scene(turned_scene(case.scene))
    for item, before in zip(again.objects, case.scene.objects, strict=True):
        assert item.pose.position == pytest.approx(before.pose.position)
        assert abs(item.pose.rotation - before.pose.rotation).max() < 1e-9
    plan = StubPlanner(load_skills()).plan("put plate_1 at x 0.1 y 0.2", case.scene)
    assert isinstance(plan, Plan)
    assert turned_calls(turned_calls(plan.steps, case.scene), case.scene) == plan.steps


def test_a_plan_after_a_failure_is_in_the_same_frame() -> None:
    case = next(one for one in libero_sentences.cases() if (one.suite, one.task) == ("libero_90", 37))
    planner = StubPlanner(load_skills(), frame="viewer")
    plan = planner.plan(case.sentence, case.scene)
    assert isinstance(plan, Plan)
    again = SkillCall(skill="place_beside", arguments={"target": "plate_1", "side": "left"})
    error = Failure(code="grasp", message="slipped", phase="lift", repairs=(Repair(calls=(again,), why="", cost=0.0),))
    attempt = Attempt(completed=(), failed=plan.steps[0], error=error, remaining=plan.steps[1:])
    (turned,) = turned_attempts((attempt,), case.scene)
    assert turned.error.repairs[0].calls[0].arguments["side"] == "right"
    assert "side=left" in _calls(planner.plan(case.sentence, case.scene, (attempt,)))


def test_another_frame_is_refused() -> None:
    with pytest.raises(InputError, match="neither robot nor viewer"):
        StubPlanner(load_skills(), frame="camera")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("sentence", "calls"),
    [
        ("open the middle drawer of the cabinet", "open(part=wooden_cabinet_1.cabinet_middle)"),
        ("open the cabinet's middle drawer", "open(part=wooden_cabinet_1.cabinet_middle)"),
        ("turn on the stove", "turn_on(part=flat_stove_1.button)"),
        ("put the bowl on top of the drawer", "pick(object=akita_black_bowl_1); place_on(target=wooden_cabinet_1)"),
        ("put the akita black bowl on the stove", "pick(object=akita_black_bowl_1); place_on(target=flat_stove_1)"),
    ],
)
def test_wholes_and_parts_are_told_apart(sentence: str, calls: str) -> None:
    assert _calls(_asked(sentence, suite="libero_goal", task=0)) == calls


def test_what_is_fixed_is_not_picked_up() -> None:
    answer = _asked("pick up the stove", suite="libero_goal", task=0)
    assert isinstance(answer, Refusal) and "fixture" in answer.message
