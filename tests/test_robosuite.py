"""robosuite under its own judge, where the environment of its driver is there: `uv sync --project examples/drivers/robosuite`."""

import json
import subprocess
from pathlib import Path

import pytest

BENCH = Path(__file__).parents[1] / "examples" / "drivers" / "robosuite" / ".venv" / "bin" / "bench_robosuite.py"


@pytest.mark.slow
@pytest.mark.skipif(not BENCH.exists(), reason="the environment of examples/drivers/robosuite is not there")
@pytest.mark.parametrize("task", ["Lift", "PickPlaceCan", "NutAssemblySquare"])
def test_what_is_claimed_of_a_robosuite_task_its_own_judge_says_too(tmp_path: Path, task: str) -> None:
    rows = tmp_path / "rows.json"
    subprocess.run([BENCH, task, "--json", rows], check=True, capture_output=True, timeout=600)
    (row,) = json.loads(rows.read_text())
    assert row["claimed"], row["reason"]
    assert row["judged"]
