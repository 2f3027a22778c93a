"""LIBERO under its own judge, where the environment of its driver is there: `uv sync --project examples/drivers/libero`."""

import json
import subprocess
from pathlib import Path

import pytest

BENCH = Path(__file__).parents[1] / "examples" / "drivers" / "libero" / ".venv" / "bin" / "bench_libero.py"


@pytest.mark.slow
@pytest.mark.skipif(not BENCH.exists(), reason="the environment of examples/drivers/libero is not there")
@pytest.mark.parametrize(
    ("by", "goal"),
    [("relations", "inside(alphabet_soup_1, basket_1)"), ("sentence", "")],
    ids=["relations", "sentence"],
)
def test_what_is_claimed_of_a_libero_task_its_own_judge_says_too(tmp_path: Path, by: str, goal: str) -> None:
    rows = tmp_path / "rows.json"
    command = [BENCH, "libero_object", "--tasks", "0", "--by", by, "--json", rows]
    subprocess.run(command, check=True, capture_output=True, timeout=600)
    (row,) = json.loads(rows.read_text())
    assert row["sentence"] == "pick the alphabet soup and place it in the basket"
    assert row["goal"] == goal
    assert row["claimed"] == row["judged"]
    assert row["judged"] or by == "sentence", row["reason"]
