"""Every part of the product over a driver that hides its simulator: served, driven, watched and recorded."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from robosandbox.errors import UnsupportedError
from robosandbox.service.client import connect
from robosandbox.service.client.workcell import RemoteWorkcell
from robosandbox.testing.processes import SimProcess

_TASK = "pick_cube_franka"
_HARDWARE = ("--task", _TASK, "--driver", "hardware:seed=3", "--perception", "rgbd")


def cli(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from robosandbox.cli import main; main()", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


@pytest.fixture(scope="module")
def sim() -> Iterator[SimProcess]:
    with SimProcess(*_HARDWARE, "--pace", "fast") as process:
        yield process


@pytest.mark.gl
def test_hardware_is_served_and_an_agent_in_another_process_does_the_task(sim: SimProcess) -> None:
    done = cli("agent", "--connect", sim.endpoint, "pick up the red cube")
    assert done.returncode == 0, done.stdout + done.stderr
    with connect(sim.endpoint) as client:
        robot = client.robot()
        # What the fingers hold is what perception believed when it last looked.
        assert robot.state().held == "red_cube"
        assert robot.state().physics_steps is None
        assert robot.observe().held == "red_cube"
        cell = RemoteWorkcell(robot)
        assert not cell.judgeable
        assert cell.run("go home").success
        assert cell.elapsed()[1] is None


@pytest.mark.gl
def test_pictures_of_hardware_are_what_its_cameras_deliver(sim: SimProcess) -> None:
    with connect(sim.endpoint) as client:
        robot = client.robot()
        assert robot.cameras == ("scene", "top", "wrist")
        payload, about = robot.picture("top", depth=True)
        depth = np.frombuffer(payload, np.float32)
        assert len(depth) == about.intrinsics.width * about.intrinsics.height
        assert 1.0 < np.median(depth) < 1.5


@pytest.mark.parametrize(
    ("ask", "lacks"),
    [
        ("truth", "truth: the driver of panda does not know the true state of its world"),
        ("reset", "reset: the driver of panda cannot start its world over"),
        ("load", "reset: the driver of panda cannot start its world over, and load starts another task"),
        ("checkpoint", "fork: the driver of panda cannot copy its world"),
    ],
)
def test_what_hardware_lacks_is_answered_in_one_line(sim: SimProcess, ask: str, lacks: str) -> None:
    with connect(sim.endpoint) as client:
        robot = client.robot()
        calls = {"reset": lambda: robot.reset(0), "load": lambda: robot.load(_TASK)}
        with pytest.raises(UnsupportedError, match=re.escape(lacks)) as refused:
            calls.get(ask, getattr(robot, ask))()
        assert "\n" not in refused.value.message
        # Time passes all the same.
        began = robot.state().robot.time
        assert robot.step(0.1).time == pytest.approx(began + 0.1, abs=0.02)


def test_a_state_file_of_hardware_is_refused_before_it_is_served(tmp_path: Path) -> None:
    done = cli("sim", *_HARDWARE, "--listen", "tcp/127.0.0.1:0", "--state-file", str(tmp_path / "state"))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "truth: the driver of panda does not know the true state of its world, and --state-file" in done.stderr
