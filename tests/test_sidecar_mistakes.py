"""A mistake in a sidecar is told once, in a line: field, value, and what to do."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from robosandbox.errors import InputError
from robosandbox.robots.check.diagnosis import advice, own_files
from robosandbox.robots.loader import load_robot
from robosandbox.types import Scene

PANDA = Path(__file__).resolve().parents[1] / "robots" / "franka_panda"
SIDECAR = (PANDA / "panda.robosandbox.yaml").read_text()


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """Return a model that is called like a part of its sidecar."""
    shutil.copytree(PANDA, tmp_path, dirs_exist_ok=True)
    (tmp_path / "panda.robosandbox.yaml").unlink()
    return (tmp_path / "panda.xml").rename(tmp_path / "arm.xml")


def said(arm: Path, text: str) -> str:
    """Return the message of a sidecar that does not load, with what checks add to it."""
    arm.with_suffix(".robosandbox.yaml").write_text(text)
    with pytest.raises(InputError) as raised:
        load_robot(arm)
    files = own_files(Scene(robot_urdf=arm))
    assert files is not None
    return f"{raised.value}{advice(files, str(raised.value))}"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "arm.robosandbox.yaml: is empty; it takes a mapping with arm, ee_site"),
        (
            SIDECAR.replace("home_qpos", "home_qpso"),
            "arm.robosandbox.yaml: arm: unknown field 'home_qpso'; did you mean 'home_qpos'?",
        ),
    ],
    ids=["empty", "typo"],
)
def test_a_file_called_like_a_part_is_not_taken_for_a_field(arm: Path, text: str, line: str) -> None:
    assert said(arm, text) == line


def test_a_gripper_field_is_named_as_it_stands_in_the_file(arm: Path) -> None:
    assert "gripper.open_qpos: 'wide': is not a number" in said(
        arm, SIDECAR.replace("open_qpos: 0.04", "open_qpos: wide")
    )


def test_a_home_in_degrees_is_asked_about(arm: Path) -> None:
    home = "[0.0, 0.0, 0.0, -1.57079, 0.0, 1.57079, -0.7853]"
    assert "arm.home_qpos[3]: -90 is outside the limits of 'joint4', -3.072..-0.0698 rad: are these degrees?" in said(
        arm, SIDECAR.replace(home, "[0, 0, 0, -90, 0, 90, -45]")
    )
    assert "are these" not in said(arm, SIDECAR.replace(home, "[0, 0, 0, 0.5, 0, 1.5, -0.7]"))
