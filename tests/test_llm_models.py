"""A real small model behind llama.cpp's server: whatever it writes keeps to the schema, and nothing unchecked moves."""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from support.llama_server import packaged_weights

pytestmark = [
    pytest.mark.model,
    pytest.mark.slow,
    pytest.mark.skipif(
        find_spec("xllamacpp") is None or packaged_weights() is None,
        reason="no small model here: uv sync --group models",
    ),
]


@pytest.mark.parametrize("mode", ["plan", "act"])
def test_a_small_model_answers_by_the_schema_and_moves_nothing_unchecked(mode: str) -> None:
    benchmark = Path(__file__).parent.parent / "benchmarks" / "agents.py"
    limits = ["--max-turns", "1", "--max-steps", "2"]
    options = ["--planner", "openai", "--mode", mode, "--prompts", "2", *limits, "--json"]
    done = subprocess.run([sys.executable, str(benchmark), *options], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    sums = json.loads(done.stdout)["prompt"]
    assert sums["valid"] == sums["by_schema"] >= 2
    assert sums["unchecked"] == sums["unfit"] == sums["strayed"] == 0 and sums["tokens_each"] > 500
