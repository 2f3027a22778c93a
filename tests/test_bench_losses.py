"""A bench loses no row: broken tasks, seeds without a layout, benches that are broken off, rows without number."""

import json
import logging
import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

from robosandbox import open_session, plugins
from robosandbox.apps.bench.bench import BenchSettings, Row, run_bench
from robosandbox.apps.bench.engines import ProcessPool
from robosandbox.apps.bench.episodes import Chunk
from robosandbox.apps.bench.results_file import ResultsFile
from robosandbox.apps.commands import bench
from robosandbox.apps.commands.bench_report import RowArray, open_rows
from robosandbox.apps.commands.console import EXIT_FAILED, EXIT_USAGE, run_app
from robosandbox.errors import InputError, ServiceUnavailableError
from robosandbox.tasks.loader import bundled_tasks, load_task
from robosandbox.tasks.task import Task
from robosandbox.validation import validate
from robosandbox.world.episode_cache import cached_for_episode

CUBE = {
    "id": "red_cube",
    "kind": "box",
    "size": [0.02, 0.02, 0.02],
    "pose": {"xyz": [0.1, 0.0, 0.06]},
    "rgba": [0.85, 0.2, 0.2, 1.0],
    "mass": 0.05,
}
PICKED = {"kind": "lifted", "object": "red_cube"}


def task(name: str, **fields: object) -> Task:
    document = {"name": name, "prompt": "go home", "scene": {}, "success": {"kind": "at_home"}, **fields}
    return validate(document, Task, source=name)


def sunk(name: str = "sunk") -> Task:
    """No seed can start: the cube is written into the table."""
    return task(name, scene={"objects": [{**CUBE, "pose": {"xyz": [0.1, 0.0, 0.03]}}]}, success=PICKED)


def cramped(name: str = "cramped") -> Task:
    """Seed 0 is as written; no other has a layout, as two cubes that are to stay on 2 cm have no room."""
    area = {"area": [[0.10, 0.12], [0.0, 0.02]]}
    other = {**CUBE, "id": "blue_cube", "pose": {"xyz": [0.2, 0.1, 0.06]}, "randomize": area}
    return task(name, scene={"objects": [{**CUBE, "randomize": area}, other]})


def written(folder: Path, *tasks: Task) -> list[str]:
    files = []
    for each in tasks:
        file = folder / f"{each.name}.yaml"
        file.write_text(json.dumps(each.model_dump(mode="json", exclude_none=True)))
        files.append(str(file))
    return files


def run(*arguments: str) -> int:
    return run_app(bench.app, "robo-sandbox-bench", bench.split_lists(arguments))


@pytest.mark.parametrize("jobs", ["1", pytest.param("2", marks=pytest.mark.slow)])
def test_broken_tasks_among_ten_are_error_rows_and_the_others_run(
    jobs: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    tasks = [task(f"home_{index}") for index in range(4)]
    files = written(tmp_path, *tasks[:2], sunk(), *tasks[2:], cramped())
    (tmp_path / "typo.yaml").write_text("name: typo\nprompt: x\nsuces: {}\n")
    files.insert(3, str(tmp_path / "typo.yaml"))
    assert run("--task-file", *files, "--seeds", "2", "--jobs", jobs, "--json", "-") == EXIT_FAILED
    out, err = capsys.readouterr()
    rows = json.loads(out)
    names = ["home_0", "home_1", "sunk", "typo", "home_2", "home_3", "cramped"]
    assert [(row["task"], row["seed"]) for row in rows] == [(name, seed) for name in names for seed in range(2)]
    wrong = {(row["task"], row["seed"]): row["detail"]["error"] for row in rows if row["reason"] == "error"}
    assert list(wrong) == [("sunk", 0), ("sunk", 1), ("typo", 0), ("typo", 1), ("cramped", 1)]
    assert "inside 'table'" in wrong["sunk", 0] and "suces" in wrong["typo", 1]
    assert "seed 1: no layout" in wrong["cramped", 1]
    assert all(row["success"] for row in rows if row["reason"] != "error")
    assert err.count(" ERROR ") == 5 and "SUMMARY: 9/14 successful, 5 not run" in err
    # Tasks of which no seed can be run are told at once.
    assert [record.args[0].split(":")[0] for record in caplog.records if record.levelno >= logging.WARNING] == [
        "sunk",
        "typo.yaml",
    ]  # type: ignore[index, union-attr]


def test_a_bench_of_broken_tasks_only_is_a_wrong_input_and_leaves_files_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = tmp_path / "rows.json"
    rows.write_text("[]")
    assert run("--task-file", *written(tmp_path, sunk(), sunk("deep")), "--json", str(rows)) == EXIT_USAGE
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and "sunk: " in err and "deep: " in err
    assert rows.read_text() == "[]"


def test_a_fault_while_a_world_is_laid_out_is_an_error_row(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ZeroDivisionError("boom")

    monkeypatch.setattr("robosandbox.tasks.layouts.draw_layout", fail)
    (row,) = run_bench([task("home_0")], 1)
    assert (row.result, row.detail) == ("ERROR", {"error": "ZeroDivisionError: boom"})


def test_errors_are_tried_again_by_a_bench_that_goes_on(tmp_path: Path) -> None:
    path, settings = tmp_path / "rows.jsonl", BenchSettings()
    earlier = ResultsFile.resume(path, settings)
    assert [row.result for row in run_bench([task("home_0"), sunk("late")], 1, earlier=earlier)] == ["OK", "ERROR"]
    earlier.close()
    earlier = ResultsFile.resume(path, settings)
    assert earlier.holds("home_0", 0) and not earlier.holds("late", 0)
    ran: list[Row] = []
    # Repaired meanwhile.
    rows = list(run_bench([task("home_0"), task("late")], 1, earlier=earlier, on_row=ran.append))
    earlier.close()
    assert [row.result for row in rows] == ["OK", "OK"] and [row.task for row in ran] == ["late"]
    assert ResultsFile.resume(path, settings).find("late", 0) == ran[0]


class BreaksOff:
    """Gives some rows and then is gone."""

    def __init__(self, *rows: Row) -> None:
        self._rows = rows

    def run(self, chunks: Iterable[Chunk]) -> Iterator[Row]:
        del chunks
        yield from self._rows
        raise ServiceUnavailableError("the cluster is gone")


def test_the_document_of_a_bench_that_is_broken_off_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = list(run_bench([task("home_0")], 2))
    load = plugins.load_plugin

    def load_plugin(group: str, name: str) -> Any:
        return (lambda *_: BreaksOff(*rows)) if group == "engines" else load(group, name)

    monkeypatch.setattr(plugins, "load_plugin", load_plugin)
    target = tmp_path / "rows.json"
    code = run(
        "--task-file", *written(tmp_path, task("home_0")), "--seeds", "3", "--engine", "x", "--json", str(target)
    )
    assert code == 3 and "the cluster is gone" in capsys.readouterr().err
    assert [row["seed"] for row in json.loads(target.read_text())] == [0, 1]


def test_rows_in_any_order_are_told_in_the_one_asked_for_and_an_engine_that_ends_early_is_said() -> None:
    tasks = [task("home_0"), task("home_1")]
    rows = list(run_bench(tasks, 3))

    class Shuffled(BreaksOff):
        def run(self, chunks: Iterable[Chunk]) -> Iterator[Row]:
            told = [(chunk.task.name, seed) for chunk in chunks for seed in chunk.seeds]
            assert told == [(name, seed) for name in ("home_0", "home_1") for seed in range(3)]
            yield from self._rows

    assert list(run_bench(tasks, 3, engine=Shuffled(*reversed(rows)))) == rows
    with pytest.raises(ServiceUnavailableError, match="without home_1, seed 2"):
        list(run_bench(tasks, 3, engine=Shuffled(*rows[:-1])))


def test_chunks_are_small_at_the_end_and_hold_each_seed_once() -> None:
    taken: list[Chunk] = []

    class Counting(BreaksOff):
        def run(self, chunks: Iterable[Chunk]) -> Iterator[Row]:
            taken.extend(chunks)
            return super().run(())

    with pytest.raises(ServiceUnavailableError):
        list(run_bench([task("home_0"), task("home_1")], 50, jobs=2, engine=Counting()))
    assert [(chunk.task.name, seed) for chunk in taken for seed in chunk.seeds] == [
        (name, seed) for name in ("home_0", "home_1") for seed in range(50)
    ]
    sizes = [len(chunk.seeds) for chunk in taken]
    assert sizes[0] == 10 and sizes[-2:] == [1, 1]
    assert all(size <= max(1, sum(sizes[k:]) / 2 / 2) for k, size in enumerate(sizes))


def test_a_file_of_rows_is_a_whole_document_after_each_of_them(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (row,) = run_bench([task("home_0")], 1)
    file = tmp_path / "rows.json"
    array = open_rows(str(file))
    for count in range(1, 4):
        array.add(row)
        assert file.read_text() == json.dumps([row.record()] * count, indent=1) + "\n"
    array.close()
    assert file.read_text() == json.dumps([row.record()] * 3, indent=1) + "\n"
    RowArray().close()
    assert capsys.readouterr().out == ""


def test_processes_are_sent_no_more_than_they_run_soon() -> None:
    made: list[int] = []

    def chunks() -> Iterator[Chunk]:
        for seed in range(12):
            made.append(seed)
            yield Chunk(task("home_0"), (seed,), BenchSettings())

    coming = ProcessPool(1).run(chunks())
    next(coming)
    assert len(made) <= 3
    assert len(list(coming)) == 11


@pytest.mark.slow
def test_memory_does_not_grow_with_the_rows() -> None:
    root = Path(__file__).parents[1]
    command = [sys.executable, str(root / "benchmarks" / "rows.py"), "--rows", "6000", "--json"]
    report = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    # Ten times what is measured, and a fiftieth of what rows that are kept would take for 100,000 of them.
    # 30,000 rows grow by the same 3 to 5 MB as 6,000: the garbage that the collector of a command lets stand.
    assert len(report) == 4 and all(found["growth_mb"] < 10.0 for found in report.values()), report
    assert all(found["in_order"] for found in report.values())


def test_a_task_that_is_out_of_reach_as_written_has_other_seeds(tmp_path: Path) -> None:
    for x, y in ((0.49, 0.49), (0.6, 0.0), (-0.2, 0.55)):
        far = task("far", scene={"objects": [{**CUBE, "pose": {"xyz": [x, y, 0.06]}}]})
        (file,) = written(tmp_path, far)
        rows = list(run_bench([load_task(file)], 3))
        assert [row.result for row in rows if row.result == "ERROR"] == []


def test_bundled_tasks_are_all_tried_before_the_first_row() -> None:
    broken = [sunk(), *(load_task(path) for path in list(bundled_tasks().values())[:2])]
    seen: list[int] = []

    class Counts:
        def run(self, chunks: Iterable[Chunk]) -> Iterator[Row]:
            seen.append(len(list(chunks)))
            yield from ()

    with pytest.raises(ServiceUnavailableError):
        list(run_bench(broken, 1, engine=Counts()))
    assert seen == [2]
    with pytest.raises(InputError, match="inside 'table'"):
        list(run_bench([sunk()], 1, engine=Counts()))
    assert seen == [2]


def test_what_was_kept_of_a_layout_is_forgotten_with_the_next() -> None:
    asked: list[int] = []

    @cached_for_episode(4)
    def twice(number: int) -> int:
        asked.append(number)
        return 2 * number

    with open_session("home") as session:
        assert [twice(1), twice(1)] == [2, 2] and asked == [1]
        session.reset(1)
        assert twice(1) == 2 and asked == [1, 1]
