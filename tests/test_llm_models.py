"""A real small model behind llama.cpp's server: whatever it writes keeps to the schema, and nothing unchecked moves."""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from robosandbox.testing.llama_server import packaged_weights

pytestmark = [
    pytest.mark.model,
    pytest.mark.slow,
    pytest.mark.skipif(
        find_spec("xllamacpp") is None or packaged_weights() is None,
        reason="no small model here: uv sync --group models",
    ),
]


def test_a_small_model_answers_by_the_schema_and_moves_nothing_unchecked() -> None:
    benchmark = Path(__file__).parent.parent / "benchmarks" / "models.py"
    options = ["--prompts", "2", "--max-turns", "1", "--max-steps", "2", "--json"]
    done = subprocess.run([sys.executable, str(benchmark), *options], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    report = json.loads(done.stdout)
    assert report["valid"] == report["by_schema"] == report["answers"] == 2
    assert report["unchecked"] == report["unfit"] == report["strayed"] == 0 and report["tokens_a_prompt"] > 500
