"""What the loop around a model is worth: a scripted expert acts over HTTP, and a spoiler's plans move nothing."""

import importlib.util
import json
import random
import sys
from pathlib import Path
from types import ModuleType

import pytest
from support.gold import gold_goal

from robosandbox.workcell.session import open_session

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"


@pytest.fixture
def benchmark(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> ModuleType:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    sys.modules.pop(request.param, None)
    return __import__(str(request.param))


@pytest.mark.parametrize("benchmark", ["spoiled"], indirect=True)
@pytest.mark.parametrize("mode", ["plan", "act"])
def test_nothing_moves_of_a_spoiled_plan(benchmark: ModuleType, mode: str) -> None:
    draw = random.Random(7)
    rows = [benchmark.try_out(task, mode, draw) for task in ("put_in_bin", "put_in_drawer") for _ in range(2)]
    assert not [row for row in rows if row.moved] and len({row.how for row in rows}) >= 3


@pytest.mark.parametrize("benchmark", ["agents"], indirect=True)
@pytest.mark.parametrize(
    "arguments",
    [
        ["--tasks", "put_in_bin", "stack_two"],
        ["--upsets", "nudged"],
        pytest.param(["--upsets", "occupied"], marks=pytest.mark.slow),
        pytest.param(["--tasks", "pour_beads", "open_drawer", "sort_by_colour", "tap_cube"], marks=pytest.mark.slow),
    ],
)
def test_the_expert_that_acts_does_what_is_asked(benchmark: ModuleType, arguments: list[str]) -> None:
    assert benchmark.main(["--seeds", "1", *arguments]) == 0


@pytest.mark.parametrize("benchmark", ["agents"], indirect=True)
def test_a_run_that_was_cut_off_goes_on_and_its_rows_make_a_page(
    benchmark: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = tmp_path / "rows.jsonl"
    told = ["--planner", "expert", "--resume", str(rows), "--transcripts", str(tmp_path / "said")]
    assert benchmark.main([*told, "--tasks", "pick_cube_franka", "--seeds", "1"]) == 0
    first = rows.read_text()
    assert benchmark.main([*told, "--tasks", "pick_cube_franka", "--seeds", "2", "--prompts", "3", "--json"]) == 0
    assert rows.read_text().startswith(first) and len(rows.read_text().splitlines()) == 5
    report = json.loads(capsys.readouterr().out.partition("\n\n")[2].partition("\n")[2])
    assert report["task"]["rows"] == 2 and report["prompt"]["refused_right"] == 1
    (one, *_) = sorted((tmp_path / "said").iterdir())
    transcript = json.loads(one.read_text())["transcript"]
    assert transcript[-1]["answered"] and transcript[-1]["output_tokens"] == 100 and transcript[-1]["mode"] == "tools"
    league = _league()
    monkeypatch.setattr(league, "TARGET", tmp_path / "league.md")
    monkeypatch.setattr(league, "KEPT", tmp_path / "league_rows.jsonl")
    monkeypatch.setattr(sys, "argv", ["make_league.py", str(rows)])
    league.main()
    page = league.TARGET.read_text()
    assert "| expert | 2 tasks | 2/2" in page and "| expert | 3 prompts | 2 | 1 | 0 | 0 |" in page
    monkeypatch.setattr(sys, "argv", ["make_league.py"])
    league.main()
    assert league.TARGET.read_text() == page


def test_the_league_table_is_what_the_kept_rows_make() -> None:
    league = _league()
    assert league.page(*league.read(league.KEPT)) == league.TARGET.read_text(encoding="utf-8")


def test_rows_of_upsets_stand_beside_one_another_only_where_they_are_the_same() -> None:
    league = _league()
    row = {**league.FIELDS, "kind": "upset", "name": "nudged pick_can", "done": True, "claimed": True}
    stub, expert = {**row, "entry": "stub"}, {**row, "entry": "expert", "done": False}
    assert "| nudged | 1 | 1 | 0 |" in "".join(league.beside({"stub": [stub], "expert": [expert]}))
    assert not [*league.beside({"stub": [stub], "expert": [{**expert, "seed": 1}]})]


@pytest.mark.parametrize("benchmark", ["agents"], indirect=True)
def test_sealed_sentences_are_counted_and_not_shown(
    benchmark: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = sorted((BENCHMARKS.parent / "tests" / "prompts" / "sealed").glob("*.yaml"))[:1]
    rows = tmp_path / "rows.jsonl"
    assert benchmark.main(["--planner", "stub", "--sentences", *map(str, files), "--resume", str(rows)]) == 0
    found = [json.loads(line) for line in rows.read_text().splitlines()]
    assert found and not any(row["said"] or row["detail"] for row in found)
    assert {row["verdict"] for row in found} <= {"right", "refused_right", "wrong_motion", "missed"}


@pytest.mark.parametrize("benchmark", ["agents"], indirect=True)
@pytest.mark.parametrize(
    ("task", "goal"),
    [
        ("put_in_drawer", "inside(red_cube, drawer), closed(drawer)"),
        ("pick_can", "holding(can)"),
        ("push_left", None),
    ],
)
def test_a_tasks_success_is_said_in_relations(benchmark: ModuleType, task: str, goal: str | None) -> None:
    with open_session(task, what_if=False) as session:
        assert gold_goal(session) == goal


def _league() -> ModuleType:
    path = BENCHMARKS.parent / "docs" / "make_league.py"
    spec = importlib.util.spec_from_file_location("make_league", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
