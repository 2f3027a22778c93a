"""Every example runs as it stands, from any folder."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.processes import SimProcess

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
NEED_A_SIM = {"03_json_client.py"}


def run(script: Path, cwd: Path) -> str:
    ended = subprocess.run([sys.executable, script], cwd=cwd, capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


@pytest.mark.parametrize("name", sorted({file.name for file in EXAMPLES.glob("*.py")} - NEED_A_SIM))
@pytest.mark.sample(every=3)
def test_example_runs(name: str, tmp_path: Path) -> None:
    assert "success=True" in run(EXAMPLES / name, tmp_path)


def test_json_client_needs_a_running_sim_and_two_imports(tmp_path: Path) -> None:
    text = (EXAMPLES / "03_json_client.py").read_text()
    assert re.findall(r"^(?:import|from) .*", text, flags=re.MULTILINE) == ["import json", "import zenoh"]
    with SimProcess("--pace", "fast") as sim:
        copy = tmp_path / "client.py"
        copy.write_text(text.replace("tcp/127.0.0.1:7447", sim.endpoint))
        said = run(copy, tmp_path)
    assert "lift" in said and "succeeded" in said and '"object": "red_cube"' in said
