"""What the loop around a model is worth: a scripted expert acts over HTTP, and a spoiler's plans move nothing."""

import random
import sys
from pathlib import Path
from types import ModuleType

import pytest

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"


@pytest.fixture
def benchmark(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> ModuleType:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    sys.modules.pop(request.param, None)
    return __import__(request.param)


@pytest.mark.parametrize("benchmark", ["spoiled"], indirect=True)
@pytest.mark.parametrize("mode", ["plan", "act"])
def test_nothing_moves_of_a_spoiled_plan(benchmark: ModuleType, mode: str) -> None:
    draw = random.Random(7)
    rows = [benchmark.try_out(task, mode, draw) for task in ("put_in_bin", "put_in_drawer") for _ in range(4)]
    assert not [row for row in rows if row.moved] and len({row.how for row in rows}) >= 3


@pytest.mark.parametrize("benchmark", ["agents"], indirect=True)
@pytest.mark.parametrize(
    "arguments",
    [
        ["--tasks", "put_in_bin", "stack_two"],
        ["--upsets", "--tasks", "nudged", "occupied"],
        pytest.param(["--seeds", "3"], marks=pytest.mark.slow),
    ],
)
def test_the_expert_that_acts_does_what_is_asked(
    benchmark: ModuleType, monkeypatch: pytest.MonkeyPatch, arguments: list[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["agents.py", "--seeds", "1", *arguments])
    assert benchmark.main() == 0
