"""Failures: one frozen value, and codes, phases and evidence of a skill from outside, wherever they go."""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from mcp import Client, StdioServerParameters
from pydantic import ValidationError
from support.processes import SimProcess, mcp_command

from robosandbox.errors import ErrorCode, Failure, GraspError, Phase, Repair, SkillError, TrackingError
from robosandbox.evidence import ForeignEvidence, GraspEvidence
from robosandbox.skills.primitives.guarded import MetError
from robosandbox.types import SkillCall
from robosandbox.workcell.zenoh.client import connect

WEIGH = '''
from robosandbox.errors import SkillError
from robosandbox.evidence import Evidence
from robosandbox.skills.base import Skill
from robosandbox.types import SkillResult


class WeighingEvidence(Evidence):
    """Mass on the scale, kg."""

    mass: float
    most: float

    @property
    def is_final(self) -> bool:
        return True


class OverweightError(SkillError):
    """More lies on the scale than it can weigh."""

    code = "overweight"
    evidence_type = WeighingEvidence


class Weigh(Skill):
    name = "weigh"

    def run(self, ctx, *, object: str) -> SkillResult:
        """Weigh an object.

        Args:
            object: Id of the object.
        """
        ctx.enter("weighing")
        raise OverweightError(
            f"{object} weighs 3 kg, and the scale bears 2", phase="weighing", evidence=WeighingEvidence(mass=3.0, most=2.0)
        )
'''
TOLD = {
    "code": "overweight",
    "phase": "weighing",
    "message": "red_cube weighs 3 kg, and the scale bears 2",
    "evidence": {"mass": 3.0, "most": 2.0},
    "repairs": [],
}
CLIENT = """
import json, sys
from robosandbox.workcell.zenoh.client import connect
from robosandbox.errors import SkillError
with connect(sys.argv[1]) as client:
    assert "weigh" not in sys.modules
    try:
        client.robot().send("weigh", {"object": "red_cube"}).wait()
    except SkillError as error:
        from weigh import OverweightError, WeighingEvidence
        assert type(error) is OverweightError and type(error.evidence) is WeighingEvidence
        assert error.evidence.is_final and error.evidence.mass == 3.0
        print(error.failure.model_dump_json())
"""


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return the environment of processes for which the package with the skill is installed."""
    folder = tmp_path_factory.mktemp("weigh")
    package = folder / "weigh-1.0.dist-info"
    package.mkdir()
    (folder / "weigh.py").write_text(WEIGH)
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: weigh\nVersion: 1.0\n")
    (package / "entry_points.txt").write_text("[robosandbox.skills]\nweigh = weigh:Weigh\n")
    return {**os.environ, "PYTHONPATH": str(folder)}


def test_an_outsiders_failure_crosses_zenoh_as_it_is(elsewhere: dict[str, str]) -> None:
    """A client with the package raises the package's error; one without it, as this process, one with the same fields."""
    with SimProcess("--task", "put_in_bin", environment=elsewhere) as sim:
        with connect(sim.endpoint) as client, pytest.raises(SkillError) as caught:
            client.robot().send("weigh", {"object": "red_cube"}).wait()
        error = caught.value
        assert type(error) is SkillError and isinstance(error.evidence, ForeignEvidence)
        assert (error.code, error.evidence.model_extra) == ("overweight", TOLD["evidence"])
        assert error.failure.model_dump(mode="json") == TOLD
        with_package = subprocess.run(
            [sys.executable, "-c", CLIENT, sim.endpoint], env=elsewhere, capture_output=True, text=True, timeout=120
        )
        assert with_package.returncode == 0, with_package.stderr
        assert json.loads(with_package.stdout) == TOLD


def test_an_outsiders_failure_crosses_mcp_as_it_is(elsewhere: dict[str, str]) -> None:
    async def called() -> Any:
        command = mcp_command("--task", "put_in_bin")
        async with Client(StdioServerParameters(command=command[0], args=command[1:], env=elsewhere)) as client:
            return await client.call_tool("weigh", {"object": "red_cube"})

    result = asyncio.run(called())
    assert result.is_error and result.structured_content["error"] == TOLD


def test_an_outsiders_failure_is_in_results_and_recordings(elsewhere: dict[str, str], tmp_path: Path) -> None:
    command = ["run", "weigh(object=red_cube)", "--task", "put_in_bin", "--record", str(tmp_path)]
    run = subprocess.run(
        [sys.executable, "-c", "from robosandbox.apps.cli import main; main()", *command, "--json"],
        env=elsewhere,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert run.returncode == 1, run.stderr
    assert json.loads(run.stdout)["error"] == TOLD
    (events,) = tmp_path.rglob("events.jsonl")
    told = [json.loads(line) for line in events.read_text().splitlines()]
    failures = [event["error"] for event in told if "error" in event]
    assert failures and all(failure == TOLD for failure in failures)
    assert "weighing" in [event.get("phase") for event in told]


def test_a_failure_is_frozen_and_its_error_too() -> None:
    error = GraspError("closed on nothing", phase=Phase.GRASP)
    with pytest.raises(ValidationError):
        error.failure.message = "closed on something"  # type: ignore[misc]
    for name in ("failure", "phase", "message", "evidence", "repairs"):
        with pytest.raises(AttributeError):
            setattr(error, name, None)


def test_with_makes_another_error_of_the_same_class_and_leaves_the_first() -> None:
    first = MetError("hand", "red_cube", 12.0, phase=Phase.DESCEND, joint="joint1")
    repair = Repair(calls=(SkillCall(skill="home"),), why="from another start", cost=1.0)
    second = first.with_(phase=Phase.LIFT, repairs=(repair,))
    assert type(second) is MetError and second.other == "red_cube" and second.evidence == first.evidence
    assert (first.phase, first.repairs, second.phase, second.repairs) == (Phase.DESCEND, (), Phase.LIFT, (repair,))
    assert str(second) == str(first)


def test_a_failure_read_from_json_is_the_value_that_was_written() -> None:
    evidence = GraspEvidence(object="red_cube", reason="missed", aperture=0.0, max_aperture=0.08)
    failure = GraspError("closed on nothing", phase=Phase.GRASP, evidence=evidence).failure
    read = Failure.model_validate_json(failure.model_dump_json())
    assert read == failure and type(read.exception()) is GraspError and read.exception().failure == failure


def test_evidence_of_another_version_keeps_its_fields() -> None:
    told = {"code": "grasp", "phase": "grasp", "message": "closed on nothing", "evidence": {"slip_mm": 3.5}}
    evidence = Failure.model_validate(told).evidence
    assert isinstance(evidence, ForeignEvidence) and evidence.model_extra == {"slip_mm": 3.5}


def test_a_code_belongs_to_one_class() -> None:
    with pytest.raises(TypeError, match=r"the code 'grasp' is robosandbox\.skill_errors\.GraspError's"):
        type("SlippedError", (SkillError,), {"code": ErrorCode.GRASP})
    # One that inherits its code says more of the same kind.
    assert type("SnaggedError", (TrackingError,), {}).code == ErrorCode.TRACKING
