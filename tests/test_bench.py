"""The bench: identical rows however it is run, one model per task, and the table to the letter."""

from dataclasses import replace

import pytest

from robosandbox.apps.bench.bench import BenchSettings, Row, Tally, run_bench
from robosandbox.apps.commands.bench import split_lists
from robosandbox.apps.commands.bench_report import RULE, header, line, summary
from robosandbox.errors import InputError
from robosandbox.tasks.judge.checks import Undisturbed
from robosandbox.tasks.loader import bundled_tasks, find_task, tasks_of_suite
from robosandbox.tasks.success import AllOf
from robosandbox.workcell.session import open_session

ROW = Row(
    task="pick_cube_franka",
    seed=0,
    success=True,
    claimed=True,
    steps=1,
    replans=0,
    secs=1.6,
    sim_secs=4.0,
    physics_steps=2000,
    reason="plan_complete",
    detail={"dz_mm": 166.905, "min_mm": 50.0},
    settings={},
    versions={},
)


def tallied(rows: list[Row]) -> Tally:
    tally = Tally()
    for row in rows:
        tally.add(row)
    return tally


def test_table_is_the_documented_one() -> None:
    assert [header(), RULE, line(ROW), "", *summary(tallied([ROW]))] == [
        "TASK               SEED  RESULT   SECS  REPLANS DETAIL",
        "------------------------------------------------------------------------",
        "pick_cube_franka   0     OK        1.6        0 dz_mm=166.905, min_mm=50.000",
        "",
        "SUMMARY: 1/1 successful",
    ]


def test_a_false_claim_is_shown() -> None:
    assert line(replace(ROW, success=False)).endswith("claimed=true")


def test_summary_of_several_seeds_gives_each_rate_with_its_interval() -> None:
    rows = [replace(ROW, seed=seed, success=seed != 3) for seed in range(50)]
    assert summary(tallied(rows)) == [
        "SUMMARY: 49/50 successful",
        "  pick_cube_franka  49/50  98.0%  95% Beta interval 91.0..99.8%",
    ]
    (rate,) = tallied(rows).rates()
    assert (rate.successes, rate.episodes) == (49, 50)


def test_an_episode_that_could_not_be_run_is_told_as_an_error() -> None:
    row = Row.of_error("sunk", 3, error="sunk: starts inside\n'table'", settings=BenchSettings())
    assert line(row) == "sunk               3     ERROR     0.0        0 error=sunk: starts inside 'table'"
    assert summary(tallied([ROW, row])) == ["SUMMARY: 1/2 successful, 1 not run"]


def test_lists_are_taken_by_space_or_comma() -> None:
    assert split_lists(["--tasks", "a", "b,c", "--seeds", "2", "--task-file", "x.yaml", "y.yaml"]) == [
        *("--tasks", "a", "--tasks", "b,c", "--seeds", "2", "--task-file", "x.yaml", "--task-file", "y.yaml"),
    ]


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return list(run_bench([find_task("pick_cube_scrambled"), find_task("home")], 4))


def untimed(rows: list[Row]) -> list[Row]:
    return [replace(row, secs=0.0) for row in rows]


def test_rows_come_by_task_and_seed_and_all_succeed_as_claimed(rows: list[Row]) -> None:
    names = ["pick_cube_scrambled", "home"]
    assert [(row.task, row.seed) for row in rows] == [(name, seed) for name in names for seed in range(4)]
    assert all(row.success and row.claimed and row.assists == () for row in rows)


@pytest.mark.slow
def test_rows_are_the_same_twice_in_a_row_and_on_two_processes(rows: list[Row]) -> None:
    tasks = [find_task("pick_cube_scrambled"), find_task("home")]
    assert untimed(list(run_bench(tasks, 4))) == untimed(rows)
    assert untimed(list(run_bench(tasks, 4, jobs=2))) == untimed(rows)


def test_a_seed_does_not_depend_on_the_seeds_before_it(rows: list[Row]) -> None:
    with open_session("pick_cube_scrambled", seed=3) as session:
        session.run()
        assert (session.driver.time, session.simulation.physics_steps) == (
            pytest.approx(rows[3].sim_secs, abs=1e-6),
            rows[3].physics_steps,
        )


def test_suites_are_what_tasks_name() -> None:
    standard, clutter, every = (tasks_of_suite(name) for name in ("standard", "clutter", "all"))
    assert len(standard) == 13 and {"home", "push_left"} <= {task.name for task in standard}
    assert {"clutter_pick", "stack_five"} <= {task.name for task in clutter}
    assert {task.name for task in every} == set(bundled_tasks())
    with pytest.raises(InputError, match=r"no suite 'cluter'; there is .*did you mean 'clutter'"):
        tasks_of_suite("cluter")


@pytest.mark.parametrize("name", bundled_tasks())
def test_every_bundled_task_asks_that_the_rest_stays_where_it_is(name: str) -> None:
    success = find_task(name).success
    checks = success.checks if isinstance(success, AllOf) else (success,)
    limits = [check.max_mm for check in checks if isinstance(check, Undisturbed) and check.but is not None]
    assert limits and max(limits) <= 10.0


def test_seeds_of_a_task_share_one_compiled_model() -> None:
    with open_session("stack_two") as session:
        for seed in range(5):
            session.reset(seed)
        assert session.mujoco.compilations == 1


def test_a_fault_in_an_episode_is_a_failed_row_and_the_bench_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    from robosandbox.agent.planner import StubPlanner

    def plan(*_: object) -> None:
        raise ZeroDivisionError("boom")

    monkeypatch.setattr(StubPlanner, "plan", plan)
    (first, second) = run_bench([find_task("pick_cube_franka")], 2, settings=BenchSettings(max_replans=0))
    assert not first.success and not second.success
    assert (first.reason, first.detail["agent"]) == ("fault", "fault: ZeroDivisionError: boom")
