"""Goals in relations are planned for by the skills' contracts."""

from __future__ import annotations

import heapq
import importlib
import itertools
import json
import random
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType

import pytest

from robosandbox.agent.goal_planner import GoalPlanner, is_goal
from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.errors import CollisionError, Phase
from robosandbox.skills.catalogue import load_skills
from robosandbox.tasks.task import Task
from robosandbox.types import DetectedObject, ObservedScene, Plan, Pose, Refusal, SkillCall
from robosandbox.workcell.session import open_session
from robosandbox.world.abilities import Abilities
from robosandbox.world.achievers import Achievers
from robosandbox.world.alternatives import Attempt
from robosandbox.world.contracts import find
from robosandbox.world.facts import TABLE, Fact, fact, parse_facts
from robosandbox.world.goal_conflicts import find_conflict
from robosandbox.world.predicate import View
from robosandbox.world.solve import solve
from robosandbox.world.verifier import Constraints, verify

SKILLS = load_skills()
HALF = 0.02
GREY = (0.5, 0.5, 0.5, 1.0)
# What stands on what; None is the table.
Stacks = dict[str, str | None]


def thing(
    name: str, kind: str, size: tuple[float, ...], xyz: tuple[float, float, float], **more: float
) -> DetectedObject:
    return DetectedObject(id=name, kind=kind, size=size, colour="grey", rgba=GREY, pose=Pose(xyz=xyz), **more)  # type: ignore[arg-type]


def scene_of(*objects: DetectedObject) -> ObservedScene:
    return ObservedScene(time=0.0, objects=objects, table_height=0.04, base_xy=(-0.3, 0.0))


def block_scene(stacks: Stacks) -> ObservedScene:
    """Return blocks that stand on one another, each tower at a spot of its own."""
    bases = [name for name, below in stacks.items() if below is None]
    spots = {name: (0.05 + 0.12 * (k % 3), -0.2 + 0.12 * (k // 3)) for k, name in enumerate(bases)}
    objects = []
    for name in stacks:
        level, base = 0, name
        while (below := stacks[base]) is not None:
            level, base = level + 1, below
        objects.append(thing(name, "box", (HALF,) * 3, (*spots[base], 0.04 + HALF + 2 * HALF * level)))
    return scene_of(*objects)


def drawn(names: list[str], draw: random.Random) -> Stacks:
    """Return random towers of these blocks."""
    stacks: Stacks = {}
    for name in draw.sample(names, len(names)):
        tops = [other for other in stacks if other not in stacks.values()]
        stacks[name] = draw.choice([None, *tops])
    return stacks


def least_calls(start: Stacks, goal: Stacks) -> int:
    """Return the length of the shortest plan in calls, by uniform-cost search: a reference with no geometry in it."""
    count = itertools.count()
    queue = [(0, next(count), start)]
    seen = set()
    while queue:
        cost, _, now = heapq.heappop(queue)
        if all(now[name] == below for name, below in goal.items()):
            return cost
        key = tuple(sorted((name, below or "") for name, below in now.items()))
        if key in seen:
            continue
        seen.add(key)
        for name in now:
            if name in now.values():
                continue
            for target in [None, *(other for other in now if other != name and other not in now.values())]:
                if target != now[name]:
                    # One call stacks; to the table it is picked and placed.
                    heapq.heappush(queue, (cost + (2 if target is None else 1), next(count), {**now, name: target}))
    raise AssertionError("the reference finds no plan")


def facts_of(goal: Stacks) -> list[Fact]:
    return [fact("on", name, below or TABLE) for name, below in goal.items()]


@pytest.mark.parametrize("count", [3, 4, 5])
def test_plans_for_towers_are_as_short_as_a_references(count: int) -> None:
    draw = random.Random(count)
    names = [f"block_{letter}" for letter in "abcdefgh"[:count]]
    ours = least = 0
    for _ in range(12):
        start, goal = drawn(names, draw), drawn(names, draw)
        scene = block_scene(start)
        answer = solve(facts_of(goal), scene, SKILLS)
        assert isinstance(answer, Plan), (start, goal, answer)
        end = verify(answer, scene, SKILLS).end
        assert all(find(one, View.of(end)).holds for one in facts_of(goal))
        ours, least = ours + len(answer.steps), least + least_calls(start, goal)
    assert least <= ours <= 1.1 * least


DRAWER = thing("drawer", "drawer", (0.16, 0.20, 0.09, 0.12), (0.28, 0.05, 0.04), opening=0.0)
CUBE = thing("cube", "box", (0.015,) * 3, (0.1, -0.25, 0.055))
BALL = thing("ball", "sphere", (0.02,), (0.1, 0.25, 0.06))
BOWL = thing("bowl", "bowl", (0.06, 0.045), (0.0, 0.3, 0.04))


@pytest.mark.parametrize(
    ("goal", "calls"),
    [
        ("inside(cube, drawer)", "open_drawer pick place_in close_drawer"),
        ("inside(cube, drawer), open(drawer)", "open_drawer pick place_in"),
        ("inside(ball, bowl), holding(cube)", "pick place_in pick"),
        ("at(cube, 0.1, 0.25)", "pick place_at pick place_at"),
        ("holding(cube)", "pick"),
        ("on(cube, table)", ""),
    ],
)
def test_what_a_goal_needs_is_done_first_and_drawers_are_left_as_they_were(goal: str, calls: str) -> None:
    answer = solve(parse_facts(goal), scene_of(DRAWER, CUBE, BALL, BOWL), SKILLS)
    assert isinstance(answer, Plan), answer
    assert [call.skill for call in answer.steps] == calls.split()


@pytest.mark.parametrize(
    ("goal", "constraints", "cause"),
    [
        ("on(cube, ball)", Constraints(), "nothing stays on top"),
        ("inside(drawer, bowl)", Constraints(), "stays where it is"),
        ("inside(cube, drawer)", Constraints(never=frozenset({"drawer"})), "not to be touched"),
        ("at(cube, 2.0, 0.0)", Constraints(), "off the table"),
        ("on(cube, moon)", Constraints(), "no object 'moon' is seen"),
    ],
)
def test_why_there_is_no_plan_is_said(goal: str, constraints: Constraints, cause: str) -> None:
    answer = solve(parse_facts(goal), scene_of(DRAWER, CUBE, BALL, BOWL), SKILLS, constraints=constraints)
    assert isinstance(answer, Refusal) and cause in answer.message


TRAY = thing("tray", "tray", (0.03, 0.03, 0.012), (0.1, 0.0, 0.04))
TOWER = block_scene({"a": None, "b": None, "c": "a", "d": "c"})


def planned_for(goal: str, scene: ObservedScene, **asked: object) -> list[str]:
    answer = solve(parse_facts(goal), scene, SKILLS, **asked)  # type: ignore[arg-type]
    assert isinstance(answer, Plan), answer
    return [str(call) for call in answer.steps]


@pytest.mark.parametrize(
    ("goal", "cause"),
    [
        ("inside(a, tray), inside(b, tray)", "no room for b in tray: with a there it is too full"),
        ("on(a, b), on(b, a)", "each need another of them to hold first"),
        ("on(c, b), on(d, b)", "no room for d at b: occupied by c"),
        ("at(a, 0.3, 0.3), at(a, 0.3, -0.3)", "exclude one another"),
    ],
)
def test_goals_that_exclude_one_another_are_told(goal: str, cause: str) -> None:
    answer = solve(parse_facts(goal), scene_of(TRAY, *TOWER.objects), SKILLS)
    assert isinstance(answer, Refusal) and cause in answer.message


def test_things_of_one_tower_that_go_to_the_table_do_not_exclude_one_another() -> None:
    goals = parse_facts("on(c, table), on(d, table), on(a, d), on(b, c)")
    assert find_conflict(goals, TOWER, Achievers(SKILLS), Abilities()) is None


def test_what_is_in_the_way_is_put_back_where_that_is_asked() -> None:
    assert planned_for("on(a, b)", TOWER)[-1] == "stack(object=a, target=b)"
    answer = solve(parse_facts("on(a, b)"), TOWER, SKILLS, constraints=Constraints(put_back=True))
    assert isinstance(answer, Plan)
    end = verify(answer, TOWER, SKILLS).end
    place = {name: tuple(round(v, 2) for v in end.find(name).pose.xyz[:2]) for name in "cd"}  # type: ignore[union-attr]
    assert place == {name: (0.05, -0.2) for name in "cd"} and find(fact("on", "d", "c"), View.of(end)).holds


def test_verifier_holds_a_plan_to_putting_back() -> None:
    answer = solve(parse_facts("on(a, b)"), TOWER, SKILLS)
    assert isinstance(answer, Plan)
    asked = Constraints(put_back=True, end=(fact("on", "a", "b"),))
    problems = verify(answer, TOWER, SKILLS, constraints=asked).problems
    assert any("is not where it was" in str(problem) for problem in problems)


class LameOnTheLeft(Abilities):
    """A robot that does not get to the left half of the table, as it is found when it is asked."""

    asked = 0

    def out_of_reach(
        self, point: Sequence[float], scene: ObservedScene, carried: DetectedObject | None = None
    ) -> str | None:
        self.asked += 1
        return "it is on the left" if point[1] > -0.05 else None


def test_what_the_robot_denies_of_a_plan_is_searched_around() -> None:
    robot = LameOnTheLeft()
    calls = planned_for("clear(a)", TOWER, robot=robot)
    assert all("y=-" in call for call in calls if call.startswith("place_at")) and robot.asked
    answer = solve(parse_facts("at(b, 0.1, 0.2)"), TOWER, SKILLS, robot=robot)
    assert isinstance(answer, Refusal) and "it is on the left" in answer.message


def test_call_that_has_failed_is_planned_around() -> None:
    first = planned_for("clear(c)", TOWER)
    failed = SkillCall(skill="stack", arguments={"object": "d", "target": "b"})
    assert [str(failed)] == first
    tried = Attempt(completed=(), failed=failed, error=CollisionError("the hand meets b", phase=Phase.PLAN).failure)
    assert planned_for("clear(c)", TOWER, tried=[tried])[0] == "pick(object=d)"


@pytest.mark.parametrize("number", range(0, 80, 9))
def test_plans_hold_by_the_rules_of_symbols_alone(number: int, benchmark: ModuleType) -> None:
    problem = benchmark.problems(80, 7)[number]
    answer, _ = benchmark.plan(problem, SKILLS)
    assert isinstance(answer, Plan) and not benchmark.Replay(problem).run(answer.steps)


@pytest.mark.slow
def test_plans_are_about_as_short_as_a_reference_planners(benchmark: ModuleType) -> None:
    pytest.importorskip("up_fast_downward", reason="uv sync --group reference")
    rows = [benchmark.row(k, problem, SKILLS, 10.0) for k, problem in enumerate(benchmark.problems(12, 7))]
    told = benchmark.summary(rows)
    assert told["only_reference_solved"] == 0 and told["length_ratio"] <= 1.1


@pytest.fixture(scope="module")
def benchmark() -> Iterator[ModuleType]:
    """The module of benchmarks/achieve.py, whose neighbours it imports by their names."""
    folder = str(Path(__file__).resolve().parents[1] / "benchmarks")
    sys.path.insert(0, folder)
    yield importlib.import_module("achieve")
    sys.path.remove(folder)


def test_goal_planner_plans_for_a_list_of_relations() -> None:
    answer = GoalPlanner(SKILLS).plan("inside(ball, bowl)", scene_of(CUBE, BALL, BOWL))
    assert isinstance(answer, Plan) and [call.skill for call in answer.steps] == ["pick", "place_in"]


@pytest.mark.parametrize(
    ("goal", "calls"),
    [("at_home", ["home"]), ("inside(ball, bowl), at_home()", ["pick", "place_in", "home"]), ("hand_empty", [])],
)
def test_goal_of_the_arm_alone_takes_a_call_of_its_own(goal: str, calls: list[str]) -> None:
    assert is_goal(goal)
    answer = GoalPlanner(SKILLS).plan(goal, scene_of(CUBE, BALL, BOWL))
    assert isinstance(answer, Plan) and [call.skill for call in answer.steps] == calls


def test_goal_that_the_arm_has_reached_takes_no_call() -> None:
    with open_session("stack_two", what_if=False) as session:
        assert session.run("at_home").plan == Plan(steps=(), answer="It is so already: at_home().")
        session.run("pick up the red cube")
        plan = session.run("at_home").plan
        assert plan is not None and [call.skill for call in plan.steps] == ["home"]


@pytest.mark.parametrize("prompt", ["open", "clear", "empty", "put on", "home"])
def test_words_of_sentences_are_no_goals(prompt: str) -> None:
    assert not is_goal(prompt)


def test_run_command_reaches_a_goal(capsys: pytest.CaptureFixture[str]) -> None:
    goal = "at(red_cube, 0.15, 0.14), on(blue_cube, red_cube)"
    assert run_app(app, "robo-sandbox", ["run", "--goal", goal, "--task", "stack_two", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["success"]


def test_task_with_a_goal_is_planned_for_and_judged() -> None:
    task = Task.model_validate(
        {
            "name": "goal_task",
            "goal": "at(red_cube, 0.2, 0.2), on(blue_cube, red_cube)",
            "success": {"kind": "goal", "relations": "on(blue_cube, red_cube)"},
            "scene": {
                "objects": [
                    {"id": name, "kind": "box", "size": [0.02] * 3, "pose": {"xyz": [0.1, y, 0.062]}, "mass": 0.05}
                    for name, y in (("red_cube", -0.1), ("blue_cube", 0.1))
                ]
            },
        }
    )
    with open_session(task, what_if=False) as session:
        assert not session.judge().success
        episode = session.run()
        assert episode.success and session.judge().success


@pytest.mark.parametrize(
    ("changes", "message"),
    [({"prompt": "tap it"}, "in place of prompt"), ({"goal": "clear(red_cube)"}, "nobody judges that"), ({"goal": "on(red_cube, moon)"}, "moon")],
)  # fmt: skip
def test_goal_that_a_task_cannot_have_is_told(changes: dict[str, str], message: str) -> None:
    cube = {"id": "red_cube", "kind": "box", "size": [0.02] * 3, "pose": {"xyz": [0.1, 0.0, 0.062]}}
    with pytest.raises(ValueError, match=message):
        Task.model_validate({"name": "t", "goal": "on(red_cube, table)", "scene": {"objects": [cube]}, **changes})


def test_run_command_says_what_is_wrong_with_a_goal(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_app(app, "robo-sandbox", ["run", "--goal", "over(red_cube, blue_cube)"]) == 2
    assert "no relation is called 'over'" in capsys.readouterr().err


def test_one_goal_that_its_own_calls_do_not_bring_about_is_refused_by_what_would_be_so() -> None:
    drawer = thing("cabinet", "drawer", (0.16, 0.16, 0.10, 0.12), (0.45, 0.15, 0.04), opening=0.12)
    bottle = thing("bottle", "cylinder", (0.02, 0.09), (0.35, -0.15, 0.13))
    answer = solve([fact("inside", "bottle", "cabinet")], scene_of(drawer, bottle), SKILLS)
    assert isinstance(answer, Refusal)
    assert "it would not be so: bottle is not in cabinet: its middle is over the rim" in answer.message
