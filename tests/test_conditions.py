"""Conditions, counts and loops: what each form means, what it must not mean, and what is left until the robot has looked."""

from __future__ import annotations

from dataclasses import replace

import pytest

from robosandbox.agent.planner import StubPlanner
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import DetectedObject, ObservedScene, Plan, Pose, Refusal
from robosandbox.workcell.session import open_session
from robosandbox.world.locations import location_of


def thing(
    name: str, kind: str, colour: str, x: float, y: float, *, z: float = 0.06, scale: float = 1.0
) -> DetectedObject:
    sizes = {"box": (0.02, 0.02, 0.02), "cylinder": (0.02, 0.04), "bin": (0.08, 0.08, 0.06), "sphere": (0.02,)}
    size = tuple(scale * value for value in sizes[kind])
    return DetectedObject(
        id=name, kind=kind, size=size, colour=colour, rgba=(0.5, 0.5, 0.5, 1.0), pose=Pose(xyz=(x, y, z))
    )


TABLE = ObservedScene(
    time=0.0,
    table_height=0.04,
    base_xy=(-0.3, 0.0),
    objects=(
        thing("red_cube", "box", "red", 0.05, 0.1),
        thing("blue_cube", "box", "blue", 0.05, 0.0),
        thing("green_cube", "box", "green", 0.15, 0.05),
        thing("small_can", "cylinder", "green", 0.05, -0.1, scale=0.8),
        thing("tall_can", "cylinder", "yellow", 0.15, -0.1, scale=1.2),
        thing("ball", "sphere", "white", 0.2, -0.2),
        thing("bin", "bin", "grey", 0.1, 0.35, z=0.04),
    ),
)


def said(sentence: str, scene: ObservedScene = TABLE) -> str:
    """Return the calls of the plan for a sentence, or the code of the refusal after "!"."""
    answer = StubPlanner(load_skills()).plan(sentence, scene)
    if isinstance(answer, Refusal):
        return f"!{answer.code}"
    return "; ".join(f"{call.skill}({', '.join(map(str, call.arguments.values()))})" for call in answer.steps)


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("there are exactly three cubes", True),
        ("there are at least three cubes", True),
        ("there are more than three cubes", False),
        ("there are fewer than three cans", True),
        ("there are exactly two cans", True),
        ("there are two or more cubes", True),
        ("there are more cubes than cans", True),
        ("there are as many cubes as cans", False),
        ("there is neither a mug nor a plate", True),
        ("nothing is in the bin", True),
        ("the bin has something in it", False),
        ("no cube is white", True),
        ("any cube is white", False),
        ("the tall can is taller than the small can", True),
        ("the red cube is closer to the bin than the blue cube", True),
        ("the red cube and the blue cube are of the same colour", False),
        ("the ball is white or red", True),
        ("all the cubes are red", False),
        ("the red cube is in the bin or the ball is white", True),
        ("the red cube is in the bin and the ball is white", False),
        ("your hand is empty", True),
        ("the tall can is the tallest can", True),
    ],
)
def test_a_condition_decides_what_is_done(condition: str, holds: bool) -> None:
    assert (
        said(f"if {condition}, tap the ball, otherwise tap the red cube") == f"tap({'ball' if holds else 'red_cube'})"
    )
    assert said(f"unless {condition}, tap the red cube, in which case tap the ball") == (
        "tap(ball)" if holds else "tap(red_cube)"
    )


@pytest.mark.parametrize(
    ("sentence", "plan"),
    [
        ("for each can, tap it and put it in the bin", "tap(small_can); pick(small_can); place_in(bin); tap(tall_can); pick(tall_can); place_in(bin)"),
        ("for each cube, if it is red tap it, otherwise push it 3 cm forward", "tap(red_cube); push(blue_cube, forward, 0.03); push(green_cube, forward, 0.03)"),
        ("put cans in the bin until one is left", "pick(small_can); place_in(bin)"),
        ("put cubes in the bin until only the red cube is left", "pick(blue_cube); place_in(bin); pick(green_cube); place_in(bin)"),
        ("while there are cans on the table, put one in the bin", "pick(small_can); place_in(bin); pick(tall_can); place_in(bin)"),
        ("put the ball in the bin, and if the bin is then no longer empty, go home", "pick(ball); place_in(bin); home()"),
        ("put the ball in the bin; if there is a mug, tap it", "pick(ball); place_in(bin)"),
    ],
)  # fmt: skip
def test_loops_and_steps_are_decided_on_paper(sentence: str, plan: str) -> None:
    assert said(sentence) == plan


@pytest.mark.parametrize(
    ("sentence", "code"),
    [
        # What follows a condition that does not hold must not be done with something else.
        ("if there is a mug, tap it. Put it in the bin", "object_not_found"),
        # Where both scopes differ, the person is asked or nothing is done.
        ("if the ball is red, tap the ball, and then go home", "impossible"),
        ("tap the ball and tap the red cube if the bin is full of sand", "unsupported"),
        ("tap the ball and tap the red cube if the red cube is blue", "ambiguous"),
        ("tap the red cube, but if the bin is empty, tap the ball", "ambiguous"),
        ("if there are two cubes, go home", "ambiguous"),
        ("if the cubes are red, go home", "ambiguous"),
        ("while the bin is empty, tap the ball", "impossible"),
        ("if it is raining, tap the ball", "unsupported"),
        ("if the red cube is on the ball, tap the ball", "impossible"),
    ],
)
def test_what_is_open_or_does_not_hold_moves_nothing(sentence: str, code: str) -> None:
    assert said(sentence) == f"!{code}"


def test_what_only_time_can_tell_is_decided_after_another_look() -> None:
    planner = StubPlanner(load_skills())
    first = planner.plan(
        "push the red cube 5 cm to the left, and if it is then left of the blue cube, tap the ball", TABLE
    )
    assert isinstance(first, Plan) and [call.skill for call in first.steps] == ["push"] and first.then
    moved = replace(TABLE, objects=(thing("red_cube", "box", "red", 0.05, 0.15), *TABLE.objects[1:]))
    rest = planner.go_on(moved)
    assert isinstance(rest, Plan) and str(rest) == "tap(object=ball)" and not rest.then
    planner.plan("push the red cube 5 cm to the left, and if it is then left of the blue cube, tap the ball", TABLE)
    missed = replace(TABLE, objects=(thing("red_cube", "box", "red", 0.05, -0.15), *TABLE.objects[1:]))
    nothing = planner.go_on(missed)
    assert isinstance(nothing, Plan) and not nothing.steps and "not so" in nothing.answer


def test_a_word_nobody_knows_is_refused_before_anything_moves() -> None:
    sentence = "push the red cube 5 cm to the left, and if it is then left of the blue cube, tap the frobnicator"
    assert said(sentence).startswith("!")


@pytest.mark.parametrize("sentence", ["open the drawer and if there is nothing in it, put the cube in it"])
def test_the_agent_looks_into_a_drawer_that_it_has_opened_and_goes_on(sentence: str) -> None:
    with open_session("put_in_drawer") as cell:
        episode = cell.run(sentence)
        assert [step.call.skill for step in episode.steps] == ["open_drawer", "pick", "place_in"] and episode.success
        scene = cell.observe()
        place = location_of(scene, scene.find("red_cube"))  # type: ignore[arg-type]
        assert place is not None and place.arguments[1] == "drawer"
        assert episode.plan is not None and len(episode.plan.steps) == 3
