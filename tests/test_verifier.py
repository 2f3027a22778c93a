"""Plans are checked by contracts over a scene: what can be done is let through, what cannot is refused with its cause."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import pytest

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.skills.catalogue import load_skills
from robosandbox.skills.primitives.abilities import RobotAbilities
from robosandbox.types import Limits, Plan, Refusal, SkillCall, Workspace
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session
from robosandbox.world.facts import fact, parse_facts
from robosandbox.world.symbolic_state import symbolic_state
from robosandbox.world.verifier import Constraints, Verification, verify

SKILLS = {skill.name: skill for skill in load_skills()}
TASKS = sorted(path.stem for path in (Path(__file__).parents[1] / "tasks" / "definitions").glob("*.yaml"))


def plan(text: str) -> Plan:
    """Return the plan that "pick can; place_at 0.1 0.2" stands for: arguments in the order of the skill's schema."""
    steps = []
    for words in (step.split() for step in text.split(";")):
        names = SKILLS[words[0]].schema.get("properties", {})
        arguments = {name: _value(word) for name, word in zip(names, words[1:], strict=False)}
        steps.append(SkillCall(skill=words[0], arguments=arguments))
    return Plan(steps=tuple(steps))


def _value(word: str) -> str | float:
    try:
        return float(word)
    except ValueError:
        return word


@cache
def world(task: str) -> EmbeddedWorkcell:
    """Return a world that no test moves."""
    return open_session(task, what_if=False)


def check(task: str, text: str, **options: object) -> Verification:
    session = world(task)
    robot = RobotAbilities(session.ctx, session.task.limits)
    return verify(plan(text), session.observe(), session.skills, robot=robot, **options)  # type: ignore[arg-type]


# Task, plan, number of the step that cannot be done, and the relation that it lacks.
IMPOSSIBLE = [
    ("put_in_drawer", "pick red_cube; place_in drawer", 2, "lets_in"),
    ("put_in_drawer", "open_drawer drawer; pick red_cube; place_in drawer; close_drawer drawer; pick red_cube", 5, "accessible"),
    ("put_in_drawer", "open_drawer drawer; pick can; place_in drawer; close_drawer drawer", 4, "shuts"),
    ("put_in_drawer", "open_drawer can", 1, "opens"),
    ("put_in_drawer", "close_drawer red_cube", 1, "opens"),
    ("put_in_drawer", "pick drawer", 1, "liftable"),
    ("put_in_drawer", "push drawer left 0.1", 1, "slides"),
    ("put_in_drawer", "pick can; open_drawer drawer", 2, "hand_empty"),
    ("open_drawer", "stack red_cube drawer", 1, "has_top"),
    ("close_drawer", "pick red_cube; close_drawer drawer", 2, "hand_empty"),
    ("close_drawer", "close_drawer drawer; pick red_cube; place_in drawer", 3, "lets_in"),
    ("pour_beads", "pick beads", 1, "liftable"),
    ("pour_beads", "tap beads", 1, "touchable"),
    ("pour_beads", "push beads left 0.1", 1, "slides"),
    ("pour_beads", "pour bowl", 1, "holding"),
    ("pour_beads", "pick bowl; pour cup", 2, "filled"),
    ("pour_beads", "pick cup; pour cup", 2, "distinct"),
    ("pour_beads", "pick cup; pour beads", 2, "holds_things"),
    ("pour_beads", "pick cup; pour bowl; pour bowl", 3, "filled"),
    ("pour_beads", "pick cup; place_on bowl", 2, "has_top"),
    ("pour_beads", "pick bowl; place_in cup", 2, "fits"),
    ("put_in_bin", "pick red_cube; pour grey_bin", 2, "pours"),
    ("put_in_bin", "place_in grey_bin", 1, "holding"),
    ("put_in_bin", "pick red_cube; pick grey_bin", 2, "hand_ready"),
    ("put_in_bin", "pick grey_bin; place_in grey_bin", 2, "distinct"),
    ("put_in_bin", "pick red_cube; place_in grey_bin; place_in grey_bin", 3, "holding"),
    ("put_in_bin", "pick red_cube; place_in grey_bin; push red_cube left 0.1", 3, "on_the_open"),
    ("stack_three", "pick red_cube; place_at 5 0", 2, "room_at"),
    ("rearrange_swap", "push red_cube back 0.4", 1, "reachable_after"),
    ("pick_tilted", "pick grey_block", 1, "clear"),
    ("place_on_block", "pick blue_block", 1, "graspable"),
    ("stack_three", "pick red_cube; place_at 0.48 -0.47", 2, "reachable_at"),
    ("stack_three", "pick red_cube; place_at 0.22 0.0", 2, "room_at"),
    ("stack_three", "stack green_cube blue_cube; stack red_cube blue_cube", 2, "room_on"),
    ("stack_three", "stack green_cube blue_cube; pick blue_cube", 2, "clear"),
    ("stack_three", "stack green_cube blue_cube; stack blue_cube red_cube", 2, "clear"),
    ("stack_three", "stack green_cube blue_cube; tap blue_cube", 2, "clear"),
    ("stack_three", "stack red_cube red_cube", 1, "distinct"),
    ("stack_three", "pick red_cube; place_in blue_cube", 2, "holds_things"),
    ("stack_three", "push red_cube right 0.9", 1, "way_on_table"),
    ("stack_three", "pick red_cube; push green_cube left 0.1", 2, "hand_empty"),
    ("narrow_gap", "push grey_wall left 0.1; pick red_cube", 1, "room_behind"),
    ("close_drawer", "tap can; push can right 0.1", 2, "room_behind"),
    ("put_in_drawer", "pick can; place_at 0.1 0.05; open_drawer drawer", 3, "room_to_open"),
    ("home", "pick red_cube; place_at 0.42 0.38", 2, "reachable_at"),
    ("put_in_drawer", "open_drawer drawer; pick red_cube; place_in drawer; pick red_cube; place_at 0.1 -0.2", 4, "room_to_take"),
    ("put_in_drawer", "pick red_cube; place_at 0.386 0.05", 2, "room_to_put_at"),
    ("tap_cube", "pick can; place_at 0.1 0.08; tap red_cube; push red_cube left 0.1", 4, "room_behind"),
    ("tap_ball", "pick bowl; place_on yellow_ball", 2, "has_top"),
    ("tap_ball", "pick bowl; tap yellow_ball", 2, "hand_empty"),
    ("clutter_pick", "pick purple_bar; stack red_cube purple_bar", 2, "hand_ready"),
    ("clutter_pick", "stack red_cube purple_bar", 1, "supports"),
]  # fmt: skip

POSSIBLE = [
    ("put_in_drawer", "open_drawer drawer; pick red_cube; place_in drawer; close_drawer drawer"),
    ("put_in_drawer", "open_drawer drawer; close_drawer drawer; open_drawer drawer"),
    ("put_in_drawer", "close_drawer drawer"),
    ("put_in_drawer", "pick can; place_at 0.0 0.05; open_drawer drawer"),
    ("put_in_drawer", "pick red_cube; place_at 0.12 0.05; open_drawer drawer"),
    ("home", "pick red_cube; place_at 0.42 0.30"),
    ("put_in_drawer", "stack red_cube can"),
    ("put_in_drawer", "pick can; place_beside red_cube left; home"),
    ("close_drawer", "pick red_cube; place_in drawer; close_drawer drawer"),
    ("close_drawer", "tap can; push red_cube left 0.1"),
    ("pour_beads", "pick cup; pour bowl; place_at 0.1 -0.2"),
    ("pour_beads", "pick cup; pour bowl; place_at 0.0 -0.2; pick bowl; pour cup"),
    ("pour_beads", "pick cup; place_in bowl"),
    ("pour_beads", "tap cup; tap bowl"),
    ("pour_beads", "push bowl forward 0.1"),
    ("put_in_bin", "pick red_cube; place_in grey_bin; pick red_cube; place_at 0.1 0.0"),
    ("put_in_bin", "pick red_cube; place_in grey_bin; pick grey_bin; place_at 0.1 0.0"),
    ("put_in_bin", "pick red_cube; pick red_cube; place_beside grey_bin right"),
    ("put_in_bin", "push grey_bin right 0.1; pick red_cube; place_in grey_bin"),
    ("put_in_bin", "tap grey_bin; home"),
    ("stack_three", "stack green_cube blue_cube; stack red_cube green_cube"),
    ("stack_three", "stack red_cube blue_cube; stack red_cube green_cube; stack blue_cube red_cube"),
    ("stack_three", "pick red_cube; place_at 0.22 -0.1"),
    ("stack_three", "stack red_cube blue_cube; pick red_cube; place_on blue_cube"),
    ("stack_three", "stack red_cube blue_cube; tap red_cube; home"),
    ("stack_three", "pick red_cube; home; place_on green_cube"),
    ("stack_three", "push red_cube forward 0.2; stack red_cube blue_cube"),
    ("stack_three", "pick blue_cube; place_beside red_cube right; stack green_cube blue_cube"),
    ("stack_five", "stack red_cube blue_cube; stack green_cube red_cube; stack yellow_cube green_cube; stack white_cube yellow_cube"),
    ("stack_five", "stack red_cube blue_cube; pick red_cube; place_at 0.0 0.3; stack white_cube blue_cube"),
    ("tap_ball", "tap yellow_ball; pick yellow_ball; place_in bowl; pick bowl"),
    ("tap_ball", "pick bowl; place_at 0.1 -0.2; tap bowl"),
    ("tap_cube", "stack red_cube can; tap red_cube"),
    ("pick_mug_rim", "pick mug; place_beside yellow_can left"),
    ("pick_mug_rim", "stack yellow_can grey_block; tap yellow_can"),
    ("rearrange_swap", "pick red_cube; place_at 0.3 -0.25; pick blue_can; place_at 0.1 -0.12; pick red_cube; place_at 0.2 0.12"),
    ("rearrange_swap", "stack red_cube grey_block; stack blue_can red_cube"),
    ("sort_by_colour", "pick red_ball; place_in red_bin; pick red_can; place_in red_bin; pick blue_can; home"),
    ("clutter_pick", "pick purple_bar; place_at 0.0 0.25; stack red_cube grey_block"),
    ("clear_to_bin", "pick purple_bar; home; place_at 0.0 0.2; push cyan_cube left 0.05"),
    ("narrow_gap", "pick red_cube; place_at 0.3 0.2; push grey_wall left 0.05"),
    ("pick_tilted", "pick yellow_block; place_at 0.1 0.2; pick grey_block"),
]  # fmt: skip


@pytest.mark.parametrize(("task", "text", "step", "relation"), IMPOSSIBLE)
def test_impossible_plan_is_refused_with_its_cause(task: str, text: str, step: int, relation: str) -> None:
    found = check(task, text).problems
    assert [(problem.step, problem.relation.relation) for problem in found] == [(step, relation)]
    cause, _, remedy = found[0].error.message.partition("; ")
    assert cause and remedy


@pytest.mark.parametrize(
    ("given", "said"), [("red_cube", "neither is given"), ("red_cube 0.5 blue_cube", "both are given")]
)
def test_turn_takes_an_angle_or_something_to_align_with(given: str, said: str) -> None:
    [problem] = check("stack_three", f"turn {given}").problems
    assert problem.relation == fact("arguments", "turn") and said in problem.error.message


@pytest.mark.parametrize(("task", "text"), POSSIBLE)
def test_possible_plan_is_accepted(task: str, text: str) -> None:
    assert not check(task, text).problems


@pytest.mark.parametrize("task", TASKS)
def test_grammars_plan_of_each_task_is_accepted(task: str) -> None:
    session = world(task)
    answer = session.agent.plan(session.task.prompt)
    assert not isinstance(answer, Refusal)
    assert not verify(answer, session.observe(), session.skills, robot=RobotAbilities(session.ctx)).problems


def test_all_wrong_calls_are_told_at_once() -> None:
    found = check("stack_three", "pick red_cub; place_on blue_cube; push green_cube up 0.1")
    assert [problem.step for problem in found.problems] == [1, 3]
    assert "did you mean 'red_cube'" in found.problems[0].error.message


def test_end_is_the_scene_after_the_plan() -> None:
    after = check("put_in_drawer", "open_drawer drawer; pick red_cube; place_in drawer; close_drawer drawer").end
    facts = {str(one.fact) for one in symbolic_state(after)}
    assert {"inside(red_cube, drawer)", "closed(drawer)", "hand_empty()", "on(can, table)"} <= facts
    assert not {"open(drawer)", "on(red_cube, table)", "empty(drawer)"} & facts


@pytest.mark.parametrize(
    ("constraints", "relation"),
    [
        (Constraints(never=frozenset({"red_cube"})), "untouched"),
        (Constraints(only=frozenset({"green_cube"})), "untouched"),
        (Constraints(exactly=1), "exactly"),
        (Constraints(order=(("red_cube", "green_cube"),)), "before"),
        (Constraints(end=parse_facts("on(red_cube, blue_cube)")), "on"),
    ],
)
def test_constraints_are_kept(constraints: Constraints, relation: str) -> None:
    text = "stack green_cube blue_cube; stack red_cube green_cube"
    found = check("stack_three", text, constraints=constraints).problems
    assert [problem.relation.relation for problem in found] == [relation]
    kept = Constraints(exactly=2, order=(("green_cube", "red_cube"),), end=(fact("on", "red_cube", "green_cube"),))
    assert not check("stack_three", text, constraints=kept).problems


@pytest.mark.parametrize(
    ("limits", "text", "relation"),
    [
        (Limits(workspace=Workspace(y=(-0.1, 0.5))), "tap red_cube", "reachable"),
        (Limits(workspace=Workspace(y=(-0.5, 0.1))), "stack red_cube blue_cube", "reachable_over"),
        (Limits(max_force_n=0.2), "tap red_cube", "may_press"),
    ],
)
def test_limits_are_kept(limits: Limits, text: str, relation: str) -> None:
    session = world("stack_three")
    found = verify(plan(text), session.observe(), session.skills, robot=RobotAbilities(session.ctx, limits)).problems
    assert [problem.relation.relation for problem in found] == [relation]


def steps_file(folder: Path, text: str) -> Path:
    file = folder / "steps.json"
    file.write_text(json.dumps([call.model_dump() for call in plan(text).steps]))
    return file


@pytest.mark.parametrize(
    ("text", "code", "lacks"),
    [("stack red_cube blue_cube", 0, None), ("stack red_cube blue_cube; pick blue_cube", 1, "clear(blue_cube)")],
)
def test_plan_command_checks_a_given_plan(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, code: int, lacks: str | None
) -> None:
    arguments = ["plan", "--steps", str(steps_file(tmp_path, text)), "--task", "stack_two", "--json"]
    assert run_app(app, "robo-sandbox", arguments) == code
    told = json.loads(capsys.readouterr().out)
    assert [problem["relation"] for problem in told["problems"]] == ([lacks] if lacks else [])
    assert "on(red_cube, blue_cube)" in told["end"]


def test_plan_command_says_what_a_steps_file_holds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "steps.json"
    file.write_text('[{"skil": "pick"}]')
    assert run_app(app, "robo-sandbox", ["plan", "--steps", str(file)]) == 2
    assert "--steps: 0.skill" in capsys.readouterr().err
